"""What the metadata of one trace declares."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from msgflow.trace.ctf.metadata_error import MetadataError
from msgflow.trace.ctf.types import Structure

if TYPE_CHECKING:
    from msgflow.trace.ctf.clock import Clock

_SMALLEST_ID, _LARGEST_ID = -(1 << 63), (1 << 64) - 1


@dataclass(eq=False)
class EventClass:
    """One kind of event."""

    id: int
    name: str
    specific_context: Structure = field(default_factory=Structure)
    payload: Structure = field(default_factory=Structure)


@dataclass(eq=False)
class StreamClass:
    """One kind of stream (LTTng: channel) and its events.

    Attributes:
        has_time: its events have times; else `clock` only counts packets.
    """

    id: int
    packet_context: Structure = field(default_factory=Structure)
    event_header: Structure = field(default_factory=Structure)
    event_context: Structure = field(default_factory=Structure)
    clock: Clock | None = None
    events: dict[int, EventClass] = field(default_factory=dict)
    has_time: bool = True


@dataclass(eq=False)
class TraceClass:
    """All of a trace's metadata.

    Attributes:
        notes: what was left out because it makes no sense.
    """

    uuid: str | None = None
    environment: dict[str, int | str] = field(default_factory=dict)
    packet_header: Structure = field(default_factory=Structure)
    streams: dict[int, StreamClass] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def add_event(self, stream: StreamClass, event: EventClass) -> None:
        """Add an event class to a stream class.

        Raises:
            MetadataError: there is one of its id.
        """
        if not _SMALLEST_ID <= event.id <= _LARGEST_ID:
            self.notes.append(f"no event can have the id {event.id} of {event.name!r}: left out")
            return
        if event.id in stream.events:
            raise MetadataError(f"there are two events {event.id} in stream {stream.id}")
        stream.events[event.id] = event
