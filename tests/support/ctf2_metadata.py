"""Writes the metadata of a CTF 1.8 trace as CTF 2 JSON; the streams are the same in both."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from uuid import UUID

from msgflow.trace.ctf.declarations import TraceClass
from msgflow.trace.ctf.field_types import (
    Array,
    Integer,
    Real,
    Reference,
    Scope,
    Sequence,
    String,
    Structure,
    Type,
    Variant,
)
from msgflow.trace.ctf.reader import read_metadata

_ORIGINS = {
    Scope.PACKET_HEADER: "packet-header",
    Scope.PACKET_CONTEXT: "packet-context",
    Scope.EVENT_HEADER: "event-record-header",
    Scope.EVENT_CONTEXT: "event-record-common-context",
    Scope.SPECIFIC_CONTEXT: "event-record-specific-context",
    Scope.PAYLOAD: "event-record-payload",
}


def translate(directory: Path) -> None:
    """Replace the metadata of the trace in this directory."""
    fragments = _fragments(read_metadata(directory))
    text = "".join("\x1e" + json.dumps(fragment, indent=2) + "\n" for fragment in fragments)
    (directory / "metadata").write_text(text, encoding="utf-8")


def _fragments(trace: TraceClass) -> list[dict[str, Any]]:
    fragments: list[dict[str, Any]] = [
        {"type": "preamble", "version": 2, "uuid": list(UUID(trace.uuid).bytes)},
        {
            "type": "trace-class",
            "environment": trace.environment,
            "packet-header-field-class": _field_class(trace.packet_header, Scope.PACKET_HEADER),
        },
    ]
    for stream in trace.streams.values():
        clock = stream.clock
        assert clock is not None
        fragments += [
            {
                "type": "clock-class",
                "id": f"clock of {stream.id}",
                "name": clock.name,
                "uid": clock.uuid,
                "frequency": clock.frequency,
                "offset-from-origin": {
                    "seconds": clock.offset_seconds,
                    "cycles": clock.offset_cycles,
                },
            },
            {
                "type": "data-stream-class",
                "id": stream.id,
                "default-clock-class-id": f"clock of {stream.id}",
                "packet-context-field-class": _field_class(
                    stream.packet_context, Scope.PACKET_CONTEXT
                ),
                "event-record-header-field-class": _field_class(
                    stream.event_header, Scope.EVENT_HEADER
                ),
                "event-record-common-context-field-class": _field_class(
                    stream.event_context, Scope.EVENT_CONTEXT
                ),
            },
        ]
        fragments += [
            {
                "type": "event-record-class",
                "id": event.id,
                "data-stream-class-id": stream.id,
                "name": event.name,
                "specific-context-field-class": _field_class(
                    event.specific_context, Scope.SPECIFIC_CONTEXT
                ),
                "payload-field-class": _field_class(event.payload, Scope.PAYLOAD),
                "attributes": {"lttng.org,2009": {"log-level": "debug-line"}},
            }
            for event in stream.events.values()
        ]
    return fragments


def _field_class(declared: Type, scope: Scope) -> dict[str, Any]:
    """Return the field class; lengths and selectors are given by path and, at the top, origin."""

    def location(reference: Reference) -> dict[str, Any]:
        if reference.scope is not None:
            return {"origin": _ORIGINS[reference.scope], "path": list(reference.path)}
        return {"path": list(reference.path)}

    match declared:
        case Integer():
            found: dict[str, Any] = {
                "type": f"fixed-length-{'' if declared.signed else 'un'}signed-integer",
                "length": declared.size,
                "alignment": declared.align,
                "byte-order": "big-endian" if declared.big_endian else "little-endian",
                "preferred-display-base": declared.base,
                "roles": sorted(r for r in declared.roles if not r.startswith("clock.")),
            }
            if declared.labels is not None:
                found["mappings"] = {k: [list(r) for r in v] for k, v in declared.labels.items()}
            return found
        case Real():
            return {
                "type": "fixed-length-floating-point-number",
                "length": declared.size,
                "alignment": declared.align,
                "byte-order": "big-endian" if declared.big_endian else "little-endian",
            }
        case String():
            return {"type": "null-terminated-string"}
        case Array(is_text=True):
            return {"type": "static-length-string", "length": declared.length}
        case Array() if "metadata-stream-uuid" in declared.roles:
            return {"type": "static-length-blob", "length": 16, "roles": sorted(declared.roles)}
        case Array():
            return {
                "type": "static-length-array",
                "length": declared.length,
                "minimum-alignment": declared.minimum_align,
                "element-field-class": _field_class(declared.element, scope),
            }
        case Sequence(is_text=True):
            return {
                "type": "dynamic-length-string",
                "length-field-location": location(declared.length),
            }
        case Sequence():
            return {
                "type": "dynamic-length-array",
                "length-field-location": location(declared.length),
                "element-field-class": _field_class(declared.element, scope),
            }
        case Structure():
            return {
                "type": "structure",
                "minimum-alignment": declared.minimum_align,
                "member-classes": [
                    {"name": member.name, "field-class": _field_class(member.type, scope)}
                    for member in declared.members
                ],
            }
        case Variant():
            return {
                "type": "variant",
                "selector-field-location": location(declared.selector),
                "options": [
                    {
                        "name": choice.name,
                        "selector-field-ranges": [list(pair) for pair in choice.ranges],
                        "field-class": _field_class(choice.type, scope),
                    }
                    for choice in declared.choices
                ],
            }
        case _:
            raise TypeError(declared)
