"""The packets of a batch in memory, and numbers gathered from any byte of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

GAP = 64
"""Bytes of ones that follow a packet in memory; packets begin at multiples of it."""

PADDING = 2 * GAP
"""Bytes behind all packets."""


class Memory:
    """Bytes, the same for Python and for numpy.

    Attributes:
        data: for Python.
        bytes: for numpy.
    """

    def __init__(self, data: bytearray) -> None:
        self.data = data
        self.bytes: NDArray[np.uint8] = np.frombuffer(self.data, np.uint8)
        self._views: dict[str, NDArray[Any]] = {}

    def view(self, dtype: str) -> NDArray[Any]:
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
