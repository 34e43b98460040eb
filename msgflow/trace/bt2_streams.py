"""The data streams of the traces in a graph, and the accounting of their packets."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from msgflow.trace.bt2_library import Bt2Library

PacketRow = tuple[Any, ...]

_ROUNDING_NS = 1024


class Clock:
    """Converts clock values to nanoseconds since the epoch, in integers.

    Attributes:
        offset_ns: what to add to a value, for clocks of 1 GHz; None for others.
        name: its name, or None.
        uuid: its uuid, or None.
    """

    def __init__(self, frequency: int, offset_seconds: int, offset_cycles: int) -> None:
        self._frequency = frequency
        self._offset_seconds = offset_seconds
        self._offset_cycles = offset_cycles
        self.offset_ns: int | None = None
        if frequency == 1_000_000_000:
            self.offset_ns = offset_seconds * 1_000_000_000 + offset_cycles

    def to_ns(self, value: int) -> int:
        """Return the time of a clock value in epoch nanoseconds."""
        if self.offset_ns is not None:
            return value + self.offset_ns
        cycles = value + self._offset_cycles
        return cycles * 1_000_000_000 // self._frequency + self._offset_seconds * 1_000_000_000


@dataclass(slots=True, eq=False)
class Stream:
    """One data stream and its current packet.

    Attributes:
        trace_index: the trace it belongs to.
        class_id: id of its stream class (the channel).
        instance_id: id within the class (the buffer, as a rule one per CPU).
        clock: of its time stamps.
        packets_have_begin: its packets carry the time of their begin.
        packets_have_end: its packets carry the time of their end.
        stream_index: its place among the streams of the trace, by class and instance.
        rank: its place among the streams of all traces.
    """

    trace_index: int
    class_id: int
    instance_id: int
    clock: Clock
    packets_have_begin: bool
    packets_have_end: bool
    stream_index: int = -1
    rank: int = -1
    cpu_id: int | None = None
    position: int = -1
    begin_ns: int | None = None
    last_event_ns: int | None = None
    event_count: int = 0
    discarded_event_count: int | None = 0
    lost_packet_count: int | None = 0

    def begin_packet(self, cpu_id: int | None, begin_ns: int | None) -> None:
        """Start the next packet; losses reported since the previous one are its own."""
        self.cpu_id = cpu_id
        self.position += 1
        self.begin_ns = begin_ns
        self.last_event_ns = None
        self.event_count = 0

    def end_packet(self, end_ns: int | None) -> PacketRow:
        """Return the packet as a row of `PACKET_SCHEMA`."""
        discarded = self.discarded_event_count
        if self.lost_packet_count != 0 and discarded != 0:
            # What was discarded in lost packets, and what behind them, nothing tells.
            discarded = None
        row = (
            self.trace_index,
            self.stream_index,
            self.class_id,
            self.instance_id,
            self.cpu_id,
            self.position,
            self.begin_ns,
            end_ns,
            self.last_event_ns,
            self.event_count,
            discarded,
            self.lost_packet_count,
            False,
        )
        self.discarded_event_count = 0
        self.lost_packet_count = 0
        return row


@dataclass
class StreamTable:
    """All streams of a graph, by the address of their Babeltrace object."""

    library: Bt2Library
    by_address: dict[int, Stream] = field(default_factory=dict)
    _classes: dict[int, Any] = field(default_factory=dict)

    @property
    def slack_ns(self) -> int:
        """How far apart events of different streams may arrive in the wrong order.

        Babeltrace orders by times that are rounded where a clock does not count nanoseconds.
        """
        exact = all(stream.clock.offset_ns is not None for stream in self.by_address.values())
        return 0 if exact else _ROUNDING_NS

    def add(self, pointer: Any) -> None:
        """Add the stream at this pointer; the trace is known by its name, its index."""
        native = self.library.native
        stream_class = native.stream_borrow_class_const(pointer)
        trace = native.stream_borrow_trace_const(pointer)
        self.by_address[int(pointer)] = Stream(
            # The source puts the host name and a slash before the name that it is given.
            trace_index=int(native.trace_get_name(trace).rpartition("/")[2]),
            class_id=native.stream_class_get_id(stream_class),
            instance_id=native.stream_get_id(pointer),
            clock=self._clock(stream_class),
            packets_have_begin=bool(
                native.stream_class_packets_have_beginning_default_clock_snapshot(stream_class)
            ),
            packets_have_end=bool(
                native.stream_class_packets_have_end_default_clock_snapshot(stream_class)
            ),
        )
        self._classes[int(stream_class)] = stream_class

    def number(self) -> None:
        """Give every stream its place; to be called when all have been added."""
        ordered = sorted(
            self.by_address.values(), key=lambda s: (s.trace_index, s.class_id, s.instance_id)
        )
        seen_in_trace: dict[int, int] = {}
        for rank, stream in enumerate(ordered):
            stream.rank = rank
            stream.stream_index = seen_in_trace.get(stream.trace_index, 0)
            seen_in_trace[stream.trace_index] = stream.stream_index + 1

    def event_classes(self) -> Iterator[Any]:
        """Yield a pointer to each event class of the streams' classes."""
        native = self.library.native
        for stream_class in self._classes.values():
            for index in range(native.stream_class_get_event_class_count(stream_class)):
                yield native.stream_class_borrow_event_class_by_index_const(stream_class, index)

    def cpu_of(self, packet: Any) -> int | None:
        """Return the CPU from the packet's context, None where it has none."""
        native = self.library.native
        context = native.packet_borrow_context_field_const(packet)
        if context is None:
            return None
        member = native.field_structure_borrow_member_field_by_name_const(context, "cpu_id")
        return None if member is None else int(native.field_integer_unsigned_get_value(member))

    def _clock(self, stream_class: Any) -> Clock:
        native = self.library.native
        clock = native.stream_class_borrow_default_clock_class_const(stream_class)
        offset_seconds, offset_cycles = native.clock_class_get_offset(clock)
        return Clock(native.clock_class_get_frequency(clock), offset_seconds, offset_cycles)
