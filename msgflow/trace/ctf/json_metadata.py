"""Metadata in JSON, the language of CTF 2: fragments, each after a record separator."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any
from uuid import UUID

from msgflow.trace.ctf.clock import Clock
from msgflow.trace.ctf.declarations import EventClass, MetadataError, StreamClass, TraceClass
from msgflow.trace.ctf.json_types import TypeReader, integer_of

if TYPE_CHECKING:
    from collections.abc import Iterator

_SEPARATOR = "\x1e"


def parse(text: str) -> TraceClass:
    """Parse metadata.

    Raises:
        MetadataError: the text is not CTF 2 metadata, or contradicts itself.
    """
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
                for key in ("id", "name"):
                    if key in fragment:
                        clocks.setdefault(str(fragment[key]), _clock(fragment))
            case "data-stream-class":
                stream = _stream_class(fragment, types, clocks)
                if stream.id in trace.streams:
                    raise MetadataError(f"there are two stream classes {stream.id}")
                trace.streams[stream.id] = stream
            case "event-record-class":
                stream_id = integer_of(fragment, "data-stream-class-id", 0)
                if stream_id not in trace.streams:
                    raise MetadataError(f"there is no stream class {stream_id}")
                event = _event_class(fragment, types)
                if event.id in trace.streams[stream_id].events:
                    raise MetadataError(f"there are two events {event.id} in stream {stream_id}")
                trace.streams[stream_id].events[event.id] = event
            case other:
                raise MetadataError(f"unknown fragment {other!r}")
    return trace


def _fragments(text: str) -> Iterator[dict[str, Any]]:
    for number, part in enumerate(text.split(_SEPARATOR)):
        if not part.strip():
            continue
        try:
            fragment = json.loads(part)
        except ValueError as error:
            raise MetadataError(f"fragment {number} is no JSON ({error})") from error
        if not isinstance(fragment, dict):
            raise MetadataError(f"fragment {number} is no object")
        yield fragment


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


def _clock(fragment: dict[str, Any]) -> Clock:
    offset = fragment.get("offset-from-origin", {})
    frequency = integer_of(fragment, "frequency", None)
    if frequency < 1 or not isinstance(offset, dict):
        raise MetadataError("the frequency or offset of a clock makes no sense")
    name = fragment.get("name")
    return Clock(
        frequency=frequency,
        offset_seconds=integer_of(offset, "seconds", 0),
        offset_cycles=integer_of(offset, "cycles", 0),
        name=None if name is None else str(name),
        uuid=_uuid(fragment.get("uid", fragment.get("uuid"))),
    )


def _uuid(value: Any) -> str | None:
    """Return a uuid given as 16 numbers or as text, None if it is not one."""
    try:
        return str(UUID(bytes=bytes(value)) if isinstance(value, list) else UUID(value))
    except (ValueError, TypeError, AttributeError):
        return None
