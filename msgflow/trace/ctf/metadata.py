"""Metadata file of a trace: in text or packets, in TSDL or JSON; bounds of what it may declare."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.errors import TraceError
from msgflow.trace.ctf import json_metadata, tsdl
from msgflow.trace.ctf.field_types import MetadataError, parts
from msgflow.trace.metadata_frame import MetadataKind, text_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from msgflow.trace.ctf.declarations import TraceClass
    from msgflow.trace.ctf.field_types import Structure, Type


def read(directory: Path) -> TraceClass:
    """Read what the trace in this directory declares."""
    kind, content = text_of(directory)
    text = content.decode("utf-8", "replace")
    try:
        trace = json_metadata.parse(text) if kind is MetadataKind.JSON else tsdl.parse(text)
        _check_sizes(trace)
    except (MetadataError, RecursionError) as error:
        reason = str(error) if isinstance(error, MetadataError) else "too deeply nested"
        raise damaged_error(directory, reason) from error
    return trace


def damaged_error(directory: Path, reason: str) -> TraceError:
    """Return the error for metadata that makes no sense."""
    return TraceError(
        f"the trace's `metadata` is damaged or incomplete: {reason} — {directory}",
        hint="copy it again from where it was recorded",
    )


_MOST_FIELDS = 100_000
_DEEPEST = 32


def _check_sizes(trace: TraceClass) -> None:
    """Check all structures that a trace declares: types inside types can grow without limit."""
    known: dict[int, tuple[int, int]] = {}
    for structure in _structures(trace):
        fields, depth = _size(structure, known)
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


def _size(declared: Type, known: dict[int, tuple[int, int]]) -> tuple[int, int]:
    """Return the number of fields and the depth of a type; each type is counted once."""
    if id(declared) not in known:
        inner = [_size(part, known) for part in parts(declared)]
        depth = max((depth for _, depth in inner), default=0)
        known[id(declared)] = 1 + sum(number for number, _ in inner), 1 + depth
    return known[id(declared)]
