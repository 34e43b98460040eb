"""Field types from CTF 2 metadata, which calls them field classes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from msgflow.trace.ctf.field_types import (
    BYTE,
    Array,
    Choice,
    Integer,
    Member,
    MetadataError,
    Optional,
    Real,
    Reference,
    Scope,
    Sequence,
    String,
    Structure,
    Type,
    VariableInteger,
    Variant,
    may_have,
)

_ORIGINS = {
    "packet-header": Scope.PACKET_HEADER,
    "packet-context": Scope.PACKET_CONTEXT,
    "event-record-header": Scope.EVENT_HEADER,
    "event-record-common-context": Scope.EVENT_CONTEXT,
    "event-record-specific-context": Scope.SPECIFIC_CONTEXT,
    "event-record-payload": Scope.PAYLOAD,
}
_ARROW = {
    "fixed-length-boolean": "bool",
    "fixed-length-bit-array": "bits",
    "fixed-length-bit-map": "bits",
}
_BIT_ORDERS = {False: "first-to-last", True: "last-to-first"}
_CHARACTER = Integer(BYTE, BYTE, False, is_text=True)
_BYTE = Integer(BYTE, BYTE, False)
_TRUE = ((1, (1 << 64) - 1),)
_MOST_BITS = 64
_MOST_ALIGN = 1 << 20
_MOST_ELEMENTS = 1 << 40

Ranges = tuple[tuple[int, int], ...]


class TypeReader:
    """Reader of field classes and their aliases."""

    def __init__(self) -> None:
        self._aliases: dict[str, Type] = {}

    def add_alias(self, fragment: dict[str, Any]) -> None:
        """Learn a name for a field class."""
        self._aliases[str(fragment.get("name"))] = self._type(fragment.get("field-class"))

    def structure(self, fragment: dict[str, Any], key: str) -> Structure:
        """Return the structure under `key`, an empty one if there is none."""
        if key not in fragment:
            return Structure()
        declared = self._type(fragment[key])
        if not isinstance(declared, Structure):
            raise MetadataError(f"`{key}` is no structure")
        return declared

    def _type(self, declared: Any) -> Type:
        if isinstance(declared, str) and declared in self._aliases:
            return self._aliases[declared]
        if not isinstance(declared, dict):
            raise MetadataError(f"{declared!r} is no field class")
        # Before the final specification integers with mappings had types of their own.
        kind = str(declared.get("type")).replace("signed-enumeration", "signed-integer")
        match kind:
            case (
                "fixed-length-unsigned-integer"
                | "fixed-length-signed-integer"
                | "fixed-length-boolean"
                | "fixed-length-bit-array"
                | "fixed-length-bit-map"
            ):
                return _integer(declared, kind)
            case "variable-length-unsigned-integer" | "variable-length-signed-integer":
                integer = VariableInteger("unsigned" not in kind, _labels(declared))
                return replace(integer, roles=_roles(declared, integer))
            case "fixed-length-floating-point-number":
                size = integer_of(declared, "length", None)
                if size not in {32, 64}:
                    raise MetadataError("a floating point number must have 32 or 64 bits")
                return Real(size, _align(declared, "alignment"), _is_big_endian(declared))
            case "null-terminated-string":
                _check_encoding(declared)
                return String()
            case "static-length-string":
                _check_encoding(declared)
                return Array(_CHARACTER, _length(declared))
            case "dynamic-length-string":
                _check_encoding(declared)
                return Sequence(_CHARACTER, _reference(declared, "length-field-location"))
            case "static-length-blob":
                blob = Array(_BYTE, _length(declared))
                return replace(blob, roles=_roles(declared, blob))
            case "dynamic-length-blob":
                return Sequence(_BYTE, _reference(declared, "length-field-location"))
            case "static-length-array":
                return Array(
                    self._type(declared.get("element-field-class")),
                    _length(declared),
                    _align(declared, "minimum-alignment"),
                )
            case "dynamic-length-array":
                return Sequence(
                    self._type(declared.get("element-field-class")),
                    _reference(declared, "length-field-location"),
                    _align(declared, "minimum-alignment"),
                )
            case "structure":
                return self._structure(declared)
            case "variant":
                return self._variant(declared)
            case "optional":
                return Optional(
                    _reference(declared, "selector-field-location"),
                    self._type(declared.get("field-class")),
                    _ranges(declared.get("selector-field-ranges"))
                    if "selector-field-ranges" in declared
                    else _TRUE,
                )
            case _:
                raise MetadataError(f"unknown field class {declared.get('type')!r}")

    def _structure(self, declared: dict[str, Any]) -> Structure:
        members = [
            Member(str(member.get("name")), self._type(member.get("field-class")))
            for member in _objects(declared, "member-classes")
        ]
        return Structure(tuple(members), _align(declared, "minimum-alignment"))

    def _variant(self, declared: dict[str, Any]) -> Variant:
        choices = [
            Choice(
                str(option.get("name") or f"option_{index}"),
                self._type(option.get("field-class")),
                _ranges(option.get("selector-field-ranges")),
            )
            for index, option in enumerate(_objects(declared, "options"))
        ]
        return Variant(_reference(declared, "selector-field-location"), tuple(choices))


def integer_of(declared: dict[str, Any], key: str, default: int | None) -> int:
    """Return a number of an object."""
    value = declared.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool):
        raise MetadataError(f"`{key}` is missing or no integer")
    return value


def _integer(declared: dict[str, Any], kind: str) -> Integer:
    size = integer_of(declared, "length", None)
    if not 1 <= size <= _MOST_BITS:
        raise MetadataError(f"an integer of {size} bits makes no sense")
    integer = Integer(
        size=size,
        align=_align(declared, "alignment"),
        big_endian=_is_big_endian(declared),
        signed=kind == "fixed-length-signed-integer",
        labels=_labels(declared),
        arrow=_ARROW.get(kind, "integer"),
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


def _align(declared: dict[str, Any], key: str) -> int:
    align = integer_of(declared, key, 1)
    if align < 1 or align & (align - 1) or align > _MOST_ALIGN:
        raise MetadataError(f"an alignment of {align} bits makes no sense")
    return align


def _length(declared: dict[str, Any]) -> int:
    length = integer_of(declared, "length", None)
    if not 0 <= length <= _MOST_ELEMENTS:
        raise MetadataError(f"a length of {length} makes no sense")
    return length


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


def _roles(declared: dict[str, Any], of_type: Type) -> frozenset[str]:
    roles = declared.get("roles", [])
    if not isinstance(roles, list):
        raise MetadataError(f"{roles!r} is no list of roles")
    return frozenset(role for role in map(str, roles) if may_have(of_type, role))


def _objects(declared: dict[str, Any], key: str) -> list[dict[str, Any]]:
    objects = declared.get(key, [])
    if not isinstance(objects, list) or not all(isinstance(item, dict) for item in objects):
        raise MetadataError(f"`{key}` is no list of objects")
    return objects


def _reference(declared: dict[str, Any], key: str) -> Reference:
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
    return Reference(None if origin is None else _ORIGINS[origin], names)


def _check_encoding(declared: dict[str, Any]) -> None:
    encoding = str(declared.get("encoding", "utf-8"))
    if encoding.lower() != "utf-8":
        raise MetadataError(f"text in {encoding} is not supported")
