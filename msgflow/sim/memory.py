"""Plausible addresses, so that handles look and collide as real ones do."""

from __future__ import annotations

from random import Random

_ALIGNMENT = 16


class AddressSpace:
    """Heap and stacks of one process.

    The same seed gives the same addresses: processes with equal ids on two hosts have equal ones.
    """

    def __init__(self, seed: str) -> None:
        self._random = Random(seed)
        self._freed: list[int] = []
        self._heap = 0x5500_0000_0000 + (self._random.getrandbits(36) << 4 & ~0xFFF)
        self._main_stack = 0x7FFC_0000_0000 + (self._random.getrandbits(31) & ~0xF)
        self._thread_stack = 0x7F00_0000_0000 + (self._random.getrandbits(38) & ~0xFFF)

    def allocate(self) -> int:
        """Address of a new object on the heap; the one that was freed last is used again."""
        if self._freed:
            return self._freed.pop()
        self._heap += _ALIGNMENT * self._random.randrange(2, 200)
        return self._heap

    def free(self, address: int) -> None:
        """An object on the heap exists no more."""
        self._freed.append(address)

    def on_stack(self) -> int:
        """Address of a local variable of the main thread."""
        return self._main_stack - _ALIGNMENT * self._random.randrange(1, 500)

    def on_thread_stack(self) -> int:
        """Address of a local variable of the middleware's thread."""
        return self._thread_stack - _ALIGNMENT * self._random.randrange(1, 500)

    def garbage(self, size: int) -> bytes:
        """Bytes that nobody initialised."""
        return self._random.randbytes(size)
