"""Metadata in JSON, the language of CTF 2: fragments, each after a record separator."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any
from uuid import UUID

from msgflow.trace.ctf.clock import Clock
from msgflow.trace.ctf.declarations import EventClass, StreamClass, TraceClass
from msgflow.trace.ctf.field_types import MetadataError
from msgflow.trace.ctf.json_types import TypeReader, integer_of

if TYPE_CHECKING:
    from collections.abc import Iterator

_SEPARATOR = "\x1e"
# Larger than any number that makes sense, and short enough for a message.
_LARGEST = 1 << 80
_MOST_DIGITS = 30
_LONE_HALF = re.compile(r"\\u[dD][89a-fA-F]")


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
                trace.add_event(trace.streams[stream_id], _event_class(fragment, types))
            case other:
                raise MetadataError(f"unknown fragment {other!r}")
    return trace


def _fragments(text: str) -> Iterator[dict[str, Any]]:
    for number, part in enumerate(text.split(_SEPARATOR)):
        if not part.strip():
            continue
        try:
            fragment = json.loads(part, parse_int=_integer)
        except ValueError as error:
            raise MetadataError(f"fragment {number} is no JSON ({error})") from error
        if not isinstance(fragment, dict):
            raise MetadataError(f"fragment {number} is no object")
        yield _encodable(fragment) if _LONE_HALF.search(part) else fragment


def _integer(digits: str) -> int:
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


def _event_class(fragment: dict[str, Any], types: TypeReader) -> EventClass:
    return EventClass(
        id=integer_of(fragment, "id", 0),
        name=str(fragment.get("name", "")),
        specific_context=types.structure(fragment, "specific-context-field-class"),
        payload=types.structure(fragment, "payload-field-class"),
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
