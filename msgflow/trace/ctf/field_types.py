"""Types of fields, for metadata in any language; errors. Sizes and alignments are in bits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

from msgflow.backports import StrEnum

BYTE = 8
# Limits of what metadata may declare.
_MOST_BITS = 64
_MOST_ALIGN = 1 << 20
_MOST_ELEMENTS = 1 << 40
_MOST_FIELDS = 100_000
_DEEPEST = 32
_UUID_BYTES = 16


class MetadataError(Exception):
    """The metadata cannot be understood; the message says why and where."""


class FieldError(Exception):
    """A field cannot be read; the message says why."""


class Role(StrEnum):
    """What the value of a field is for, in the words of CTF 2."""

    MAGIC = "packet-magic-number"
    UUID = "metadata-stream-uuid"
    STREAM_CLASS = "data-stream-class-id"
    STREAM = "data-stream-id"
    PACKET_SIZE = "packet-total-length"
    CONTENT_SIZE = "packet-content-length"
    TIME = "default-clock-timestamp"
    END = "packet-end-default-clock-timestamp"
    DISCARDED = "discarded-event-record-counter-snapshot"
    SEQUENCE = "packet-sequence-number"
    EVENT_CLASS = "event-record-class-id"


class Scope(IntEnum):
    """The structures of a packet and an event, in the order of the stream."""

    PACKET_HEADER = 0
    PACKET_CONTEXT = 1
    EVENT_HEADER = 2
    EVENT_CONTEXT = 3
    SPECIFIC_CONTEXT = 4
    PAYLOAD = 5


@dataclass(frozen=True)
class Reference:
    """Path to the field with a length or a selector."""

    # Structure at which the path starts; None: the innermost structure around that has a member of
    # the path's first name.
    scope: Scope | None
    path: tuple[str | None, ...]  # names of members; None is the structure around the current one


@dataclass(frozen=True)
class Integer:
    """An integer, enumeration, boolean or bit array of at most 64 bits."""

    size: int
    align: int
    big_endian: bool
    signed: bool = False
    # Of an enumeration, label to ranges of values (both ends belong to it).
    labels: Mapping[str, tuple[tuple[int, int], ...]] | None = None
    is_text: bool = False  # an array of these is text
    roles: frozenset[str] = frozenset()  # what the value is for
    arrow: str = "integer"  # 'integer', 'bool' or 'bits': kind of the Arrow type
    base: int = 10  # number base for showing it: 10 or 16

    def __post_init__(self) -> None:
        if not 1 <= self.size <= _MOST_BITS:
            raise MetadataError(f"an integer of {self.size} bits makes no sense")
        _check_align(self.align)


@dataclass(frozen=True)
class VariableInteger:
    """An integer in groups of seven bits (LEB128)."""

    signed: bool
    labels: Mapping[str, tuple[tuple[int, int], ...]] | None = None
    roles: frozenset[str] = frozenset()
    align: int = BYTE


@dataclass(frozen=True)
class Real:
    """An IEEE 754 number of 32 or 64 bits."""

    size: int
    align: int
    big_endian: bool

    def __post_init__(self) -> None:
        if self.size not in {32, 64}:
            raise MetadataError("a floating point number must have 32 or 64 bits")
        _check_align(self.align)


@dataclass(frozen=True)
class String:
    """Text up to a NUL."""

    align: int = BYTE


class _Compound:
    """Common properties of types with others inside, which could grow without limit."""

    minimum_align: int = 1

    def __post_init__(self) -> None:
        _check_align(self.minimum_align)
        fields, depth = self.extent
        if fields > _MOST_FIELDS:
            raise MetadataError(f"a structure has more than {_MOST_FIELDS} fields")
        if depth > _DEEPEST:
            raise MetadataError("too deeply nested")

    @cached_property
    def extent(self) -> tuple[int, int]:
        """Number of all fields inside, this one included, and how deep they are nested."""
        inner = [each.extent if isinstance(each, _Compound) else (1, 1) for each in parts(self)]
        return 1 + sum(fields for fields, _ in inner), 1 + max((d for _, d in inner), default=0)

    @cached_property
    def align(self) -> int:
        """Alignment of what is inside, even where there is nothing."""
        return max([self.minimum_align, *(part.align for part in parts(self))])


class _Elements(_Compound):
    """Common properties of arrays and sequences."""

    element: Type

    @property
    def is_text(self) -> bool:
        element = self.element
        return isinstance(element, Integer) and (
            element.is_text and element.size == BYTE == element.align
        )


@dataclass(frozen=True)
class Array(_Elements):
    """A fixed number of elements."""

    element: Type
    length: int
    minimum_align: int = 1
    roles: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if not 0 <= self.length <= _MOST_ELEMENTS:
            raise MetadataError(f"an array of {self.length} elements makes no sense")
        super().__post_init__()


@dataclass(frozen=True)
class Sequence(_Elements):
    """As many elements as another field says."""

    element: Type
    length: Reference
    minimum_align: int = 1


@dataclass(frozen=True)
class Member:
    """A named field of a structure."""

    name: str
    type: Type


@dataclass(frozen=True)
class Structure(_Compound):
    """Fields one after the other."""

    members: tuple[Member, ...] = ()
    minimum_align: int = 1


@dataclass(frozen=True)
class Choice:
    """One option of a variant, for selector values in any of the ranges."""

    name: str
    type: Type
    ranges: tuple[tuple[int, int], ...]

    def holds(self, value: int) -> bool:
        """Tell whether this selector value chooses the option."""
        return any(first <= value <= last for first, last in self.ranges)


@dataclass(frozen=True)
class Variant(_Compound):
    """One of several types, as a selector says; it has no alignment of its own."""

    selector: Reference
    choices: tuple[Choice, ...]
    align: int = 1


@dataclass(frozen=True)
class Optional(_Compound):
    """A field that is there if the selector has one of these values."""

    selector: Reference
    content: Type
    ranges: tuple[tuple[int, int], ...]
    align: int = 1


Type = Integer | VariableInteger | Real | String | Array | Sequence | Structure | Variant | Optional


def parts(declared: object) -> list[Type]:
    """Return the types directly inside a type."""
    match declared:
        case Structure(members=members):
            return [member.type for member in members]
        case Variant(choices=choices):
            return [choice.type for choice in choices]
        case Array(element=element) | Sequence(element=element):
            return [element]
        case Optional(content=content):
            return [content]
        case _:
            return []


def may_have(declared: Type, role: str) -> bool:
    """Tell whether a field of this type can have the role."""
    if role != Role.UUID:
        return isinstance(declared, Integer | VariableInteger)
    if not isinstance(declared, Array) or declared.length != _UUID_BYTES:
        return False
    element = declared.element
    return isinstance(element, Integer) and element.size == BYTE == element.align


def aligned(position: int, align: int) -> int:
    """Return the first multiple of `align` (a power of two) at or after the position."""
    return (position + align - 1) & -align


def integer_of(declared: Mapping[str, Any], key: str, default: int | None) -> int:
    """Return a number that the metadata declare."""
    value = declared.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool):
        raise MetadataError(f"`{key}` is missing or no integer")
    return value


def _check_align(align: int) -> None:
    if align < 1 or align & (align - 1) or align > _MOST_ALIGN:
        raise MetadataError(f"an alignment of {align} bits makes no sense")
