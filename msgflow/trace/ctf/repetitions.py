"""Packets that one trace holds twice, such as those of a stream file copied beside itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from msgflow.trace.ctf.packets import Packet
    from msgflow.trace.ctf.streams import Stream

_CHUNK = 1 << 20


class Repetitions:
    """Remembers packets by what they say of themselves."""

    def __init__(self) -> None:
        self._seen: dict[tuple[object, ...], Packet] = {}

    def has(self, stream: Stream, packet: Packet) -> bool:
        """Tell whether the packet was seen before, and remember it.

        It was if one of the same stream has its number and begin. Where packets have no numbers,
        or do not name their streams, it must be the same byte for byte.
        """
        header = packet.header
        key: tuple[object, ...] = (stream.trace_index, stream.class_id, header.begin)
        is_numbered = header.instance is not None and header.sequence is not None
        if is_numbered:
            # Rotation leaves an empty packet in front of the first one with events.
            is_empty = packet.content_bits <= header.events_at
            key = (*key, header.instance, header.sequence, is_empty)
        else:
            key = (*key, header.end, header.cpu, header.events_at, packet.content_bits)
        first = self._seen.setdefault(key, packet)
        if first is packet:
            return False
        return is_numbered or _are_equal(first, packet)


def _are_equal(one: Packet, other: Packet) -> bool:
    left = (one.content_bits + 7) // 8
    try:
        with one.path.open("rb") as first, other.path.open("rb") as second:
            first.seek(one.offset)
            second.seek(other.offset)
            while left > 0:
                size = min(left, _CHUNK)
                if first.read(size) != second.read(size):
                    return False
                left -= size
    except OSError:  # said when the packet is read
        return False
    return True
