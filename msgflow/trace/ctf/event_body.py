"""Body of an event: the contexts and payload behind its header, as a list of plain fields.

Kernel traces have the headers of network packets in a variant at the end of an event, whose options
are structures of fixed size; an option may itself end in such a variant. Each option is a body of
its own, so that the variants of many events are read at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import Literal

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.declarations import EventClass, StreamClass
from msgflow.trace.ctf.field_types import BYTE, FieldError, Reference, Scope
from msgflow.trace.ctf.layout import DynamicError, Leaf, dtype_of, is_dense, lay_out

_WIDTHS = {8, 16, 32, 64}


class Kind(Enum):
    """The kinds of plain fields."""

    NUMBER = "a number"
    NUMBERS = "an array of numbers"
    TEXT = "an array of characters"
    STRING = "text up to a NUL"
    SEQUENCE = "numbers, as many as another field says"
    TEXT_SEQUENCE = "characters, as many as another field says"
    NOTHING = "no field, only the alignment of a structure, or bytes that are not read in columns"


@dataclass(frozen=True)
class PlainField:
    """A field that lies on whole bytes, whether or not its type is aligned to them."""

    scope: Scope | None  # the structure that it is in; None: an option of a variant
    path: tuple[str, ...]  # names of the members from that structure, or an option, to it
    kind: Kind  # what it is
    align: int  # in bytes
    dtype: str = "u1"  # of the number or element, as numpy calls it
    width: int = 1  # bytes of the number or element
    count: int = 1  # of the elements of an array, otherwise 1
    length_at: int = -1  # for a sequence, the place in the list of the field with its length
    is_length: bool = False  # it is the length of a sequence, or chooses the option of the variant
    type: ctf.Type | None = None  # as declared

    @property
    def size(self) -> int | None:
        """Bytes of it; None if that varies."""
        varies = self.kind in {Kind.STRING, Kind.SEQUENCE, Kind.TEXT_SEQUENCE}
        return None if varies else self.width * self.count


@dataclass(frozen=True)
class EventBody:
    """How to read the contexts and payload of one event class."""

    # Its fields in order; None if they must be read field by field.
    fields: tuple[PlainField, ...] | None
    # Of the body in bytes, by residue of its position; None if the size varies.
    sizes: tuple[int, ...] | None
    # Of each field in bytes, by residue; None if they vary.
    offsets: tuple[tuple[int, ...], ...] | None
    variant: VariantBody | None = None  # the variant behind the fields; None without one

    def has(self, path: tuple[str, ...]) -> bool:
        """Tell whether it is an option with this field, or one whose variant has it."""
        return path in self.places or (self.variant is not None and self.variant.has(path))

    @cached_property
    def places(self) -> dict[tuple[str, ...], int]:
        """Path of each field of an option to its place in the list."""
        return {each.path: place for place, each in enumerate(self.fields or ()) if each.path}

    @cached_property
    def orders(self) -> tuple[Literal["big", "little"], ...]:
        """Order of the bytes of each field."""
        return tuple("big" if field.dtype[0] == ">" else "little" for field in self.fields or ())

    @cached_property
    def steps(self) -> tuple[tuple[int, int, Kind, int], ...]:
        """Steps from the begin of a body to its end, as few as possible.

        Alignment, and what follows: NOTHING goes on by so many bytes, NUMBER is a length or
        selector of so many bytes, STRING is a text, and of SEQUENCE there are as many elements of
        so many bytes as the field of that number says.
        """
        steps: list[tuple[int, int, Kind, int]] = []
        for number, field in enumerate(self.fields or ()):
            if field.kind is Kind.STRING:
                steps.append((field.align, 0, Kind.STRING, number))
            elif field.size is None:
                steps.append((field.align, field.width, Kind.SEQUENCE, field.length_at))
            elif field.is_length:
                steps.append((field.align, field.size, Kind.NUMBER, number))
            elif steps and steps[-1][2] is Kind.NOTHING and field.align == 1:
                steps[-1] = (steps[-1][0], steps[-1][1] + field.size, Kind.NOTHING, number)
            else:
                steps.append((field.align, field.size, Kind.NOTHING, number))
        return tuple(steps)

    def end(self, data: bytearray, position: int, limit: int) -> int:
        """Return the byte at which the body that begins at `position` ends."""
        lengths: dict[int, int] = {}
        for align, size, kind, number in self.steps:
            if align > 1:
                position = (position + align - 1) & -align
            if kind is Kind.NOTHING:
                position += size
            elif kind is Kind.STRING:
                position = data.find(0, position, limit) + 1
                if position == 0:
                    raise FieldError("a text does not end within the packet")
            elif kind is Kind.NUMBER:
                content = data[position : position + size]
                lengths[number] = int.from_bytes(content, self.orders[number])
                position += size
            else:
                position += lengths[number] * size
            if position > limit:
                raise FieldError("a field goes beyond the end of the packet")
        if self.variant is not None:
            return self.variant.end(data, position, lengths[self.variant.selector], limit)
        return position


@dataclass(frozen=True)
class Option:
    """One of the options of a variant."""

    choice: ctf.Choice  # as declared
    align: int  # in bytes
    size: int  # of its fields, in bytes
    # Of what chooses the option of its own variant, if any: where it is, its bytes and their order.
    selector: tuple[int, int, Literal["big", "little"]]
    body: EventBody  # its fields, at fixed places, and the variant that it may end in


@dataclass(frozen=True)
class VariantBody:
    """A variant whose options are structures of fixed size."""

    name: str
    selector: int  # place in the list in front of it of the field that chooses its option
    options: tuple[Option, ...]

    @cached_property
    def _chosen(self) -> dict[int, Option]:
        return {}

    def option(self, value: int) -> Option:
        """Return the option that this value of the selector chooses."""
        if value not in self._chosen:
            found = next((each for each in self.options if each.choice.holds(value)), None)
            if found is None:
                raise FieldError(f"a variant has no option for the value {value}")
            self._chosen[value] = found
        return self._chosen[value]

    def end(self, data: bytearray, position: int, value: int, limit: int) -> int:
        """Return the byte at which the variant that is due at `position` ends."""
        option = self.option(value)
        while True:
            begin = (position + option.align - 1) & -option.align
            position = begin + option.size
            if position > limit:
                raise FieldError("a field goes beyond the end of the packet")
            if option.body.variant is None:
                return position
            offset, width, order = option.selector
            content = data[begin + offset : begin + offset + width]
            option = option.body.variant.option(int.from_bytes(content, order))

    def has(self, path: tuple[str, ...]) -> bool:
        """Tell whether there is a field at this path: variant, option, and names of members."""
        named = (each for each in self.options if path[:2] == (self.name, each.choice.name))
        return any(each.body.has(path[2:]) for each in named)


def compile_body(stream: StreamClass, event: EventClass, residues: int) -> EventBody:
    """Compile the layout of the body of an event class.

    There is a layout for each residue of its position: of the byte at which it begins, modulo
    `residues`.
    """
    structures = {
        Scope.EVENT_CONTEXT: stream.event_context,
        Scope.SPECIFIC_CONTEXT: event.specific_context,
        Scope.PAYLOAD: event.payload,
    }
    sizes = _sizes(list(structures.values()), residues)
    fields: list[PlainField] = []
    try:
        payload, last = _without_variant(event.payload)
        for scope, structure in (structures | {Scope.PAYLOAD: payload}).items():
            _add_fields(fields, scope, structure)
        variant = _variant(fields, Scope.PAYLOAD, last)
    except DynamicError:
        return EventBody(None, sizes, None)
    offsets = None
    if sizes is not None:
        offsets = tuple(zip(*(_offsets(fields, r) for r in range(residues)), strict=True))
    return EventBody(tuple(fields), sizes, offsets, variant)


def _without_variant(structure: ctf.Structure) -> tuple[ctf.Structure, ctf.Member | None]:
    """Return a structure without the variant that it ends in, and that one."""
    if not structure.members or not isinstance(structure.members[-1].type, ctf.Variant):
        return structure, None
    return ctf.Structure(structure.members[:-1], structure.align), structure.members[-1]


def _variant(
    fields: list[PlainField], scope: Scope | None, member: ctf.Member | None
) -> VariantBody | None:
    """Compile the variant behind these fields; a DynamicError says that this is not possible."""
    if member is None or not isinstance(member.type, ctf.Variant):
        return None
    selector = _length_field(fields, scope, member.type.selector)
    fields[selector] = replace(fields[selector], is_length=True)
    fields.append(_filler(0))  # it marks where the variant is due
    return VariantBody(member.name, selector, tuple(map(_option, member.type.choices)))


def _option(choice: ctf.Choice) -> Option:
    if not isinstance(choice.type, ctf.Structure):
        raise DynamicError
    fixed, last = _without_variant(choice.type)
    leaves: list[Leaf] = []
    end = lay_out(fixed, 0, leaves)
    fields: list[PlainField] = []
    at = 0
    for leaf in leaves:
        try:
            known = _plain(fields, None, leaf.path, leaf.type)
        except DynamicError:
            continue
        if leaf.position % BYTE or known.kind is Kind.TEXT:
            continue
        begin = leaf.position // BYTE
        fields += [_filler(begin - at), replace(known, align=1)]
        at = begin + known.width * known.count
    size = (end + BYTE - 1) // BYTE
    fields.append(_filler(size - at))
    variant = _variant(fields, None, last)
    if variant is not None and end % BYTE:
        raise DynamicError
    offsets = tuple((offset,) for offset in _offsets(fields, 0))
    body = EventBody(tuple(fields), None, offsets, variant)
    place = 0 if variant is None else variant.selector
    selector = offsets[place][0], fields[place].width, body.orders[place]
    return Option(choice, max(fixed.align // BYTE, 1), size, selector, body)


def _filler(size: int) -> PlainField:
    return PlainField(None, (), Kind.NOTHING, 1, width=size)


def _sizes(structures: list[ctf.Structure], residues: int) -> tuple[int, ...] | None:
    sizes = []
    for residue in range(residues):
        end = residue * BYTE
        try:
            for structure in structures:
                end = lay_out(structure, end)
        except DynamicError:
            return None
        # The next header lies on a whole byte.
        sizes.append((end + BYTE - 1) // BYTE - residue)
    return tuple(sizes)


def _offsets(fields: list[PlainField], residue: int) -> list[int]:
    offsets = []
    position = residue
    for field in fields:
        position = (position + field.align - 1) & -field.align
        offsets.append(position - residue)
        position += field.size or 0
    return offsets


def _add_fields(fields: list[PlainField], scope: Scope, structure: ctf.Structure) -> None:
    """Add the members of a structure; a DynamicError says that one is no plain field."""
    if structure.align > 1:
        if structure.align % BYTE:
            raise DynamicError
        fields.append(PlainField(scope, (), Kind.NOTHING, structure.align // BYTE, width=0))
    for member in structure.members:
        field = _plain(fields, scope, (member.name,), member.type)
        if field.length_at >= 0:
            fields[field.length_at] = replace(fields[field.length_at], is_length=True)
        fields.append(field)


def _plain(
    fields: list[PlainField], scope: Scope | None, path: tuple[str, ...], declared: ctf.Type
) -> PlainField:
    # Every plain field ends on a whole byte: a smaller alignment changes nothing behind it.
    align = max(declared.align // BYTE, 1)
    kind, count, length_at, element = Kind.NUMBER, 1, -1, declared
    match declared:
        case ctf.String():
            return PlainField(scope, path, Kind.STRING, align, type=declared)
        case ctf.Array():
            kind = Kind.TEXT if declared.is_text else Kind.NUMBERS
            count, element = declared.length, declared.element
        case ctf.Sequence():
            kind = Kind.TEXT_SEQUENCE if declared.is_text else Kind.SEQUENCE
            length_at, element = _length_field(fields, scope, declared.length), declared.element
    if not isinstance(element, ctf.Integer | ctf.Real) or element.size not in _WIDTHS:
        raise DynamicError
    if element is not declared and not is_dense(element):
        raise DynamicError
    dtype, width = dtype_of(element), element.size // BYTE
    return PlainField(scope, path, kind, align, dtype, width, count, length_at, type=declared)


def _length_field(fields: Sequence[PlainField], scope: Scope | None, reference: Reference) -> int:
    """Return the place of the field with a length, or a selector: a plain one before."""
    wanted = scope if reference.scope is None else reference.scope
    for number in range(len(fields) - 1, -1, -1):
        field = fields[number]
        if field.path == reference.path and field.scope is wanted:
            if isinstance(field.type, ctf.Integer) and not field.type.signed:
                return number
            break
    raise DynamicError
