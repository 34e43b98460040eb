"""Variants of TSDL: which values of the selector choose which option.

The selector is an enumeration declared before, and its labels are the names of the options.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow.trace.ctf.field_types import (
    Array,
    Choice,
    Integer,
    Member,
    MetadataError,
    Reference,
    Scope,
    Sequence,
    Structure,
    Type,
    Variant,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

Frames = list[dict[str, Type]]

_MOST_FIELDS = 100_000


def resolved(structure: Structure, scope: Scope, outer: Mapping[Scope, Structure]) -> Structure:
    """Return the structure of this scope with all options' ranges."""
    scopes: dict[Scope, dict[str, Type]] = {
        known: {member.name: member.type for member in of_scope.members}
        for known, of_scope in outer.items()
        if known < scope
    }
    return _Resolver(scope, scopes).structure(structure, [scopes[k] for k in sorted(scopes)])


class _Resolver:
    def __init__(self, scope: Scope, scopes: dict[Scope, dict[str, Type]]) -> None:
        self._scope = scope
        self._scopes = scopes
        self._count = 0

    def structure(self, declared: Structure, frames: Frames) -> Structure:
        frame: dict[str, Type] = {}
        self._scopes.setdefault(self._scope, frame)
        members = []
        for member in declared.members:
            field = self._type(member.type, [*frames, frame])
            frame[member.name] = field
            members.append(Member(member.name, field))
        return Structure(tuple(members), declared.minimum_align)

    def _type(self, declared: Type, frames: Frames) -> Type:
        self._count += 1
        if self._count > _MOST_FIELDS:
            # Structures that contain others by name can grow without limit.
            raise MetadataError(f"a structure has more than {_MOST_FIELDS} fields")
        match declared:
            case Structure():
                return self.structure(declared, frames)
            case Array() | Sequence():
                return replace(declared, element=self._type(declared.element, frames))
            case Variant():
                return self._variant(declared, frames)
            case _:
                return declared

    def _variant(self, declared: Variant, frames: Frames) -> Variant:
        selector = self._find(declared.selector, frames)
        if not isinstance(selector, Integer) or selector.labels is None:
            path = ".".join(map(str, declared.selector.path))
            raise MetadataError(f"the selector {path!r} of a variant is no enumeration before it")
        choices = []
        for choice in declared.choices:
            name = without_prefix(choice.name)
            ranges = selector.labels.get(choice.name) or selector.labels.get(name) or ()
            choices.append(Choice(name, self._type(choice.type, frames), ranges))
        return replace(declared, choices=tuple(choices))

    def _find(self, reference: Reference, frames: Frames) -> Type | None:
        if reference.scope is not None:
            return _follow(self._scopes.get(reference.scope), reference.path)
        for frame in reversed(frames):
            if reference.path[0] in frame:
                return _follow(frame, reference.path)
        return None


def without_prefix(name: str) -> str:
    """Remove the underscore that keeps names of fields apart from words of the language."""
    return name.removeprefix("_")


def _follow(frame: dict[str, Type] | None, path: tuple[str | None, ...]) -> Type | None:
    found: Type | None = None
    for name in path:
        if frame is None or name is None:
            return None
        found = frame.get(name)
        match found:
            case Structure(members=members):
                frame = {member.name: member.type for member in members}
            case Variant(choices=choices):
                frame = {
                    member.name: member.type
                    for choice in choices
                    if isinstance(choice.type, Structure)
                    for member in choice.type.members
                }
            case _:
                frame = None
    return found
