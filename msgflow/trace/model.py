"""Traces as the rest of msgflow sees them: location, description, batches, progress, damage."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyarrow as pa

PACKET = "packet"
"""Name of the batches that hold packets instead of events."""


@dataclass(frozen=True)
class TraceLocation:
    """A directory that holds one CTF trace."""

    path: Path  # the directory, absolute, symbolic links resolved
    size_bytes: int  # total size of its stream files (without metadata and indexes)
    # Streams beside or below it that belong to no trace, as their metadata is missing.
    strays: tuple[Path, ...] = ()


@dataclass(frozen=True)
class TraceInfo:
    """What a trace declares about itself; known before its events are read.

    A trace without any stream file keeps its place in the order but declares nothing.
    """

    index: int  # place of the trace among those opened together, from 0, in order of path
    path: Path  # the directory; in an archive, the archive's path followed by that inside
    uuid: str | None = None  # the CTF trace uuid, lower case with hyphens, or None
    domain: str | None = None  # 'ust', 'kernel', or None when the tracer does not say
    hostname: str | None = None  # name of the machine or container, or None
    tracer: str | None = None  # name and version, such as 'lttng-ust 2.13', or None
    clock_uuid: str | None = None  # uuid of the clock (LTTng: the boot id), or None
    clock_name: str | None = None  # name of the clock, such as 'monotonic', or None
    clock_offset_ns: int = 0  # nanoseconds from the epoch to the origin of the clock, as declared
    clock_frequency: int = 0  # how often the clock counts [Hz]; 0 without event data
    # What is added to the offset, to be on one time base with the first trace of the same clock
    # that is not the kernel's.
    clock_correction_ns: int = 0
    begin_ns: int | None = None  # time of the first packet's begin, epoch nanoseconds, or None
    end_ns: int | None = None  # time of the last packet's end, epoch nanoseconds, or None
    has_process_context: bool = False  # every event carries both `vpid` and `vtid`
    # Contexts with what performance counters of the thread have counted, sorted.
    counters: tuple[str, ...] = ()
    # Event classes declared in the metadata, sorted; they need not occur.
    event_names: tuple[str, ...] = ()
    # The events have times. Where they have none, `ts_ns` only gives their order.
    has_time: bool = True

    @property
    def identity(self) -> str:
        """What chunks of one recording have in common."""
        return self.uuid or str(self.path)


@dataclass(frozen=True)
class EventBatch:
    """Consecutive events of one name, or packets."""

    name: str  # the full name of the event, or `PACKET` for packets
    batch: pa.RecordBatch  # `COMMON_SCHEMA` and the payload columns; `PACKET_SCHEMA` for packets
    # Number of the stretch of the total order that the batch belongs to, never falling: all events
    # of a round come before all events of later rounds.
    round: int


@dataclass(frozen=True)
class Progress:
    """How far reading has come."""

    events: int  # events read so far, wanted or not
    fraction: float  # part of the input that has been read, 0 to 1
    time_ns: int  # time of the latest event, epoch nanoseconds


@dataclass(frozen=True)
class Damage:
    """Something in a stream file that is not as it should be."""

    trace_index: int
    file: Path
    position: int  # which packet of the file, from 0
    offset: int  # where in the file, in bytes
    message: str  # what is wrong, without full stop
