"""Fixed layout: places of the fields of a type, where they do not depend on values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeGuard

from msgflow.trace.ctf.field_types import (
    Array,
    Integer,
    Real,
    Structure,
    Type,
    aligned,
)

_MOST_STEPS = 100_000


class DynamicError(Exception):
    """The layout of a type is not fixed."""


@dataclass(frozen=True)
class Leaf:
    """A number, or an array of numbers that follow each other without gaps."""

    path: tuple[str, ...]  # names of the members from the outermost to this one
    type: Integer | Real | Array
    position: int  # in bits


def lay_out(
    declared: Type,
    position: int,
    leaves: list[Leaf] | None = None,
    path: tuple[str, ...] = (),
) -> int:
    """Return the bit at which a field ends that begins at `position` or, aligned, behind it.

    Positions are bits from the begin of the packet. The numbers in the field are added to `leaves`,
    if given. `path` names the structures around it.

    A DynamicError says that the layout depends on values, or has too many parts to go through.
    """
    return _Layout(leaves).end(declared, position, path)


class _Layout:
    def __init__(self, leaves: list[Leaf] | None) -> None:
        self._leaves = leaves
        # Arrays inside arrays may have more elements than a loop can count.
        self._steps = 0

    def end(self, declared: Type, position: int, path: tuple[str, ...]) -> int:
        self._steps += 1
        if self._steps > _MOST_STEPS:
            raise DynamicError
        position = aligned(position, declared.align)
        match declared:
            case Integer() | Real():
                if self._leaves is not None:
                    self._leaves.append(Leaf(path, declared, position))
                return position + declared.size
            case Array() if is_dense(declared.element):
                if self._leaves is not None:
                    self._leaves.append(Leaf(path, declared, position))
                return position + declared.length * declared.element.size
            case Array():
                if declared.length > _MOST_STEPS:
                    raise DynamicError
                for number in range(declared.length):
                    position = self.end(declared.element, position, (*path, str(number)))
                return position
            case Structure():
                for member in declared.members:
                    position = self.end(member.type, position, (*path, member.name))
                return position
            case _:
                raise DynamicError


def is_dense(element: Type) -> TypeGuard[Integer | Real]:
    """Tell whether elements of this type follow each other without gaps."""
    return isinstance(element, Integer | Real) and element.size % element.align == 0
