"""Memory that holds the packets of a batch, and the loader that fills it from files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from msgflow.trace.ctf.packet_order import Entry
from msgflow.trace.ctf.stream_layout import GAP
from msgflow.trace.numpy_arrow import Values

PADDING = 2 * GAP
"""Bytes behind all packets."""

_MOST_FILES = 64
_ONES = b"\xff" * GAP


class Memory:
    """Bytes that Python and numpy share."""

    def __init__(self, data: bytearray) -> None:
        self.data = data
        self._views: dict[str, Values] = {}

    def view(self, dtype: str) -> Values:
        """Return an array whose n-th element begins at the n-th byte."""
        found = self._views.get(dtype)
        if found is None:
            width = np.dtype(dtype).itemsize
            count = max(len(self.data) - width + 1, 0)
            found = np.ndarray((count,), dtype, self.data, strides=(1,))
            self._views[dtype] = found
        return found


def room_for(size: int) -> int:
    """Return the bytes that a packet of this size takes with the gap behind it."""
    return (size + GAP + GAP - 1) // GAP * GAP


class Loader:
    """Keeps the packets of the current batch in memory.

    Packets that the next batch needs, too, are copied to its memory.
    """

    def __init__(self) -> None:
        self.memory = Memory(bytearray(PADDING))  # where the packets of the current batch are
        self._files: dict[Path, int] = {}

    def load(self, entries: Sequence[Entry]) -> list[Entry]:
        """Put these packets into memory in this order, including those that are there already.

        It returns those that their files no longer hold.
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
                # No event begins with ones: what is damaged does not go on into the next packet.
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
        return Memory(bytearray(size))

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
