"""The slow path: events of one packet read field by field, whatever their layout."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from msgflow.trace.ctf.types import EVENT_CLASS_ROLE, TIME_ROLE, Scope, aligned
from msgflow.trace.ctf.walk import FieldError, Walker

if TYPE_CHECKING:
    from msgflow.trace.ctf.declarations import EventClass, StreamClass, TraceClass


@dataclass(frozen=True, slots=True)
class SlowHeader:
    """An event's header: its class, its time stamp and the size of that in bits."""

    event: EventClass
    time: int | None
    time_bits: int


class PacketWalk:
    """Reads events of one packet, at any bit."""

    def __init__(self, trace: TraceClass, stream: StreamClass, data: memoryview, end: int) -> None:
        """Read the packet's own header, which fields of events may refer to.

        Args:
            trace: the trace's declarations.
            stream: the packet's stream class.
            data: what begins with the packet.
            end: the bit at which its content ends.
        """
        self._stream = stream
        self._walker = Walker(data, end)
        self._end = end
        self._walker.read_scope(Scope.PACKET_HEADER, trace.packet_header)
        self._walker.read_scope(Scope.PACKET_CONTEXT, stream.packet_context)

    def begin(self, position: int) -> int:
        """Return where an event begins that is due at this bit; at the end if none is left."""
        begin = aligned(position, self._stream.event_header.align)
        return min(begin, self._end) if position < self._end else self._end

    def header(self, position: int) -> SlowHeader:
        """Read the header of the event that begins at this bit.

        Raises:
            FieldError: there is none, or no event class of its id.
        """
        walker = self._walker
        walker.position = position
        walker.found.pop(TIME_ROLE, None)
        walker.found[EVENT_CLASS_ROLE] = 0
        walker.read_scope(Scope.EVENT_HEADER, self._stream.event_header)
        event = self._stream.events.get(walker.found[EVENT_CLASS_ROLE])
        if event is None:
            raise FieldError(f"there is no event class {walker.found[EVENT_CLASS_ROLE]}")
        return SlowHeader(event, walker.found.get(TIME_ROLE), walker.time_bits)

    def event(self, position: int) -> dict[Scope, dict[str, Any]]:
        """Read the contexts and payload of the event that begins at this bit.

        Raises:
            FieldError: they do not fit into the packet.
        """
        event = self.header(position).event
        read = self._walker.read_scope
        return {
            Scope.EVENT_CONTEXT: read(Scope.EVENT_CONTEXT, self._stream.event_context),
            Scope.SPECIFIC_CONTEXT: read(Scope.SPECIFIC_CONTEXT, event.specific_context),
            Scope.PAYLOAD: read(Scope.PAYLOAD, event.payload),
        }

    def event_end(self, position: int) -> int:
        """Return the bit at which the event ends that begins at this bit."""
        self.event(position)
        return self._walker.position
