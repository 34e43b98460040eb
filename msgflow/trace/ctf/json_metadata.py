"""Metadata in JSON, the language of CTF 2: fragments, each after a record separator."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any
from uuid import UUID

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.declarations import Clock, EventClass, StreamClass, TraceClass
from msgflow.trace.ctf.field_types import BYTE, MetadataError, Scope, integer_of, may_have

_SEPARATOR = "\x1e"
# Larger than any number that makes sense, and short enough for a message.
_LARGEST = 1 << 80
_MOST_DIGITS = 30
_LONE_HALF = re.compile(r"\\u[dD][89a-fA-F]")

_ORIGINS = {
    "packet-header": Scope.PACKET_HEADER,
    "packet-context": Scope.PACKET_CONTEXT,
    "event-record-header": Scope.EVENT_HEADER,
    "event-record-common-context": Scope.EVENT_CONTEXT,
    "event-record-specific-context": Scope.SPECIFIC_CONTEXT,
    "event-record-payload": Scope.PAYLOAD,
}
# Integers of CTF 2, and what they are to Arrow.
_INTEGERS = {
    "fixed-length-unsigned-integer": "integer",
    "fixed-length-signed-integer": "integer",
    "fixed-length-boolean": "bool",
    "fixed-length-bit-array": "bits",
    "fixed-length-bit-map": "bits",
}
_BIT_ORDERS = {False: "first-to-last", True: "last-to-first"}
_CHARACTER = ctf.Integer(BYTE, BYTE, False, is_text=True)
_BYTE = ctf.Integer(BYTE, BYTE, False)
_TRUE = ((1, (1 << 64) - 1),)

Ranges = tuple[tuple[int, int], ...]


def parse(text: str) -> TraceClass:
    """Parse metadata."""
    trace = TraceClass()
    types = TypeReader()
    clocks: dict[str, Clock] = {}
    for fragment in _fragments(text):
        match fragment.get("type"):
            case "preamble":
                if fragment.get("version") != 2:
                    raise MetadataError(f"CTF version {fragment.get('version')} is unknown")
                trace.uuid = _uuid(fragment.get("uuid")) or trace.uuid
            case "field-class-alias":
                types.add_alias(fragment)
            case "trace-class":
                trace.uuid = trace.uuid or _uuid(fragment.get("uid"))
                environment = fragment.get("environment", {})
                if not isinstance(environment, dict):
                    raise MetadataError("the environment is no object")
                trace.environment = environment
                trace.packet_header = types.structure(fragment, "packet-header-field-class")
            case "clock-class":
                clock = _clock(fragment, trace.notes)
                for key in ("id", "name"):
                    if key in fragment:
                        clocks.setdefault(str(fragment[key]), clock)
            case "data-stream-class":
                stream = _stream_class(fragment, types, clocks)
                if stream.id in trace.streams:
                    raise MetadataError(f"there are two stream classes {stream.id}")
                trace.streams[stream.id] = stream
            case "event-record-class":
                stream_id = integer_of(fragment, "data-stream-class-id", 0)
                if stream_id not in trace.streams:
                    raise MetadataError(f"there is no stream class {stream_id}")
                event = EventClass(
                    id=integer_of(fragment, "id", 0),
                    name=str(fragment.get("name", "")),
                    specific_context=types.structure(fragment, "specific-context-field-class"),
                    payload=types.structure(fragment, "payload-field-class"),
                )
                trace.add_event(trace.streams[stream_id], event)
            case other:
                raise MetadataError(f"unknown fragment {other!r}")
    return trace


def _fragments(text: str) -> Iterator[dict[str, Any]]:
    for number, part in enumerate(text.split(_SEPARATOR)):
        if not part.strip():
            continue
        try:
            fragment = json.loads(part, parse_int=_number)
        except ValueError as error:
            raise MetadataError(f"fragment {number} is no JSON ({error})") from error
        if not isinstance(fragment, dict):
            raise MetadataError(f"fragment {number} is no object")
        yield _encodable(fragment) if _LONE_HALF.search(part) else fragment


def _number(digits: str) -> int:
    if len(digits) <= _MOST_DIGITS:
        return int(digits)
    return -_LARGEST if digits.startswith("-") else _LARGEST


def _encodable(value: Any) -> Any:
    """Replace halves of characters, which no text in UTF-8 can hold."""
    match value:
        case str():
            return value.encode("utf-16", "surrogatepass").decode("utf-16", "replace")
        case list():
            return [_encodable(item) for item in value]
        case dict():
            return {_encodable(key): _encodable(item) for key, item in value.items()}
        case _:
            return value


def _stream_class(
    fragment: dict[str, Any], types: TypeReader, clocks: dict[str, Clock]
) -> StreamClass:
    name = fragment.get("default-clock-class-id", fragment.get("default-clock-class-name"))
    if name is not None and str(name) not in clocks:
        raise MetadataError(f"there is no clock {name!r}")
    return StreamClass(
        id=integer_of(fragment, "id", 0),
        packet_context=types.structure(fragment, "packet-context-field-class"),
        event_header=types.structure(fragment, "event-record-header-field-class"),
        event_context=types.structure(fragment, "event-record-common-context-field-class"),
        clock=None if name is None else clocks[str(name)],
    )


def _clock(fragment: dict[str, Any], notes: list[str]) -> Clock:
    # Before the final specification it was called `offset`.
    offset = fragment.get("offset-from-origin", fragment.get("offset", {}))
    if not isinstance(offset, dict):
        raise MetadataError("the offset of a clock is no object")
    name = fragment.get("name")
    return Clock(
        frequency=integer_of(fragment, "frequency", None),
        offset_seconds=integer_of(offset, "seconds", 0),
        offset_cycles=integer_of(offset, "cycles", 0),
        name=None if name is None else str(name),
        uuid=_uuid(fragment.get("uid", fragment.get("uuid"))),
    ).plausible(notes)


def _uuid(value: Any) -> str | None:
    """Return a uuid given as 16 numbers or as text, None if it is not one."""
    try:
        return str(UUID(bytes=bytes(value)) if isinstance(value, list) else UUID(value))
    except (ValueError, TypeError, AttributeError):
        return None


class TypeReader:
    """Reader of field classes and their aliases."""

    def __init__(self) -> None:
        self._aliases: dict[str, ctf.Type] = {}

    def add_alias(self, fragment: dict[str, Any]) -> None:
        """Learn a name for a field class."""
        self._aliases[str(fragment.get("name"))] = self._type(fragment.get("field-class"))

    def structure(self, fragment: dict[str, Any], key: str) -> ctf.Structure:
        """Return the structure under `key`; an empty one where the metadata have no such key."""
        if key not in fragment:
            return ctf.Structure()
        declared = self._type(fragment[key])
        if not isinstance(declared, ctf.Structure):
            raise MetadataError(f"`{key}` is no structure")
        return declared

    def _type(self, declared: Any) -> ctf.Type:
        if isinstance(declared, str) and declared in self._aliases:
            return self._aliases[declared]
        if not isinstance(declared, dict):
            raise MetadataError(f"{declared!r} is no field class")
        # Before the final specification integers with mappings had types of their own.
        kind = str(declared.get("type")).replace("signed-enumeration", "signed-integer")
        match kind:
            case _ if kind in _INTEGERS:
                return _integer(declared, kind)
            case "variable-length-unsigned-integer" | "variable-length-signed-integer":
                integer = ctf.VariableInteger("unsigned" not in kind, _labels(declared))
                return replace(integer, roles=_roles(declared, integer))
            case "fixed-length-floating-point-number":
                size = integer_of(declared, "length", None)
                align = integer_of(declared, "alignment", 1)
                return ctf.Real(size, align, _is_big_endian(declared))
            case "null-terminated-string":
                _check_encoding(declared)
                return ctf.String()
            case "static-length-string":
                _check_encoding(declared)
                return ctf.Array(_CHARACTER, integer_of(declared, "length", None))
            case "dynamic-length-string":
                _check_encoding(declared)
                return ctf.Sequence(_CHARACTER, _reference(declared, "length-field-location"))
            case "static-length-blob":
                blob = ctf.Array(_BYTE, integer_of(declared, "length", None))
                return replace(blob, roles=_roles(declared, blob))
            case "dynamic-length-blob":
                return ctf.Sequence(_BYTE, _reference(declared, "length-field-location"))
            case "static-length-array":
                return ctf.Array(
                    self._type(declared.get("element-field-class")),
                    integer_of(declared, "length", None),
                    integer_of(declared, "minimum-alignment", 1),
                )
            case "dynamic-length-array":
                return ctf.Sequence(
                    self._type(declared.get("element-field-class")),
                    _reference(declared, "length-field-location"),
                    integer_of(declared, "minimum-alignment", 1),
                )
            case "structure":
                return self._structure(declared)
            case "variant":
                return self._variant(declared)
            case "optional":
                return ctf.Optional(
                    _reference(declared, "selector-field-location"),
                    self._type(declared.get("field-class")),
                    _ranges(declared.get("selector-field-ranges"))
                    if "selector-field-ranges" in declared
                    else _TRUE,
                )
            case _:
                raise MetadataError(f"unknown field class {declared.get('type')!r}")

    def _structure(self, declared: dict[str, Any]) -> ctf.Structure:
        members = [
            ctf.Member(str(member.get("name")), self._type(member.get("field-class")))
            for member in _objects(declared, "member-classes")
        ]
        return ctf.Structure(tuple(members), integer_of(declared, "minimum-alignment", 1))

    def _variant(self, declared: dict[str, Any]) -> ctf.Variant:
        choices = [
            ctf.Choice(
                str(option.get("name") or f"option_{index}"),
                self._type(option.get("field-class")),
                _ranges(option.get("selector-field-ranges")),
            )
            for index, option in enumerate(_objects(declared, "options"))
        ]
        return ctf.Variant(_reference(declared, "selector-field-location"), tuple(choices))


def _integer(declared: dict[str, Any], kind: str) -> ctf.Integer:
    integer = ctf.Integer(
        size=integer_of(declared, "length", None),
        align=integer_of(declared, "alignment", 1),
        big_endian=_is_big_endian(declared),
        signed=kind == "fixed-length-signed-integer",
        labels=_labels(declared),
        arrow=_INTEGERS[kind],
        base=integer_of(declared, "preferred-display-base", 10),
    )
    return replace(integer, roles=_roles(declared, integer))


def _is_big_endian(declared: dict[str, Any]) -> bool:
    orders = {"little-endian": False, "big-endian": True}
    big_endian = orders.get(str(declared.get("byte-order")))
    if big_endian is None:
        raise MetadataError(f"there is no byte order {declared.get('byte-order')!r}")
    if declared.get("bit-order", _BIT_ORDERS[big_endian]) != _BIT_ORDERS[big_endian]:
        raise MetadataError("a bit order that does not follow the byte order is not supported")
    return big_endian


def _labels(declared: dict[str, Any]) -> dict[str, Ranges] | None:
    mappings = declared.get("mappings")
    if not isinstance(mappings, dict):
        return None
    return {str(label): _ranges(ranges) for label, ranges in mappings.items()}


def _ranges(declared: Any) -> Ranges:
    try:
        ranges = tuple((first, last) for first, last in declared)
    except (TypeError, ValueError) as error:
        raise MetadataError(f"{declared!r} is no list of ranges") from error
    if not all(isinstance(value, int) for pair in ranges for value in pair):
        raise MetadataError(f"{declared!r} is no list of ranges of integers")
    return ranges


def _roles(declared: dict[str, Any], of_type: ctf.Type) -> frozenset[str]:
    roles = declared.get("roles", [])
    if not isinstance(roles, list):
        raise MetadataError(f"{roles!r} is no list of roles")
    return frozenset(role for role in map(str, roles) if may_have(of_type, role))


def _objects(declared: dict[str, Any], key: str) -> list[dict[str, Any]]:
    objects = declared.get(key, [])
    if not isinstance(objects, list) or not all(isinstance(item, dict) for item in objects):
        raise MetadataError(f"`{key}` is no list of objects")
    return objects


def _reference(declared: dict[str, Any], key: str) -> ctf.Reference:
    location = declared.get(key)
    origin, path = None, location
    if isinstance(location, dict):
        origin, path = location.get("origin"), location.get("path")
    elif isinstance(location, list) and location and location[0] in _ORIGINS:
        origin, path = location[0], location[1:]
    if not isinstance(path, list) or not path:
        raise MetadataError(f"`{key}` is no location")
    if origin is not None and origin not in _ORIGINS:
        raise MetadataError(f"there is no origin {origin!r}")
    names = tuple(None if name is None else str(name) for name in path)
    return ctf.Reference(None if origin is None else _ORIGINS[origin], names)


def _check_encoding(declared: dict[str, Any]) -> None:
    encoding = str(declared.get("encoding", "utf-8"))
    if encoding.lower() != "utf-8":
        raise MetadataError(f"text in {encoding} is not supported")
