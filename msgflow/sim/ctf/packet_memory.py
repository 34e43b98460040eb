"""Packets that are kept in memory until a snapshot is recorded, as in overwrite mode."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from msgflow.sim.ctf.tracepoint import Tracepoint

Entry = tuple["Tracepoint", int, bytes]
"""Tracepoint, time and context of an event."""

PacketNumbers = tuple[int, int, int, int, int, int]
"""Begin, end, bits of content, bits in all, sequence number, discarded events."""


@dataclass(slots=True)
class _Kept:
    content: bytes
    numbers: PacketNumbers
    events: list[Entry]
    is_written: bool = False


class PacketMemory:
    """The newest packets of one stream."""

    def __init__(self, capacity: int, overwritten: Callable[[list[Entry]], None]) -> None:
        """Keep `capacity` packets; `overwritten` gets the events of those that no file has."""
        self._capacity = capacity
        self._overwritten = overwritten
        self._packets: deque[_Kept] = deque()

    def keep(self, content: bytes, numbers: PacketNumbers, events: list[Entry]) -> None:
        """Add a packet, in the place of the oldest one if there is no room."""
        if len(self._packets) == self._capacity:
            self._forget()
        self._packets.append(_Kept(content, numbers, events))

    def write(self, write: Callable[[bytes, PacketNumbers], None]) -> None:
        """Write all packets that are there, which stay there: they may be in several snapshots."""
        for packet in self._packets:
            write(packet.content, packet.numbers)
            packet.is_written = True

    def close(self) -> None:
        """Give up what no snapshot has."""
        while self._packets:
            self._forget()

    def _forget(self) -> None:
        packet = self._packets.popleft()
        if not packet.is_written:
            self._overwritten(packet.events)
