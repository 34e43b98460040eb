"""Headers of events: their layout, and columns of many of them at once, from their positions.

A header is an id and a time stamp; with LTTng there are two forms of it, and the first number
tells which one and, in the short form, the id as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.field_types import BYTE, Role, Scope
from msgflow.trace.ctf.layout import DynamicError, Leaf, lay_out

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from msgflow.trace.ctf.packet_memory import Memory
    from msgflow.trace.ctf.stream_layout import StreamLayout


@dataclass(frozen=True)
class Place:
    """Where an integer lies."""

    # Bytes from the begin of the header, by residue of the header's own position.
    offsets: tuple[int, ...]
    width: int  # bytes to read there: 1, 2, 4 or 8
    big_endian: bool  # their order
    shift: int  # bits below the integer in what was read
    bits: int  # of the integer

    @property
    def mask(self) -> int:
        """The bits of the integer."""
        return (1 << self.bits) - 1

    @property
    def dtype(self) -> str:
        """The type of what is read, as numpy calls it."""
        return f"{'>' if self.big_endian else '<'}u{self.width}"

    def read(self, data: bytearray, begin: int, residue: int) -> int:
        """Return the integer of the header that begins at this byte."""
        first = begin + self.offsets[residue]
        order = "big" if self.big_endian else "little"
        word = int.from_bytes(data[first : first + self.width], order)  # type: ignore[arg-type]
        return word >> self.shift & self.mask


@dataclass(frozen=True)
class Form:
    """One form of the header."""

    choice: ctf.Choice | None  # for which selector values; None: always
    id: Place | None  # where the event's class is; None if there is only one
    time: Place | None  # where the time stamp is; None without one
    sizes: tuple[int, ...]  # of the header in bytes, by residue

    def holds(self, selector: int) -> bool:
        """Tell whether a header with this selector has this form."""
        return self.choice is None or self.choice.holds(selector)


@dataclass(frozen=True)
class EventHeader:
    """How to read a stream's event headers."""

    align: int  # of the header, in bytes
    selector: Place  # the number that tells the form, and the id unless the form has its own
    forms: tuple[Form, ...]
    # Size of the time stamps that are not whole clock values, None if all are.
    narrow_bits: int | None

    @property
    def largest_size(self) -> int:
        """Bytes of the longest form."""
        return max(size for form in self.forms for size in form.sizes)


def compile_header(structure: ctf.Structure, residues: int) -> EventHeader | None:
    """Compile the layout of headers; None if they must be read field by field.

    `residues` is as for `compile_body`.
    """
    if structure.align % BYTE or not structure.members:
        return None
    last = structure.members[-1].type
    choices: Sequence[ctf.Choice | None] = [None]
    if isinstance(last, ctf.Variant):
        choices = last.choices
    try:
        forms = [_form(structure, choice, residues) for choice in choices]
        selector = forms[0].id
        if isinstance(last, ctf.Variant):
            path = last.selector.path
            if last.selector.scope not in {None, Scope.EVENT_HEADER} or len(path) != 1:
                return None
            laid_out = [_leaves(structure, choices[0], r)[0] for r in range(residues)]
            named = (next((leaf for leaf in each if leaf.path == path), None) for each in laid_out)
            selector = _place(list(named))
    except DynamicError:
        return None
    widths = {form.time.bits for form in forms if form.time is not None} - {64}
    if selector is None or len(widths) > 1:
        return None
    return EventHeader(
        structure.align // BYTE, selector, tuple(forms), widths.pop() if widths else None
    )


def _leaves(
    structure: ctf.Structure, choice: ctf.Choice | None, residue: int
) -> tuple[list[Leaf], int]:
    leaves: list[Leaf] = []
    position = residue * BYTE
    for member in structure.members:
        declared: ctf.Type = member.type
        if isinstance(declared, ctf.Variant) and choice is not None:
            declared = choice.type
        position = lay_out(declared, position, leaves, (member.name,))
    return leaves, position


def _form(structure: ctf.Structure, choice: ctf.Choice | None, residues: int) -> Form:
    laid_out = [_leaves(structure, choice, residue) for residue in range(residues)]
    sizes = []
    for residue, (_, end) in enumerate(laid_out):
        if end % BYTE:
            raise DynamicError
        sizes.append(end // BYTE - residue)
    return Form(
        choice,
        _place([_last_of_role(found, Role.EVENT_CLASS) for found in laid_out]),
        _place([_last_of_role(found, Role.TIME) for found in laid_out]),
        tuple(sizes),
    )


def _last_of_role(laid_out: tuple[list[Leaf], int], role: str) -> Leaf | None:
    of_role = (
        leaf
        for leaf in reversed(laid_out[0])
        if isinstance(leaf.type, ctf.Integer) and role in leaf.type.roles
    )
    return next(of_role, None)


def _place(leaves: Sequence[Leaf | None]) -> Place | None:
    """Return where an integer lies, given its leaf for each residue."""
    offsets = []
    shifts = set()
    for residue, leaf in enumerate(leaves):
        if leaf is None:
            return None
        if not isinstance(leaf.type, ctf.Integer) or leaf.type.signed:
            raise DynamicError
        size, big_endian = leaf.type.size, leaf.type.big_endian
        first = leaf.position // BYTE
        end = leaf.position + size
        used = (end + BYTE - 1) // BYTE - first
        width = next((width for width in (1, 2, 4, 8) if width >= used), None)
        if width is None:
            raise DynamicError
        offsets.append(first - residue)
        shift = (first + width) * BYTE - end if big_endian else leaf.position - first * BYTE
        shifts.add((shift, width))
    if len(shifts) != 1:
        raise DynamicError
    shift, width = shifts.pop()
    return Place(tuple(offsets), width, big_endian, shift, size)


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
