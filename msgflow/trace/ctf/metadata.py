"""Metadata file of a trace: in text or packets, in TSDL or JSON."""

from __future__ import annotations

from pathlib import Path

from msgflow.errors import TraceError
from msgflow.trace.ctf import json_metadata, tsdl
from msgflow.trace.ctf.declarations import TraceClass
from msgflow.trace.ctf.field_types import MetadataError
from msgflow.trace.metadata_frame import MetadataKind, text_of


def read(directory: Path) -> TraceClass:
    """Read what the trace in this directory declares."""
    kind, content = text_of(directory)
    text = content.decode("utf-8", "replace")
    try:
        return json_metadata.parse(text) if kind is MetadataKind.JSON else tsdl.parse(text)
    except (MetadataError, RecursionError) as error:
        reason = str(error) if isinstance(error, MetadataError) else "too deeply nested"
        raise damaged_error(directory, reason) from error


def damaged_error(directory: Path, reason: str) -> TraceError:
    """Return the error for metadata that makes no sense."""
    return TraceError(
        f"the trace's `metadata` is damaged or incomplete: {reason} — {directory}",
        hint="copy it again from where it was recorded",
    )
