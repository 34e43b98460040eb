"""Brings packets into memory."""

from __future__ import annotations

import os
import weakref
from typing import TYPE_CHECKING

from msgflow.trace.ctf.memory import GAP, PADDING, Memory, room_for

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from msgflow.trace.ctf.entries import Entry

_MOST_FILES = 64
_ONES = b"\xff" * GAP


class Loader:
    """Keeps the packets of the current batch in memory.

    What a batch does not use up is copied to the next one. The room of memories that nobody uses
    any more is used again.

    Attributes:
        memory: where the packets of the current batch are.
    """

    def __init__(self) -> None:
        self.memory = Memory(bytearray(PADDING))
        self._rooms: list[tuple[bytearray, weakref.ref[Memory]]] = []
        self._files: dict[Path, int] = {}

    def load(self, entries: Sequence[Entry]) -> list[Entry]:
        """Put these packets into memory in this order, those that are there already included.

        Returns:
            packets that their files no longer hold.
        """
        missing = []
        size = sum(room_for(entry.size) for entry in entries)
        before = self.memory
        memory = self._new_memory(size)
        at = 0
        with memoryview(memory.data) as target, memoryview(before.data) as source:
            for entry in entries:
                end = at + entry.size
                if entry.base >= 0:
                    target[at:end] = source[entry.base : entry.base + entry.size]
                elif not self._read(entry, target[at:end]):
                    missing.append(entry)
                # Where no event can begin: it stops the scan.
                target[end : end + GAP] = _ONES
                entry.base = at
                at += room_for(entry.size)
        self.memory = memory
        return missing

    def alone(self, entry: Entry) -> Memory | None:
        """Return a memory that begins with this packet, None if its file no longer holds it."""
        memory = self._new_memory(room_for(entry.size))
        with memoryview(memory.data) as target:
            target[entry.size : entry.size + GAP] = _ONES
            return memory if self._read(entry, target[: entry.size]) else None

    def close(self) -> None:
        """Close all files."""
        for descriptor in self._files.values():
            os.close(descriptor)
        self._files.clear()

    def _new_memory(self, size: int) -> Memory:
        size += PADDING
        used = [(room, user) for room, user in self._rooms if user() is not None]
        free = [room for room, user in self._rooms if user() is None and len(room) >= size]
        room = free[0] if free else bytearray(size)
        memory = Memory(room)
        self._rooms = [*used, (room, weakref.ref(memory))]
        return memory

    def _read(self, entry: Entry, target: memoryview) -> bool:
        path = entry.packet.path
        try:
            if path not in self._files:
                if len(self._files) >= _MOST_FILES:
                    self.close()
                self._files[path] = os.open(path, os.O_RDONLY)
            begin = entry.packet.offset + entry.skipped
            return os.preadv(self._files[path], [target], begin) == len(target)
        except OSError:
            return False
