"""Layout of event headers, for reading many headers at once.

A header is an id and a time stamp; with LTTng there are two forms of it, and the first number
tells which one and, in the short form, the id as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.declarations import StreamClass
from msgflow.trace.ctf.field_types import BYTE, Role, Scope
from msgflow.trace.ctf.layout import DynamicError, Leaf, lay_out


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


def compile_header(stream: StreamClass, residues: int) -> EventHeader | None:
    """Compile the layout of headers; None if they must be read field by field.

    `residues` is as for `compile_body`.
    """
    structure = stream.event_header
    if structure.align % BYTE or not structure.members:
        return None
    last = structure.members[-1].type
    choices: Sequence[ctf.Choice | None] = [None]
    if isinstance(last, ctf.Variant):
        choices = last.choices
    try:
        forms = [_form(stream, choice, residues) for choice in choices]
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


def _form(stream: StreamClass, choice: ctf.Choice | None, residues: int) -> Form:
    laid_out = [_leaves(stream.event_header, choice, residue) for residue in range(residues)]
    sizes = []
    for residue, (_, end) in enumerate(laid_out):
        if end % BYTE:
            raise DynamicError
        sizes.append(end // BYTE - residue)
    return Form(
        choice,
        _place([_last_of_role(found, Role.EVENT_CLASS) for found in laid_out]),
        _place([_last_of_role(found, Role.TIME) for found in laid_out])
        if stream.has_time
        else None,
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
