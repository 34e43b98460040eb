"""Declarations of a trace's metadata: the trace class, its stream classes and event classes."""

from __future__ import annotations

from dataclasses import dataclass, field

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.clock import Clock
from msgflow.trace.ctf.field_types import MetadataError

_SMALLEST_ID, _LARGEST_ID = -(1 << 63), (1 << 64) - 1


@dataclass(eq=False)
class EventClass:
    """One kind of event."""

    id: int
    name: str
    specific_context: ctf.Structure = field(default_factory=ctf.Structure)
    payload: ctf.Structure = field(default_factory=ctf.Structure)


@dataclass(eq=False)
class StreamClass:
    """One kind of stream (LTTng: channel) and its events."""

    id: int
    packet_context: ctf.Structure = field(default_factory=ctf.Structure)
    event_header: ctf.Structure = field(default_factory=ctf.Structure)
    event_context: ctf.Structure = field(default_factory=ctf.Structure)
    clock: Clock | None = None
    events: dict[int, EventClass] = field(default_factory=dict)
    has_time: bool = True  # its events have times; if not, `clock` only counts packets

    def give_order(self) -> None:
        """Prepare for packets that are ordered by numbers in place of times."""
        self.clock, self.has_time = Clock(), False


@dataclass(eq=False)
class TraceClass:
    """All of a trace's metadata."""

    uuid: str | None = None
    environment: dict[str, int | str] = field(default_factory=dict)
    packet_header: ctf.Structure = field(default_factory=ctf.Structure)
    streams: dict[int, StreamClass] = field(default_factory=dict)
    # Messages about declarations left out because they make no sense.
    notes: list[str] = field(default_factory=list)

    def add_event(self, stream: StreamClass, event: EventClass) -> None:
        """Add an event class to a stream class."""
        if not _SMALLEST_ID <= event.id <= _LARGEST_ID:
            self.notes.append(f"no event can have the id {event.id} of {event.name!r}: left out")
            return
        if event.id in stream.events:
            raise MetadataError(f"there are two events {event.id} in stream {stream.id}")
        stream.events[event.id] = event
