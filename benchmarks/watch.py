"""What a step of `msgflow watch` costs, by the number of events, and whether memory stays flat.

    python benchmarks/watch.py [--events 1000 10000 100000] [--chunks 8]

For each number of events a pipeline of nodes is simulated, and its recording rotated into chunks of
that many events. Windows and steps are as long as a chunk, so that a step reads one chunk, and
analyses five at most: those of its window, and of the time before and behind it that `--late` says.
Printed are the CPU time of a step (median), the part of it that grows with the events, and the
memory of the process after a third of the steps and after all. CPU times of a machine that has
other work are longer than those of an idle one.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.clocks.clocks_file import read_clock_sync
from msgflow.watch.follow import watch_finished
from msgflow.watch.watcher import Watcher
from msgflow_sim import Recording, simulate

if TYPE_CHECKING:
    from msgflow.watch.chunk import Chunk

EVENTS_PER_FACTOR = 66_000
SECOND_NS = 1_000_000_000
FACTOR_NS = 10 * SECOND_NS
PAGES_PER_MEGABYTE = 256


def main() -> None:
    """Measure each number of events, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--events", type=int, nargs="+", default=[1_000, 10_000, 100_000])
    parser.add_argument("--chunks", type=int, default=8)
    given = parser.parse_args()
    print("events per chunk  CPU of a step [s]  CPU of reading [s]     memory early, late [MB]")
    found = []
    for events in given.events:
        cpu, reading, early, late = measured(events, given.chunks)
        found.append((events, cpu))
        print(f"{events:16,}  {cpu:17.2f}  {reading:20.2f}  {early:12,} {late:10,}", flush=True)
    if len(found) > 1:
        (few, least), (many, most) = found[0], found[-1]
        slope = (most - least) / (many - few)
        print(f"fixed: {least - slope * few:.2f} s, and {slope * 1e6:.1f} µs per event of a chunk")


def measured(events: int, chunks: int) -> tuple[float, float, int, int]:
    """Return the CPU time of a step and of its reading [s], and the memory early and late [MB]."""
    factor = events * chunks / EVENTS_PER_FACTOR
    length = round(FACTOR_NS * factor) // chunks
    with tempfile.TemporaryDirectory() as directory:
        recording = Recording(rotations=tuple(length * n for n in range(1, chunks)))
        simulate("pipeline", Path(directory) / "trace", factor=factor, recording=recording)
        watcher = _Timed(
            window_ns=length,
            step_ns=length,
            late_ns=length,
            links=None,
            clocks=read_clock_sync("none"),
            note=print,
        )
        steps, memory = [], []
        begin = time.process_time()
        for _ in watch_finished(Path(directory) / "trace", watcher):
            end = time.process_time()
            steps.append(end - begin)
            memory.append(_resident_megabytes())
            begin = end
    # The first step imports, the last ones have fewer chunks around them.
    inner = steps[1:-1]
    reading = statistics.median(watcher.reading)
    return statistics.median(inner), reading, memory[len(memory) // 3], memory[-1]


class _Timed(Watcher):
    """A watcher that knows how long it took to read each chunk."""

    def __init__(self, **given: Any) -> None:
        """Start like any watcher."""
        super().__init__(**given)
        self.reading: list[float] = []

    def read(self, chunk: Chunk) -> None:
        """Read a chunk."""
        begin = time.process_time()
        super().read(chunk)
        self.reading.append(time.process_time() - begin)


def _resident_megabytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) // PAGES_PER_MEGABYTE


if __name__ == "__main__":
    main()
