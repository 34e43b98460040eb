"""What an event costs on this machine, measured before a recording and kept beside it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from threading import Timer

from msgflow.errors import RecordingError
from msgflow.files.temporary_owner import mark, temporary_directory
from msgflow.record.session import TEMPORARY, Channel, recording_session
from msgflow.trace.regular_file import read_regular

USUAL_NS = 158.0
"""Nanoseconds of an event, as the authors of the method have them."""

_FILE = "event-cost-ns"
# From the directory of a recording down to that of its trace: ust/uid/0/64-bit.
_LEVELS = 5
_EVENT = "ros2:callback_end"
# What takes less is no event: the library has no tracepoints.
_LEAST_NS = 10
_MOST_NS = 1e6
_MOST_BYTES = 64
_LONGEST_S = 5.0
# A child process calls the library that the nodes will load. It measures the call first without a
# session, then with one.
_MEASURE = """
import ctypes, time
event = ctypes.CDLL("libtracetools.so").ros_trace_callback_end
event.argtypes, event.restype = [ctypes.c_void_p], None
def shortest():
    times = []
    for _ in range(20):
        begin = time.perf_counter_ns()
        for _ in range(500):
            event(0)
        times.append(time.perf_counter_ns() - begin)
    return min(times) / 500
without = shortest()
print("ready", flush=True)
input()
print(shortest() - without, flush=True)
"""


def measure_event_cost(directory: Path, channel: Channel) -> None:
    """Measure what an event costs, in less than a second, and write it into a directory.

    Nothing is written where this cannot be measured: without the library of ROS 2's tracepoints in
    the environment, or with one that does nothing.
    """
    with suppress(RecordingError, OSError, ValueError):
        cost = _measured(channel)
        if cost > _LEAST_NS:
            (directory / _FILE).write_text(f"{cost:.0f}\n", "utf-8")


def _measured(channel: Channel) -> float:
    only = Channel((_EVENT,), channel.sub_buffer_size, channel.sub_buffers)
    with (
        temporary_directory(TEMPORARY) as directory,
        subprocess.Popen(
            [sys.executable, "-I", "-c", _MEASURE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        ) as child,
    ):
        assert child.stdin is not None
        assert child.stdout is not None
        # LTTng may let a process wait for its daemon for ever.
        late = Timer(_LONGEST_S, child.kill)
        late.start()
        try:
            if not child.stdout.readline():
                raise ValueError("no library")
            name = f"msgflow-cost-{mark()}"
            with recording_session(name, directory, only):
                child.stdin.write("\n")
                child.stdin.flush()
                return float(child.stdout.readline())
        finally:
            late.cancel()
            child.kill()


def event_cost_ns(traces: Iterable[str]) -> float | None:
    """Return what an event cost where the traces were made; None if none of them says so."""
    for trace in traces:
        for folder in [Path(trace), *Path(trace).parents][:_LEVELS]:
            # The folder is what a database says, and that may be a stranger's: a pipe would hang.
            with suppress(OSError, ValueError):
                cost = float(read_regular(folder / _FILE, _MOST_BYTES))
                return cost if _LEAST_NS < cost < _MOST_NS else None
    return None
