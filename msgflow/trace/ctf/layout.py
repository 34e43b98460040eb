"""Layout of types: places of their fields, where they do not depend on values."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TypeGuard

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.field_types import BYTE, aligned

_MOST_STEPS = 100_000


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


def dtype_of(number: ctf.Integer | ctf.Real) -> str:
    """Return numpy's name for a number of whole bytes."""
    kind = "f" if isinstance(number, ctf.Real) else "i" if number.signed else "u"
    return f"{'>' if number.big_endian else '<'}{kind}{number.size // BYTE}"
