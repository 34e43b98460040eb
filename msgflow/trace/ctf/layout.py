"""Layout of types: places of their fields, where they do not depend on values.

Kernel traces have the headers of network packets in a variant at the end of an event, whose options
are structures of fixed size; an option may itself end in such a variant. With its layout the
variants of many events are read at once.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeGuard

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.field_types import BYTE, FieldError, aligned

_MOST_STEPS = 100_000
_WIDTHS = {8, 16, 32, 64}


class DynamicError(Exception):
    """The layout of a type is not fixed."""


@dataclass(frozen=True)
class Leaf:
    """A number, or an array of numbers that follow each other without gaps."""

    path: tuple[str, ...]  # names of the members from the outermost to this one
    type: ctf.Integer | ctf.Real | ctf.Array
    position: int  # in bits


def lay_out(
    declared: ctf.Type, position: int, leaves: list[Leaf] | None = None, path: tuple[str, ...] = ()
) -> int:
    """Return the bit at which a field ends that begins at `position` or, aligned, behind it.

    Positions are bits from the begin of the packet. The numbers in the field are added to `leaves`,
    if given. `path` names the structures around it.

    A DynamicError says that the layout depends on values, or has too many parts to go through.
    """
    # Arrays inside arrays may have more elements than a loop can count.
    steps = itertools.count(1)

    def end(declared: ctf.Type, position: int, path: tuple[str, ...]) -> int:
        if next(steps) > _MOST_STEPS:
            raise DynamicError
        position = aligned(position, declared.align)
        match declared:
            case ctf.Integer() | ctf.Real():
                if leaves is not None:
                    leaves.append(Leaf(path, declared, position))
                return position + declared.size
            case ctf.Array() if is_dense(declared.element):
                if leaves is not None:
                    leaves.append(Leaf(path, declared, position))
                return position + declared.length * declared.element.size
            case ctf.Array():
                if declared.length > _MOST_STEPS:
                    raise DynamicError
                for number in range(declared.length):
                    position = end(declared.element, position, (*path, str(number)))
                return position
            case ctf.Structure():
                for member in declared.members:
                    position = end(member.type, position, (*path, member.name))
                return position
            case _:
                raise DynamicError

    return end(declared, position, path)


def is_dense(element: ctf.Type) -> TypeGuard[ctf.Integer | ctf.Real]:
    """Tell whether elements of this type follow each other without gaps."""
    return isinstance(element, ctf.Integer | ctf.Real) and element.size % element.align == 0


@dataclass(frozen=True)
class Part:
    """A number, or an array of numbers, on whole bytes."""

    offset: int  # in bytes from the begin of its option
    dtype: str  # of the number or element, as numpy calls it
    width: int  # bytes of the number or element
    count: int | None  # of the elements of an array, None for a number


@dataclass(frozen=True)
class OptionLayout:
    """A structure of fixed size, and the variant that it may end in."""

    choice: ctf.Choice  # as declared
    align: int  # in bytes
    size: int  # of the fixed part, in bytes
    parts: Mapping[str, Part]  # name, with dots inside nested structures, to where it is
    variant: VariantLayout | None


@dataclass(frozen=True)
class VariantLayout:
    """A variant whose options are structures of fixed size."""

    name: str
    selector: str  # name of the member in front of it that chooses the option
    options: tuple[OptionLayout, ...]
    _chosen: dict[int, OptionLayout] = field(default_factory=dict, compare=False, repr=False)

    def option(self, value: int) -> OptionLayout:
        """Return the option that this value of the selector chooses."""
        if value not in self._chosen:
            found = (option for option in self.options if option.choice.holds(value))
            option = next(found, None)
            if option is None:
                raise FieldError(f"a variant has no option for the value {value}")
            self._chosen[value] = option
        return self._chosen[value]

    def has(self, path: Sequence[str]) -> bool:
        """Tell whether there is a field at this path: variant, option, and names of members."""
        for option in self.options:
            if tuple(path[:2]) == (self.name, option.choice.name):
                inner = path[2:]
                return ".".join(inner) in option.parts or (
                    option.variant is not None and option.variant.has(inner)
                )
        return False

    def end(self, data: bytearray, position: int, value: int, limit: int) -> int:
        """Return the byte at which the variant that is due at `position` ends."""
        option = self.option(value)
        while True:
            begin = (position + option.align - 1) & -option.align
            position = begin + option.size
            if position > limit:
                raise FieldError("a field goes beyond the end of the packet")
            if option.variant is None:
                return position
            part = option.parts[option.variant.selector]
            at = begin + part.offset
            order: Literal["big", "little"] = "big" if part.dtype[0] == ">" else "little"
            option = option.variant.option(int.from_bytes(data[at : at + part.width], order))


def without_variant(
    structure: ctf.Structure, scopes: Collection[ctf.Scope | None]
) -> tuple[ctf.Structure, VariantLayout | None]:
    """Return a structure without the variant that it ends in, and the layout of that one.

    Its selector, an unsigned integer of whole bytes, is a member in front of it, to which it refers
    by one of the scopes. A DynamicError says that it has no such layout.
    """
    last = structure.members[-1] if structure.members else None
    if last is None or not isinstance(last.type, ctf.Variant):
        return structure, None
    fixed, reference = structure.members[:-1], last.type.selector
    selector = next((each.type for each in fixed[::-1] if (each.name,) == reference.path), None)
    if (
        reference.scope not in scopes
        or not isinstance(selector, ctf.Integer)
        or selector.signed
        or not _is_whole(selector)
    ):
        raise DynamicError
    options = tuple(map(_lay_out_option, last.type.choices))
    layout = VariantLayout(last.name, str(reference.path[0]), options)
    return ctf.Structure(fixed, structure.align), layout


def _lay_out_option(choice: ctf.Choice) -> OptionLayout:
    if not isinstance(choice.type, ctf.Structure):
        raise DynamicError
    fixed, variant = without_variant(choice.type, {None})
    leaves: list[Leaf] = []
    end = lay_out(fixed, 0, leaves)
    parts = {".".join(leaf.path): part for leaf in leaves if (part := _part(leaf)) is not None}
    if variant is not None and (end % BYTE or variant.selector not in parts):
        raise DynamicError
    return OptionLayout(choice, max(fixed.align // BYTE, 1), -(-end // BYTE), parts, variant)


def _part(leaf: Leaf) -> Part | None:
    """Return the place of a number or array; None if it does not lie on whole bytes."""
    if leaf.position % BYTE:
        return None
    element: ctf.Type = leaf.type
    count: int | None = None
    if isinstance(leaf.type, ctf.Array):
        if leaf.type.is_text or not is_dense(leaf.type.element):
            return None
        element, count = leaf.type.element, leaf.type.length
    if not isinstance(element, ctf.Integer | ctf.Real) or not _is_whole(element):
        return None
    return Part(leaf.position // BYTE, dtype_of(element), element.size // BYTE, count)


def _is_whole(number: ctf.Integer | ctf.Real) -> bool:
    return number.size in _WIDTHS


def dtype_of(number: ctf.Integer | ctf.Real) -> str:
    """Return numpy's name for a number of whole bytes."""
    kind = "f" if isinstance(number, ctf.Real) else "i" if number.signed else "u"
    return f"{'>' if number.big_endian else '<'}{kind}{number.size // BYTE}"
