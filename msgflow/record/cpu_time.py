"""CPU time of threads, C++ and all: a second session of LTTng, which reads their clocks."""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import struct
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from fnmatch import fnmatchcase
from pathlib import Path

from msgflow.errors import RecordingError
from msgflow.record.session import CONTEXTS, Channel, recording_session

DIRECTORY = "cpu"
"""Where the session writes, in the directory of a recording."""

# Where a thread begins to compute for a callback, and where it stops.
EVENTS = (
    "ros2:callback_start",
    "ros2:callback_end",
    "ros2:rclcpp_executor_wait_for_work",
    "ros2:rclcpp_executor_execute",
)
"""At which events the clocks are read."""
# Numbers of the system call perf_event_open, where LTTng has its contexts.
_CALLS = {"x86_64": 298, "i686": 336, "aarch64": 241, "armv7l": 364}
# A counter of software, the clock of a task, not in the kernel: as LTTng asks for it.
_CLOCK = struct.pack("=IIQQQQQQQ", 1, 64, 1, 0, 0, 0, 1 << 5, 0, 0)


@contextmanager
def recorded_cpu_time(
    name: str, directory: Path, channel: Channel, note: Callable[[str], None]
) -> Iterator[None]:
    """Record the clocks during the block, beside a session of this name, where that is allowed.

    Where a process may not read its clock, LTTng records none of its events in a session that asks
    for it, and now and then none of others that share its buffers. So the session of the events
    does not ask for it, and in this one processes share none; but for chunks, which would have a
    trace of each process.
    """
    # What that leaves out costs nothing here.
    events = [
        event
        for event in EVENTS
        if not any(fnmatchcase(event, pattern) for pattern in channel.without)
    ]
    clocks = Channel(
        events=(",".join(events),),
        # A second of thousands of callbacks of a process, on each CPU.
        sub_buffer_size="64K" if channel.rotation_ns is None else channel.sub_buffer_size,
        contexts=(*CONTEXTS, "perf:thread:task-clock"),
        is_per_process=channel.rotation_ns is None,
        rotation_ns=channel.rotation_ns,
    )
    place = directory / DIRECTORY
    with ExitStack() as stack:
        if (reason := why_not()) is None:
            place.mkdir()
            try:
                session = recording_session(f"{name}-cpu", place, clocks)
                stack.enter_context(session)
            except RecordingError as error:
                reason = error.message
                shutil.rmtree(place)
        if reason is not None:
            note(f"CPU time is recorded of callbacks of Python nodes only: {reason}")
        yield


def why_not() -> str | None:
    """Return why a process like this one may not read the clocks of its threads."""
    call = _CALLS.get(platform.machine())
    if call is None:
        return f"LTTng reads no clocks of threads on {platform.machine()}"
    library = ctypes.CDLL(None, use_errno=True)
    # Of this thread, on any CPU.
    opened = library.syscall(call, _CLOCK, 0, -1, -1, 0)
    if opened < 0:
        reason = os.strerror(ctypes.get_errno()).lower()
        return (
            f"perf_event_open: {reason}; it needs sysctl kernel.perf_event_paranoid=2, root or"
            " CAP_PERFMON, and in a container a seccomp profile that allows it"
        )
    os.close(opened)
    return None
