"""Times of packets whose headers do not have them: found by reading the events."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from msgflow.trace.ctf.events import events_of, say_nothing
from msgflow.trace.ctf.packet_memory import Loader
from msgflow.trace.ctf.packet_order import Entry
from msgflow.trace.ctf.packets import Packet, Stream


def begins_of(stream: Stream) -> dict[Packet, tuple[int, int]]:
    """Return the clock's value before each packet, and the time of its first event.

    The result is empty if all packets say when they begin. The clock goes on from packet to
    packet, so all of the stream must be read.
    """
    if all(packet.header.begin is not None for packet in stream.packets):
        return {}
    clock_class = stream.layout.clock
    begins = {}
    clock = 0
    order_ns = clock_class.to_ns(0)
    for packet in stream.packets:
        clock = packet.header.begin or clock
        values = _clock_values(stream, packet, clock)
        if values.size:
            # Time must not fall, or the packets would change places.
            order_ns = max(order_ns, clock_class.to_ns(int(values[0])))
        begins[packet] = (clock, order_ns)
        if values.size:
            clock = int(values[-1])
    return begins


def end_of(stream: Stream, packet: Packet) -> int | None:
    """Return the clock's value at the end of a packet, None if it has none.

    A packet that a crash cut off does not know its end: its last event tells it.
    """
    header = packet.header
    if header.end or header.end is None or not header.begin:
        return header.end
    values = _clock_values(stream, packet, header.begin)
    return int(values[-1]) if values.size else header.begin


def _clock_values(stream: Stream, packet: Packet, begin: int) -> NDArray[np.uint64]:
    """Return the clock's values of a packet's events; a later reading reports its damage."""
    loader = Loader()
    entry = Entry(stream, packet, 0, begin, 0, 0, 0)
    try:
        loader.load([entry])
        return events_of(stream.layout, loader.memory, [entry], say_nothing, say_nothing).clock
    finally:
        loader.close()
