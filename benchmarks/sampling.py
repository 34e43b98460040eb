"""What it costs to sample the system beside a recording: the CPU time of the sampler.

    python benchmarks/sampling.py [--threads 60] [--processes 300] [--seconds 20]

Of the threads of processes that seem to have loaded the tracepoints of ROS 2, a part works a little
a hundred times a second, as executors and receivers of DDS do, and the others once. All other
processes sleep. What the sampler takes to start is left out.
"""

from __future__ import annotations

import argparse
import gzip
import resource
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

from msgflow.record.system_samples import sampled
from msgflow.trace.discovery import SYSTEM_SAMPLES as FILE

_THREADS = 10
_START = 5.0
_WORK = """
import mmap, sys, threading, time
library = open(sys.argv[1], "rb")
mapped = mmap.mmap(library.fileno(), 0, prot=mmap.PROT_READ)
def work(seconds):
    while True:
        time.sleep(seconds)
        sum(range(100))
for number in range(int(sys.argv[2])):
    threading.Thread(target=work, args=[0.01 if number < int(sys.argv[3]) else 1]).start()
"""


def main() -> None:
    """Print the share of a CPU, and how much is written."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--threads", type=int, default=60)
    parser.add_argument("--processes", type=int, default=300)
    parser.add_argument("--busy", type=int, default=4, help="threads of each process, of ten")
    parser.add_argument("--seconds", type=float, default=20.0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        library = Path(folder, "libtracetools.so")
        library.write_bytes(bytes(resource.getpagesize()))
        traced = -(-asked.threads // _THREADS)
        work = [sys.executable, "-c", _WORK, str(library), str(_THREADS), str(asked.busy)]
        for command, count in ((work, traced), (["sleep", "inf"], _missing(asked) - traced)):
            for _ in range(count):
                process = subprocess.Popen(command, stdin=subprocess.DEVNULL)
                stack.callback(process.wait)
                stack.callback(process.kill)
        time.sleep(_START)
        running = len(list(Path("/proc").glob("[0-9]*")))
        short, *_ = _cost(_START)
        long, size, looks = _cost(_START + asked.seconds)
        share = (long - short) / asked.seconds
        print(f"{traced * _THREADS} threads among {running} processes: {share:.2%} of a CPU")
        seconds = _START + asked.seconds
        print(f"{looks / seconds:.1f} looks, and {size / seconds / 1e3:.1f} kB written per second")


def _missing(asked: argparse.Namespace) -> int:
    return int(asked.processes) - len(list(Path("/proc").glob("[0-9]*")))


def _cost(seconds: float) -> tuple[float, int, int]:
    """Return the CPU time of a sampler that runs for some seconds, what it wrote, and its looks."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        with sampled(Path(folder), print):
            time.sleep(seconds)
        file = Path(folder, FILE)
        size, looks = file.stat().st_size, gzip.decompress(file.read_bytes()).count(b"\nlook\t")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, size, looks


if __name__ == "__main__":
    main()
