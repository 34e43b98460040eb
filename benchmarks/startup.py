"""Measures what a user waits for before anything happens: help, Tab, and a query on little data.

    python benchmarks/startup.py [--runs 15]

Prints the median wall time of each command and its ratio to `python -c pass` of the same run (times
of different machines or days cannot be compared, ratios can). The commands take turns, so that
other work on the machine slows all of them alike.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PYTHON = "python -c pass"
TAB = "Tab: "
# What a console script does; `python -m` has another name for completion.
SCRIPT = "import sys; sys.argv[0] = 'msgflow'; from msgflow.__main__ import program; program()"


def seconds(command: list[str]) -> float:
    """Return the wall time of a command [s]."""
    started = time.perf_counter()
    environment = dict(os.environ)
    if command[-1].startswith(TAB):
        line = command[-1].removeprefix(TAB)
        environment |= {
            "_MSGFLOW_COMPLETE": "complete_bash",
            "COMP_WORDS": line,
            "COMP_CWORD": str(len(line.split()) - 1),
        }
        command = command[:-1]
    subprocess.run(command, check=True, capture_output=True, env=environment)
    return time.perf_counter() - started


def main() -> None:
    """Simulate, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=15)
    runs = parser.parse_args().runs
    # Users have byte code: pip writes it, or the first call.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    msgflow = [sys.executable, "-m", "msgflow"]
    with tempfile.TemporaryDirectory() as directory:
        trace, database = Path(directory) / "trace", Path(directory) / "bench.duckdb"
        for arguments in (
            ["simulate", "pipeline", str(trace), "--factor", "0.05"],
            ["ingest", str(trace), "--db", str(database)],
        ):
            subprocess.run([*msgflow, *arguments], check=True, capture_output=True)
        commands = {
            PYTHON: [sys.executable, "-c", "pass"],
            "msgflow --help": [*msgflow, "--help"],
            "msgflow query --list": [*msgflow, "query", "--list"],
            "msgflow query info-topics": [*msgflow, "query", "info-topics", "--db", str(database)],
            "msgflow query e2e-latency": [*msgflow, "query", "e2e-latency", "--db", str(database)],
        }
        for words in ("query e2e", f"query flows --db {database} --topic /"):
            line = f"msgflow {words}"
            shown = line.replace(f" --db {database}", "")
            commands[f"{shown} Tab"] = [sys.executable, "-c", SCRIPT, f"{TAB}{line}"]
        for command in commands.values():
            seconds(command)  # byte code and files are in the cache afterwards
        measured: dict[str, list[float]] = {name: [] for name in commands}
        for _ in range(runs):
            for name, command in commands.items():
                measured[name].append(seconds(command))
    python = statistics.median(measured[PYTHON])
    for name, times in measured.items():
        median = statistics.median(times)
        print(f"{name:32} {median * 1000:7.0f} ms {median / python:6.1f} x")


if __name__ == "__main__":
    main()
