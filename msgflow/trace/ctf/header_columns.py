"""Columns of event headers: classes, times and bodies of many events, from their positions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from msgflow.trace.ctf.event_header import Form, Place
    from msgflow.trace.ctf.packet_memory import Memory
    from msgflow.trace.ctf.stream_layout import StreamLayout


def read_headers(
    layout: StreamLayout,
    memory: Memory,
    positions: NDArray[np.int64],
    counts: NDArray[np.int64],
    befores: NDArray[np.uint64],
) -> tuple[NDArray[np.uint32], NDArray[np.uint64], NDArray[np.int64]]:
    """Return class, clock and body of the events at these positions, as `Events` has them.

    `positions` are the bytes of memory at which events begin, packet after packet. `counts` are the
    events of each packet, `befores` the values of the clock before the first event of each.
    """
    reader = _Reader(layout, memory, positions)
    owner_befores = befores[counts > 0]
    firsts = (np.cumsum(counts) - counts)[counts > 0]
    header = layout.known_header
    selector = reader.gather(header.selector, slice(None))
    forms = reader.rows_of_forms(selector)
    classes = np.empty(positions.size, np.uint32)
    values = np.empty(positions.size, np.uint64)
    bodies = np.empty(positions.size, np.int64)
    whole = []
    for form, rows in zip(header.forms, forms, strict=True):
        if not isinstance(rows, slice) and rows.size == 0:
            continue
        classes[rows] = reader.classes(form, selector, rows)
        bodies[rows] = positions[rows] + reader.by_residue(form.sizes, rows)
        if form.time is not None:
            values[rows] = reader.gather(form.time, rows)
            if form.time.bits == 64:
                whole.append(np.arange(positions.size) if isinstance(rows, slice) else rows)
        else:
            values[rows] = np.repeat(befores, counts)[rows]
    if header.narrow_bits is None:
        return classes, values, bodies
    whole_rows = np.sort(np.concatenate([*whole, np.empty(0, np.int64)]))
    clock = _unwrapped(values, header.narrow_bits, firsts, owner_befores, whole_rows)
    return classes, clock, bodies


class _Reader:
    def __init__(self, layout: StreamLayout, memory: Memory, positions: NDArray[np.int64]) -> None:
        self._layout = layout
        self._memory = memory
        self._positions = positions

    def by_residue(self, values: tuple[int, ...], rows: Any) -> Any:
        """Return for each row the value that belongs to the residue of its position."""
        if len(set(values)) == 1:
            return values[0]
        residue = self._positions[rows] & (self._layout.residues - 1)
        return np.array(values, np.int64)[residue]

    def gather(self, place: Place, rows: Any) -> NDArray[Any]:
        at = self._positions[rows] + self.by_residue(place.offsets, rows)
        values: NDArray[Any] = self._memory.view(place.dtype)[at]
        values = values.astype(f"u{place.width}", copy=False)
        if place.shift:
            values = values >> place.shift
        if place.bits < place.width * 8:
            values = values & place.mask
        return values

    def rows_of_forms(self, selector: NDArray[Any]) -> list[Any]:
        header = self._layout.known_header
        if len(header.forms) == 1:
            return [slice(None)]
        remaining = np.arange(selector.size)
        rows = []
        for form in header.forms:
            matches = np.zeros(remaining.size, np.bool_)
            for first, last in form.choice.ranges if form.choice else ():
                if last < 0 or first > header.selector.mask:
                    continue
                low, high = max(first, 0), min(last, header.selector.mask)
                matches |= (selector[remaining] >= low) & (selector[remaining] <= high)
            if remaining.size == selector.size and matches.all():
                # The usual case: all events of a batch have the short form.
                return [
                    slice(None) if other is form else np.empty(0, np.int64)
                    for other in header.forms
                ]
            rows.append(remaining[matches])
            remaining = remaining[~matches]
        return rows

    def classes(self, form: Form, selector: NDArray[Any], rows: Any) -> Any:
        layout = self._layout
        if form.id is None:
            return layout.classes[layout.only_id].number
        is_selector = form.id == layout.known_header.selector
        ids = selector[rows] if is_selector else self.gather(form.id, rows)
        possible = range(form.id.mask + 1)
        known = np.array(sorted(i for i in layout.classes if i in possible), np.uint64)
        numbers = np.array([layout.classes[int(i)].number for i in known], np.uint32)
        if known.size and int(known[-1]) < 1 << 16:
            table = np.zeros(int(known[-1]) + 1, np.uint32)
            table[known] = numbers
            return table[ids]
        return numbers[np.searchsorted(known, ids)]


def _unwrapped(
    values: NDArray[np.uint64],
    bits: int,
    firsts: NDArray[np.int64],
    befores: NDArray[np.uint64],
    whole: NDArray[np.int64],
) -> NDArray[np.uint64]:
    """Turn the low bits of a clock into its values.

    A time stamp is the first value at or after the previous one with these low bits, and the
    previous one of a packet's first event is that before it, or the packet's begin. So the
    distances are known from the low bits alone, and their sum from a whole value on is the clock.

    `values` are low bits of `bits` bits, but whole values at the rows `whole`. Packets begin at the
    rows `firsts`; `befores` are the values of the clock before these.
    """
    if not values.size:
        return values
    distance = np.empty_like(values)
    np.subtract(values[1:], values[:-1], out=distance[1:])
    distance[firsts] = values[firsts] - befores
    distance &= np.uint64((1 << bits) - 1)
    known = np.zeros(values.size, np.bool_)
    known[firsts] = True
    known[whole] = True
    clock = np.cumsum(distance, dtype=np.uint64)
    starts = np.flatnonzero(known)
    start_values = np.empty(values.size, np.uint64)
    start_values[firsts] = befores + distance[firsts]
    start_values[whole] = values[whole]
    shifts = start_values[starts] - clock[starts]
    clock += np.repeat(shifts, np.diff(starts, append=values.size))
    return clock
