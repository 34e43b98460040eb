"""Bounds of what metadata may declare: types made of types can be made to explode."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.trace.ctf.metadata_error import MetadataError
from msgflow.trace.ctf.types import Array, Optional, Sequence, Structure, Variant

if TYPE_CHECKING:
    from collections.abc import Iterator

    from msgflow.trace.ctf.declarations import TraceClass
    from msgflow.trace.ctf.types import Type

_MOST_FIELDS = 100_000
_DEEPEST = 32


def check_shapes(trace: TraceClass) -> None:
    """Look at all structures that a trace declares.

    Raises:
        MetadataError: one has too many fields, or fields inside too many others.
    """
    shapes = _Shapes()
    for structure in _structures(trace):
        fields, depth = shapes.of(structure)
        if fields > _MOST_FIELDS:
            raise MetadataError(f"a structure has more than {_MOST_FIELDS} fields")
        if depth > _DEEPEST:
            raise MetadataError("too deeply nested")


def _structures(trace: TraceClass) -> Iterator[Structure]:
    yield trace.packet_header
    for stream in trace.streams.values():
        yield from (stream.packet_context, stream.event_header, stream.event_context)
        for event in stream.events.values():
            yield from (event.specific_context, event.payload)


class _Shapes:
    """Numbers of fields and depths; a type that occurs again is not gone through again."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[int, int]] = {}

    def of(self, declared: Type) -> tuple[int, int]:
        known = self._known.get(id(declared))
        if known is None:
            inner = [self.of(part) for part in _parts(declared)]
            fields = 1 + sum(number for number, _ in inner)
            known = fields, 1 + max((depth for _, depth in inner), default=0)
            self._known[id(declared)] = known
        return known


def _parts(declared: Type) -> list[Type]:
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
