"""Speed and memory of reading and ingesting, beside Babeltrace 2 on the same trace in one run.

    python benchmarks/run.py [--events 10000000 | --trace DIRECTORY] [--memory-limit SIZE] [--bt2]
                             [--markdown FILE]

Simulates a pipeline of nodes, then measures in processes of their own: our reader alone (all the
columns of the catalogue, nothing kept), the whole ingest by stage, the query e2e-latency on the
result, and `babeltrace2 -o dummy`, which decodes and does nothing. `--bt2` adds Babeltrace's Python
bindings. Seconds of different machines and days cannot be compared, ratios of one run can.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

EVENTS_PER_FACTOR = 66_000

SIMULATE = """
import sys; from pathlib import Path; from msgflow.sim import simulate
print(simulate("pipeline", Path(sys.argv[1]), factor=float(sys.argv[2])).event_count)
"""

READ = """
import sys, time
import numpy, pyarrow
from msgflow import trace
from msgflow.ingest.catalogue import load
begin = time.monotonic()
with trace.open([sys.argv[1]], reader=sys.argv[2]) as traces:
    for item in traces.batches(load().arrow_schemas()):
        pass
print(time.monotonic() - begin)
"""

INGEST = """
import json, sys; from pathlib import Path; from msgflow.ingest import ingest
report = ingest([sys.argv[1]], Path(sys.argv[2]), memory_limit=sys.argv[3] or None)
print(json.dumps([report.event_count, dict(report.stage_seconds)]))
"""


@dataclass(frozen=True)
class Row:
    """One measurement: wall time [s], and peak memory of its process [bytes] where measured."""

    name: str
    seconds: float
    peak_bytes: int | None = None


def run(*command: str) -> tuple[str, float, int]:
    """Run a process; return its output, wall time [s] and peak resident memory [bytes]."""
    begin = time.monotonic()
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(command, stdout=output)
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.monotonic() - begin
        if os.waitstatus_to_exitcode(status):
            raise SystemExit(f"failed: {' '.join(command)}")
        output.seek(0)
        return output.read(), seconds, usage.ru_maxrss * 1024


def measure(trace: str, database: str, memory_limit: str, with_bt2: bool) -> tuple[int, list[Row]]:
    """Measure everything on one trace; return its number of events and the measurements."""
    rows = []
    if shutil.which("babeltrace2"):
        _, seconds, peak = run("babeltrace2", "-o", "dummy", trace)
        rows.append(Row("babeltrace2 -o dummy", seconds, peak))
    output, _, peak = run(sys.executable, "-c", READ, trace, "msgflow")
    rows.append(Row("reader alone", float(output), peak))
    if with_bt2:
        output, _, peak = run(sys.executable, "-c", READ, trace, "bt2")
        rows.append(Row("reader bt2 (Python bindings)", float(output), peak))
    output, _, peak = run(sys.executable, "-c", INGEST, trace, database, memory_limit)
    events, stages = json.loads(output)
    rows += [Row(f"ingest: {name}", seconds) for name, seconds in stages.items()]
    rows.append(Row("ingest, whole", sum(stages.values()), peak))
    query = (sys.executable, "-m", "msgflow", "query", "e2e-latency", "--db", database)
    _, seconds, peak = run(*query)
    rows.append(Row("query e2e-latency", seconds, peak))
    return events, rows


def report(rows: list[Row], events: int) -> list[str]:
    """Return the lines of a Markdown table."""
    peer = next((row.seconds for row in rows if row.name.startswith("babeltrace2")), None)
    lines = [
        "| | seconds | events/s | ratio to `babeltrace2 -o dummy` | peak memory |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for row in rows:
        ratio = f"{row.seconds / peer:.2f}" if peer else ""
        peak = f"{row.peak_bytes / 1e6:,.0f} MB" if row.peak_bytes else ""
        rate = f"{events / row.seconds:,.0f}" if row.seconds > 0.005 else ""
        lines.append(f"| {row.name} | {row.seconds:.2f} | {rate} | {ratio} | {peak} |")
    return lines


def main() -> None:
    """Simulate, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--events", type=int, default=10_000_000)
    parser.add_argument("--trace", help="measure on this trace instead of a simulated one")
    parser.add_argument("--memory-limit", default="", help="as of `msgflow ingest`")
    parser.add_argument("--bt2", action="store_true", help="measure the bt2 reader, too")
    parser.add_argument("--markdown", type=Path, help="append the table to this file")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        trace, database = arguments.trace, str(Path(directory) / "bench.duckdb")
        if trace is None:
            trace = str(Path(directory) / "trace")
            factor = arguments.events / EVENTS_PER_FACTOR
            run(sys.executable, "-c", SIMULATE, trace, str(factor))
        events, rows = measure(trace, database, arguments.memory_limit, arguments.bt2)
        size = Path(database).stat().st_size
    load = os.getloadavg()[0]
    lines = [
        f"{datetime.now(UTC):%Y-%m-%d}: {events:,} events, {os.cpu_count()} cores "
        f"({platform.machine()}), Python {platform.python_version()}, memory limit "
        f"{arguments.memory_limit or 'as needed'}, database {size / 1e6:,.0f} MB, "
        f"load {load:.1f} at the end.",
        "",
        *report(rows, events),
    ]
    text = "\n".join(lines)
    print(text)
    if arguments.markdown:
        with arguments.markdown.open("a") as stream:
            stream.write(f"\n{text}\n")


if __name__ == "__main__":
    main()
