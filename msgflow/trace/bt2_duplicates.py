"""Leaves out packets that a set of traces holds more than once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from msgflow.trace.bt2_library import Bt2Library
    from msgflow.trace.bt2_streams import Stream, StreamTable

Identity = tuple[str, int, int, int]
"""Trace uuid, stream class id, stream instance id, clock value of the packet's begin."""

_PASS, _HOLD, _SKIP = range(3)


class DuplicateFilter:
    """Passes on the messages of the copy with the lowest trace index, drops the others.

    Copies of a packet begin at the same time, so that their beginnings arrive before any later
    message. Until time moves on the messages of all copies are held; then they are decided.

    Attributes:
        skipped: packets left out so far.
    """

    def __init__(
        self, library: Bt2Library, streams: StreamTable, uuid_of_trace: dict[int, str]
    ) -> None:
        """Watch the traces in `uuid_of_trace` (trace index to uuid), pass on all others."""
        self._native = library.native
        self._streams = streams
        self._uuids = uuid_of_trace
        self._mode: dict[int, int] = {}
        self._before: dict[int, list[Any]] = {}
        self._copies: dict[Identity, dict[int, Stream]] = {}
        self._held: list[tuple[int, Any]] = []
        self._time_ns: int | None = None
        self._output: list[Any] = []
        self.skipped = 0

    def filter(self, steps: Iterable[list[Any]]) -> Iterator[list[Any]]:
        """Yield lists of the messages that stay, which the caller empties."""
        for step in steps:
            while step:
                self._accept(step.pop())
            # The consumer takes from the end.
            self._output.reverse()
            yield self._output
        self._decide()
        self._output.reverse()
        yield self._output

    def close(self) -> None:
        """Give back what is still held."""
        put = self._native.message_put_ref
        waiting = [message for messages in self._before.values() for message in messages]
        for message in (*self._output, *waiting, *(message for _, message in self._held)):
            put(message)
        self._output.clear()
        self._before.clear()
        self._held.clear()

    def _accept(self, message: Any) -> None:
        native = self._native
        kind = native.message_get_type(message)
        if kind == native.MESSAGE_TYPE_EVENT:
            event = native.message_event_borrow_event_const(message)
            address = int(native.event_borrow_stream_const(event))
            if self._held:
                snapshot = native.message_event_borrow_default_clock_snapshot_const(message)
                self._move_on(address, snapshot)
            self._route(address, message)
        elif kind == native.MESSAGE_TYPE_PACKET_BEGINNING:
            self._begin(message)
        elif kind == native.MESSAGE_TYPE_PACKET_END:
            packet = native.message_packet_end_borrow_packet_const(message)
            self._route(int(native.packet_borrow_stream_const(packet)), message)
        elif kind == native.MESSAGE_TYPE_DISCARDED_EVENTS:
            stream = native.message_discarded_events_borrow_stream_const(message)
            self._wait(int(stream), message)
        elif kind == native.MESSAGE_TYPE_DISCARDED_PACKETS:
            stream = native.message_discarded_packets_borrow_stream_const(message)
            self._wait(int(stream), message)
        else:
            self._output.append(message)

    def _begin(self, message: Any) -> None:
        native = self._native
        packet = native.message_packet_beginning_borrow_packet_const(message)
        address = int(native.packet_borrow_stream_const(packet))
        stream = self._streams.by_address[address]
        uuid = self._uuids.get(stream.trace_index)
        if uuid is None or not stream.packets_have_begin:
            self._mode[address] = _PASS
            self._output.extend(self._before.pop(address, ()))
            self._output.append(message)
            return
        snapshot = native.message_packet_beginning_borrow_default_clock_snapshot_const(message)
        self._move_on(address, snapshot)
        value = native.clock_snapshot_get_value(snapshot)
        identity = (uuid, stream.class_id, stream.instance_id, value)
        self._time_ns = stream.clock.to_ns(value)
        self._copies.setdefault(identity, {})[address] = stream
        self._mode[address] = _HOLD
        self._held.extend((address, waiting) for waiting in self._before.pop(address, ()))
        self._held.append((address, message))

    def _move_on(self, address: int, snapshot: Any) -> None:
        """Decide what is held if this snapshot is of a later time."""
        if self._held:
            clock = self._streams.by_address[address].clock
            if clock.to_ns(self._native.clock_snapshot_get_value(snapshot)) != self._time_ns:
                self._decide()

    def _decide(self) -> None:
        for copies in self._copies.values():
            kept = min(copies, key=lambda address: copies[address].trace_index)
            for address in copies:
                self._mode[address] = _PASS if address == kept else _SKIP
        self._copies.clear()
        held, self._held = self._held, []
        for address, message in held:
            self._route(address, message)

    def _route(self, address: int, message: Any) -> None:
        mode = self._mode.get(address, _PASS)
        if mode == _PASS:
            self._output.append(message)
        elif mode == _HOLD:
            self._held.append((address, message))
        else:
            native = self._native
            if native.message_get_type(message) == native.MESSAGE_TYPE_PACKET_BEGINNING:
                self.skipped += 1
            native.message_put_ref(message)

    def _wait(self, address: int, message: Any) -> None:
        """Keep what precedes a packet until it is known whether the packet stays."""
        self._before.setdefault(address, []).append(message)
