"""`msgflow watch` under load: lag, CPU, memory, and whether it misses a violation.

    python benchmarks/watch_load.py [--events 50000] [--minutes 30] [--paths 20] [--window 10s]

A program makes events of ROS 2 at this rate (recording/load.c), LTTng records them, and `msgflow
watch` shows them. Once a minute a node of one path is slow for five seconds: an alarm has to tell
each time. Needs LTTng, its headers, and gcc. The figures are of the watcher alone.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from recording.tracetools import build_program, build_tracetools

SLOW_SECONDS, SLOW_EVERY = 5, 60
TARGETS = """
targets:
  - path: [/scan_0, /filtered_0]
    latency: max < 80 ms
"""
_EARLY_SECONDS = 300
_KILOBYTES_PER_MEGABYTE = 1024
_SECOND_NS = 1_000_000_000


def main() -> None:
    """Watch for so long, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--events", type=int, default=50_000, help="per second")
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--paths", type=int, default=20)
    parser.add_argument("--window", default="10s")
    parser.add_argument("--step", default="2s")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        build_tracetools(directory)
        program = build_program(Path(__file__).parent / "recording" / "load.c", directory)
        targets = directory / "targets.yaml"
        targets.write_text(TARGETS)
        load = [str(program), str(given.paths), str(given.events), str(round(given.minutes * 60))]
        # Processes that are forked need the second library to be traced.
        made = ["env", f"LD_LIBRARY_PATH={directory}", "LD_PRELOAD=liblttng-ust-fork.so", *load]
        made += [str(SLOW_SECONDS), str(SLOW_EVERY)]
        options = ["--json", "--window", given.window, "--step", given.step, "--targets", targets]
        command = [sys.executable, "-m", "msgflow", "watch", *map(str, options), "--", *made]
        environment = os.environ | {"LTTNG_UST_REGISTER_TIMEOUT": "-1"}
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as run:
            report(run)


def report(run: subprocess.Popen[str]) -> None:
    """Read the windows of a watcher, and print its figures."""
    assert run.stdout is not None
    begin = time.monotonic()
    lags, steps, told, flows, discarded = [], [], [], 0, 0
    early = last = (0, 0.0)
    end_ns = 0
    for line in run.stdout:
        window = json.loads(line)
        # Behind its last line, the watcher may have ended.
        with contextlib.suppress(StopIteration, FileNotFoundError):
            last = _megabytes(run.pid), _cpu_seconds(run.pid)
        if time.monotonic() - begin < _EARLY_SECONDS:
            early = last
        if window["lag_s"] is not None:
            lags.append(window["lag_s"])
        if end_ns:
            steps.append((window["end_ns"] - end_ns) / _SECOND_NS)
        end_ns = window["end_ns"]
        flows = max(flows, sum(path["reached"] for path in window["paths"]))
        discarded = max(discarded, window["discarded_events"])
        told += [each["at_ns"] // _SECOND_NS // SLOW_EVERY for each in window["violations"]]
    seconds = time.monotonic() - begin
    ordered = sorted(lags)
    print(f"{seconds:,.0f} s, {len(lags)} windows, steps of {statistics.median(steps):.1f} s")
    print(f"flows in a window       {flows:,}")
    print(f"lag median, p95, max    {statistics.median(lags):.1f} s,", end=" ")
    print(f"{ordered[int(len(ordered) * 0.95)]:.1f} s, {ordered[-1]:.1f} s")
    print(f"longest step            {max(steps):.1f} s")
    print(f"CPU                     {last[1] / seconds:.2f} cores")
    print(f"memory early, late      {early[0]:,} MB, {last[0]:,} MB")
    print(f"events lost in a window {discarded:,}")
    print(f"violations told         {len(set(told))} of {int(seconds // SLOW_EVERY)}")


def _cpu_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _megabytes(pid: int) -> int:
    text = Path(f"/proc/{pid}/status").read_text()
    line = next(line for line in text.splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) // _KILOBYTES_PER_MEGABYTE


if __name__ == "__main__":
    main()
