"""Layout of types: places of their fields, where they do not depend on values.

Kernel traces have the headers of network packets in a variant at the end of an event, whose options
are structures of fixed size; an option may itself end in such a variant. With its layout the
variants of many events are read at once.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeGuard

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.field_types import BYTE, FieldError, aligned

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


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
    declared: ctf.Type,
    position: int,
    leaves: list[Leaf] | None = None,
    path: tuple[str, ...] = (),
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

    align: int  # in bytes
    size: int  # of the fixed part, in bytes
    parts: Mapping[str, Part]  # name, with dots inside nested structures, to where it is
    selector: str = ""  # name of the part that chooses the option of `variant`
    variant: VariantLayout | None = None
    name: str = ""  # of the variant


@dataclass(frozen=True)
class VariantLayout:
    """The options of a variant."""

    options: tuple[tuple[ctf.Choice, OptionLayout], ...]  # declaration and layout of each option
    _chosen: dict[int, OptionLayout] = field(default_factory=dict, compare=False, repr=False)

    def option(self, value: int) -> OptionLayout:
        """Return the option that this value of the selector chooses."""
        chosen = self._chosen.get(value)
        if chosen is None:
            for choice, option in self.options:
                if choice.holds(value):
                    self._chosen[value] = option
                    return option
            raise FieldError(f"a variant has no option for the value {value}")
        return chosen

    def has(self, path: Sequence[str]) -> bool:
        """Tell whether there is a field at this path: option, and names of members in it."""
        for choice, option in self.options:
            if choice.name == path[0]:
                is_inner = option.variant is not None and option.name == path[1]
                return ".".join(path[1:]) in option.parts or (
                    is_inner and option.variant is not None and option.variant.has(path[2:])
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
            part = option.parts[option.selector]
            at = begin + part.offset
            order = "big" if part.dtype[0] == ">" else "little"
            option = option.variant.option(
                int.from_bytes(data[at : at + part.width], order)  # type: ignore[arg-type]
            )


def lay_out_variant(variant: ctf.Variant) -> VariantLayout | None:
    """Compile the layout of a variant; None if an option is no structure of fixed size."""
    options = []
    for choice in variant.choices:
        if not isinstance(choice.type, ctf.Structure):
            return None
        option = _lay_out_option(choice.type)
        if option is None:
            return None
        options.append((choice, option))
    return VariantLayout(tuple(options))


def is_selector(declared: ctf.Type) -> bool:
    """Tell whether a field of this type can be a selector: an unsigned integer of whole bytes."""
    return isinstance(declared, ctf.Integer) and not declared.signed and _is_whole(declared)


def _lay_out_option(structure: ctf.Structure) -> OptionLayout | None:
    members = structure.members
    last = members[-1] if members else None
    variant = last.type if last is not None and isinstance(last.type, ctf.Variant) else None
    fixed = members if variant is None else members[:-1]
    leaves: list[Leaf] = []
    try:
        end = lay_out(ctf.Structure(fixed, structure.align), 0, leaves)
    except DynamicError:
        return None
    align, size = max(structure.align // BYTE, 1), -(-end // BYTE)
    parts = {".".join(leaf.path): part for leaf in leaves if (part := _part(leaf)) is not None}
    if variant is None or last is None:
        return OptionLayout(align, size, parts)
    reference, layout = variant.selector, lay_out_variant(variant)
    selector = reference.path[0] if len(reference.path) == 1 and reference.scope is None else None
    declared = next((member.type for member in fixed if member.name == selector), None)
    if layout is None or selector is None or declared is None or end % BYTE:
        return None
    if not is_selector(declared) or selector not in parts:
        return None
    return OptionLayout(align, size, parts, selector, layout, last.name)


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
