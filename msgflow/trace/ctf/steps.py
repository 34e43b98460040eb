"""How far it is from one event to the next, for many events at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from msgflow.trace.ctf.layout import StreamLayout
    from msgflow.trace.ctf.memory import Memory


class Steps:
    """Looks up sizes of events by their headers; `layout.step_table` must be known."""

    def __init__(self, layout: StreamLayout, memory: Memory) -> None:
        assert layout.header is not None
        assert layout.step_table is not None
        assert layout.selector_limit is not None
        self._place = layout.header.selector
        self._offsets = np.array(self._place.offsets, np.int64)
        self._selectors = memory.view(self._place.dtype)
        self._residues = layout.residues
        self._limit = layout.selector_limit
        self._table = layout.step_table

    def sizes(self, positions: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the sizes of the events at these bytes of memory.

        They are 0 where events of that class are not all equally large, or where there is none.
        """
        place = self._place
        residue = positions & (self._residues - 1) if self._residues > 1 else None
        at = positions
        if residue is not None:
            at = positions + self._offsets[residue]
        elif place.offsets[0]:
            at = positions + place.offsets[0]
        selector = self._selectors[at]
        if place.shift:
            selector = selector >> place.shift
        if place.bits < place.width * 8:
            selector = selector & place.mask
        if self._limit < place.mask:
            selector = np.minimum(selector, self._limit).astype(np.int64)
        if residue is not None:
            selector = selector.astype(np.int64) * self._residues + residue
        sizes: NDArray[np.int64] = self._table[selector]
        return sizes
