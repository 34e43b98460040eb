"""Traces as the rest of msgflow sees them: location, description, batches, progress, damage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    import pyarrow as pa


@dataclass(frozen=True)
class TraceLocation:
    """A directory that holds one CTF trace.

    Attributes:
        path: the directory, absolute, symbolic links resolved.
        size_bytes: total size of its stream files (without metadata and indexes).
        strays: streams beside or below it that belong to no trace, as their metadata is missing.
    """

    path: Path
    size_bytes: int
    strays: tuple[Path, ...] = ()


@dataclass(frozen=True)
class TraceInfo:
    """What a trace declares about itself; known before its events are read.

    A trace without any stream file keeps its place in the order but declares nothing.

    Attributes:
        index: place of the trace among those opened together, from 0, in order of path.
        path: the directory; in an archive, the archive's path followed by that inside.
        uuid: the CTF trace uuid, lower case with hyphens, or None.
        domain: 'ust', 'kernel', or None when the tracer does not say.
        hostname: name of the machine or container, or None.
        tracer: name and version, such as 'lttng-ust 2.13', or None.
        clock_uuid: uuid of the clock (LTTng: the boot id), or None.
        clock_name: name of the clock, such as 'monotonic', or None.
        clock_offset_ns: nanoseconds from the epoch to the origin of the clock, as declared.
        clock_frequency: how often the clock counts [Hz]; 0 without event data.
        clock_correction_ns: what is added to the offset, to be on one time base with the first
            trace of the same clock that is not the kernel's.
        begin_ns: time of the first packet's begin, epoch nanoseconds, or None.
        end_ns: time of the last packet's end, epoch nanoseconds, or None.
        has_process_context: every event carries both `vpid` and `vtid`.
        event_names: event classes declared in the metadata, sorted; they need not occur.
        has_time: the events have times. Where they have none, `ts_ns` only gives their order.
    """

    index: int
    path: Path
    uuid: str | None
    domain: str | None
    hostname: str | None
    tracer: str | None
    clock_uuid: str | None
    clock_name: str | None
    clock_offset_ns: int
    clock_frequency: int
    clock_correction_ns: int
    begin_ns: int | None
    end_ns: int | None
    has_process_context: bool
    event_names: tuple[str, ...]
    has_time: bool = True

    @property
    def identity(self) -> str:
        """What chunks of one recording have in common."""
        return self.uuid or str(self.path)


def undeclared(path: Path, index: int) -> TraceInfo:
    """Describe a trace without any event data; see `TraceInfo` for the arguments."""
    return TraceInfo(
        index=index,
        path=path,
        uuid=None,
        domain=None,
        hostname=None,
        tracer=None,
        clock_uuid=None,
        clock_name=None,
        clock_offset_ns=0,
        clock_frequency=0,
        clock_correction_ns=0,
        begin_ns=None,
        end_ns=None,
        has_process_context=False,
        event_names=(),
    )


@dataclass(frozen=True)
class EventBatch:
    """Consecutive events of one name, or packets.

    Attributes:
        name: the full name of the event, or `PACKET` for packets.
        batch: `COMMON_SCHEMA` and the payload columns; `PACKET_SCHEMA` for packets.
        round: number of the stretch of the total order that the batch belongs to, never falling:
            all events of a round come before all events of later rounds.
    """

    name: str
    batch: pa.RecordBatch
    round: int


@dataclass(frozen=True)
class Progress:
    """How far reading has come.

    Attributes:
        events: events read so far, wanted or not.
        fraction: part of the input that has been read, 0 to 1.
        time_ns: time of the latest event, epoch nanoseconds.
    """

    events: int
    fraction: float
    time_ns: int


@dataclass(frozen=True)
class Damage:
    """Something in a stream file that is not as it should be.

    Attributes:
        trace_index: which trace.
        file: the stream file.
        position: which packet of the file, from 0.
        offset: where in the file, in bytes.
        message: what is wrong, without full stop.
    """

    trace_index: int
    file: Path
    position: int
    offset: int
    message: str
