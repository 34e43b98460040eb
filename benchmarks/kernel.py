"""Cost of a kernel trace beside ROS events, beside Babeltrace 2 on the same traces in one run.

    python benchmarks/kernel.py [--events 1000000] [--per-event 10] [--runs 3]

Simulates a pipeline of nodes with so many events, and a kernel trace of its schedule with
`--per-event` times as many (benchmarks/kernel_trace.py). Then measures the ingest of both together
and of the ROS events alone, in turn with `babeltrace2 -o dummy`. The budget: 10 million kernel
events beside one million ROS events cost at most 2.5 times Babeltrace's decoding of both, and need
no more memory than an ingest of 10 million ROS events (benchmarks/run.py).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from kernel_trace import write_beside
from run import EVENTS_PER_FACTOR, INGEST, PEER, SIMULATE, Sample, report, run


def measure(traces: Path, database: Path) -> tuple[int, dict[str, Sample | None]]:
    """Measure once; return the number of events of both, and what each process took."""
    samples: dict[str, Sample | None] = {}
    _, samples[PEER] = run("babeltrace2", "-o", "dummy", str(traces))
    events = 0
    for what, trace in (("ingest of both", traces), ("ingest of the ROS events", traces / "ust")):
        database.unlink(missing_ok=True)
        output, samples[what] = run(sys.executable, "-c", INGEST, str(trace), str(database), "")
        events = max(events, int(output[1 : output.index(",")]))
    return events, samples


def main() -> None:
    """Simulate, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--events", type=int, default=1_000_000)
    parser.add_argument("--per-event", type=int, default=10)
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        traces = Path(directory) / "trace"
        factor = str(arguments.events / EVENTS_PER_FACTOR)
        run(sys.executable, "-c", SIMULATE, str(traces / "ust"), factor, str(8 << 20))
        wanted = arguments.events * arguments.per_event
        count = write_beside(traces / "ust", traces / "kernel", wanted)
        rounds = []
        events = 0
        for _ in range(arguments.runs):
            events, samples = measure(traces, Path(directory) / "bench.duckdb")
            rounds.append(samples)
    print(f"{events:,} events, {count:,} of them the kernel's, {arguments.runs} runs\n")
    print("\n".join(report(rounds, events)))


if __name__ == "__main__":
    main()
