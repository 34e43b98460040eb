"""Measures an ingest of a simulated trace by stage, beside Babeltrace 2 decoding the same trace.

    python benchmarks/ingest.py [--events 1000000] [--memory-limit 640MB] [--reader auto]

Prints one row per stage: seconds, events per second, and the ratio to `babeltrace2 -o dummy` of the
same run where that is installed (times of different machines or days cannot be compared, ratios
can); then the peak memory of the process that ingested, and a named query on the result.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

EVENTS_PER_FACTOR = 66_000

INGEST = """
import json, resource, sys
from pathlib import Path
from msgflow.ingest import ingest
trace, database, limit, reader = sys.argv[1:]
report = ingest([trace], Path(database), memory_limit=limit, reader=reader)
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
print(json.dumps([report.event_count, peak, dict(report.stage_seconds)]))
"""


def decode_seconds(trace: Path) -> float | None:
    """Return the wall time of `babeltrace2 -o dummy` [s], None where it is not installed."""
    if shutil.which("babeltrace2") is None:
        return None
    started = time.monotonic()
    subprocess.run(["babeltrace2", "-o", "dummy", str(trace)], check=True, capture_output=True)
    return time.monotonic() - started


def main() -> None:
    """Simulate, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--events", type=int, default=1_000_000)
    parser.add_argument("--memory-limit", default="640MB")
    parser.add_argument("--reader", default="auto")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        trace, database = Path(directory) / "trace", Path(directory) / "bench.duckdb"
        simulate = (
            "import sys; from pathlib import Path; from msgflow.sim import simulate;"
            "simulate('pipeline', Path(sys.argv[1]), factor=float(sys.argv[2]))"
        )
        factor = arguments.events / EVENTS_PER_FACTOR
        subprocess.run([sys.executable, "-c", simulate, str(trace), str(factor)], check=True)
        decode = decode_seconds(trace)
        output = subprocess.run(
            [
                sys.executable, "-c", INGEST, str(trace), str(database),
                arguments.memory_limit, arguments.reader,
            ],
            check=True,
            capture_output=True,
            text=True,
        )  # fmt: skip
        events, peak, stages = json.loads(output.stdout)
        started = time.monotonic()
        query = [sys.executable, "-m", "msgflow", "query", "e2e-latency", "--db", str(database)]
        subprocess.run(query, check=True, capture_output=True)
        query_seconds = time.monotonic() - started
        size = database.stat().st_size
    print(f"{events:,} events, memory limit {arguments.memory_limit}")
    rows = {**stages, "whole ingest": sum(stages.values())}
    sql = ("building the model", "storing the run", "linking messages", "checking the database")
    rows["of that SQL"] = sum(stages[name] for name in sql)
    rows["query e2e-latency"] = query_seconds
    if decode is not None:
        rows["babeltrace2 -o dummy"] = decode
    for name, seconds in rows.items():
        ratio = f"{seconds / decode:6.2f} x" if decode else ""
        rate = f"{events / seconds:13,.0f} events/s" if seconds else ""
        print(f"{name:24} {seconds:8.2f} s {rate} {ratio}")
    print(f"peak memory {peak / 1e6:,.0f} MB, database {size / 1e6:,.1f} MB")


if __name__ == "__main__":
    main()
