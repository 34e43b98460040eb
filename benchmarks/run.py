"""Speed and memory of reading and ingesting, beside Babeltrace 2 on the same trace in one run.

    python benchmarks/run.py [--events 10000000] [--packet-bytes 0 8388608] [--runs 3]
                             [--trace DIRECTORY] [--memory-limit SIZE] [--query-limit SIZE] [--bt2]
                             [--markdown FILE]

Simulates a pipeline of nodes, once with packets of 32 KiB, as ros2_tracing records, and once with
packets of 8 MB, as those have who give LTTng large sub-buffers. Then measures in processes of their
own: our reader alone (all the columns of the catalogue, nothing kept), the ingest by stage and as
a whole, with the start of Python, the costliest queries on the result, without a memory limit and
with a small one, and `babeltrace2 -o dummy`, which decodes and does nothing.
`--bt2` adds Babeltrace's Python bindings. They take turns, so that other work on the machine slows
all of them alike. Seconds of different machines and days cannot be compared, ratios of one run can,
but not those of the first run on a virtual machine just started: memory that was never used there
takes several times as long to write, which Babeltrace hardly does.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

EVENTS_PER_FACTOR = 66_000
PEER = "babeltrace2 -o dummy"
NO_ROOM = "more memory is needed"  # What the command says where a query does not fit.
# All rows go to a file of the fastest format: what is measured is the query, not its printing.
QUERIES = ("e2e-latency", "flows", "path-breakdown", "critical-path", "waits")

SIMULATE = """
import sys; from pathlib import Path; from msgflow_sim import Recording, simulate
recording = Recording(packet_bytes=int(sys.argv[3]))
simulate("pipeline", Path(sys.argv[1]), factor=float(sys.argv[2]), recording=recording)
"""

READ = """
import json, sys, time
import numpy, pyarrow
from msgflow import trace
from msgflow.ingest.catalogue import load
begin, cpu_begin = time.monotonic(), time.process_time()
with trace.open([sys.argv[1]], reader=sys.argv[2]) as traces:
    for item in traces.batches(load().arrow_schemas()):
        pass
print(json.dumps([time.monotonic() - begin, time.process_time() - cpu_begin]))
"""

INGEST = """
import json, sys, time; from pathlib import Path; from msgflow.ingest import ingest
begins = {}
def note(progress): begins.setdefault(progress.stage, time.process_time())
report = ingest([sys.argv[1]], Path(sys.argv[2]), memory_limit=sys.argv[3] or None, progress=note)
ends = [*list(begins.values())[1:], time.process_time()]
cpu = {stage: end - begin for (stage, begin), end in zip(begins.items(), ends)}
wall = report.stage_seconds
print(json.dumps([report.event_count, {name: [wall[name], cpu.get(name, 0)] for name in wall}]))
"""


@dataclass(frozen=True)
class Sample:
    """One run: wall and CPU time [s], peak memory [bytes] of its process, 0 for a part of it."""

    wall: float
    cpu: float
    peak_bytes: int = 0


class Failed(SystemExit):
    """A process ended with an error: its command, and what it said. Ends the benchmark, too."""


def run(*command: str) -> tuple[str, Sample]:
    """Run a process; return its output and what it took.

    Raises:
        Failed: it ended with an error.
    """
    begin = time.monotonic()
    with tempfile.TemporaryFile("w+") as output, tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(command, stdout=output, stderr=errors)
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.monotonic() - begin
        output.seek(0)
        errors.seek(0)
        if os.waitstatus_to_exitcode(status):
            raise Failed(f"failed: {' '.join(command)}\n{errors.read()}")
        sys.stderr.write(errors.read())
        sample = Sample(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024)
        return output.read(), sample


def measure(
    trace: str, database: Path, arguments: argparse.Namespace
) -> tuple[int, dict[str, Sample | None]]:
    """Measure everything on one trace once.

    Returns:
        The number of events, and what each process took; None where it did not fit into its limit.
    """
    samples: dict[str, Sample | None] = {}
    if shutil.which("babeltrace2"):
        _, samples[PEER] = run("babeltrace2", "-o", "dummy", trace)
    for reader, name in (("msgflow", "reader alone"), ("bt2", "reader bt2 (Python bindings)")):
        if reader == "msgflow" or arguments.bt2:
            output, sample = run(sys.executable, "-c", READ, trace, reader)
            wall, cpu = json.loads(output)
            samples[name] = Sample(wall, cpu, sample.peak_bytes)
    database.unlink(missing_ok=True)
    output, sample = run(sys.executable, "-c", INGEST, trace, str(database), arguments.memory_limit)
    events, stages = json.loads(output)
    samples |= {f"ingest: {name}": Sample(*taken) for name, taken in stages.items()}
    samples["ingest, whole"] = sample
    result = str(database.with_suffix(".parquet"))
    for name in QUERIES:
        query = (sys.executable, "-m", "msgflow", "query", name, "--db", str(database))
        _, samples[f"query {name}"] = run(*query, "--output", result)
        if limit := arguments.query_limit:
            samples[f"query {name}, limit {limit}"] = _if_it_fits(
                *query, "--memory-limit", limit, "--output", result
            )
    return events, samples


def _if_it_fits(*command: str) -> Sample | None:
    """Return what a process took; None where its memory limit was too small."""
    try:
        return run(*command)[1]
    except Failed as failed:
        if NO_ROOM not in str(failed):
            raise
        return None


def report(rounds: list[dict[str, Sample | None]], events: int) -> list[str]:
    """Return the lines of a Markdown table; ratios are those within a round."""
    lines = [
        f"| median (least to most) | seconds | CPU | events/s | ratio to `{PEER}` | ratio of CPU "
        "| peak memory |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for name in rounds[0]:
        taken = [(sample, each.get(PEER)) for each in rounds if (sample := each[name])]
        if not taken:
            lines.append(f"| {name} | does not fit | | | | | |")
            continue
        if len(taken) < len(rounds):
            name += f" (fits in {len(taken)} of {len(rounds)})"
        samples = [sample for sample, _ in taken]
        walls = [sample.wall for sample in samples]
        wall = statistics.median(walls)
        cpu = statistics.median(sample.cpu for sample in samples)
        ratio = cpu_ratio = ""
        if PEER in rounds[0]:
            ratio = _spread([sample.wall / peer.wall for sample, peer in taken if peer])
            cpu_ratio = _spread([sample.cpu / peer.cpu for sample, peer in taken if peer])
        peaks = [sample.peak_bytes for sample in samples if sample.peak_bytes]
        peak = f"{max(peaks) / 1e6:,.0f} MB" if peaks else ""
        rate = f"{events / wall:,.0f}" if wall > 0.005 else ""
        lines.append(
            f"| {name} | {_spread(walls)} | {cpu:.2f} | {rate} | {ratio} | {cpu_ratio} | {peak} |"
        )
    return lines


def _spread(values: list[float]) -> str:
    return f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def table(trace: str, directory: Path, what: str, arguments: argparse.Namespace) -> str:
    """Measure one trace as often as asked; return the text about it."""
    database = directory / "bench.duckdb"
    rounds = []
    for _ in range(arguments.runs):
        events, samples = measure(trace, database, arguments)
        rounds.append(samples)
    lines = [
        f"{datetime.now(timezone.utc):%Y-%m-%d}: {events:,} events{what}, {os.cpu_count()} cores "
        f"({platform.machine()}), Python {platform.python_version()}, memory limit "
        f"{arguments.memory_limit or 'as needed'}, database "
        f"{database.stat().st_size / 1e6:,.0f} MB, {arguments.runs} runs, "
        f"load {os.getloadavg()[0]:.1f} at the end.",
        "",
        *report(rounds, events),
    ]
    return "\n".join(lines)


def main() -> None:
    """Simulate, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--events", type=int, default=10_000_000)
    parser.add_argument(
        "--packet-bytes", type=int, nargs="+", default=[0, 8 << 20], help="0: as usual, 32 KiB"
    )
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--trace", help="measure on this trace instead of simulated ones")
    parser.add_argument("--memory-limit", default="", help="as of `msgflow ingest`")
    parser.add_argument(
        "--query-limit", default="300MB", help="memory limit of queries, beside none"
    )
    parser.add_argument("--bt2", action="store_true", help="measure the bt2 reader, too")
    parser.add_argument("--markdown", type=Path, help="append the tables to this file")
    arguments = parser.parse_args()
    # Users have byte code: pip writes it, or the first call.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    for packet_bytes in [0] if arguments.trace else arguments.packet_bytes:
        with tempfile.TemporaryDirectory() as directory:
            trace, what = arguments.trace, ""
            if trace is None:
                trace = str(Path(directory) / "trace")
                what = f" in packets of {packet_bytes or 32 << 10:,} bytes"
                factor = arguments.events / EVENTS_PER_FACTOR
                run(sys.executable, "-c", SIMULATE, trace, str(factor), str(packet_bytes))
            text = table(trace, Path(directory), what, arguments)
        print(text, flush=True)
        if arguments.markdown:
            with arguments.markdown.open("a") as stream:
                stream.write(f"\n{text}\n")


if __name__ == "__main__":
    main()
