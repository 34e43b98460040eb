"""Reads the metadata file of a trace, whichever form and language it is in."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from msgflow.errors import TraceError
from msgflow.trace.ctf import json_metadata, tsdl
from msgflow.trace.ctf.metadata_error import MetadataError
from msgflow.trace.ctf.shape import check_shapes
from msgflow.trace.metadata import (
    BYTE_ORDER_OF_MAGIC,
    HEADER_SIZE,
    SIZES_OFFSET,
    MetadataKind,
    content_of,
    kind_of,
)

if TYPE_CHECKING:
    from pathlib import Path

    from msgflow.trace.ctf.declarations import TraceClass


def read(directory: Path) -> TraceClass:
    """Read what the trace in this directory declares.

    Raises:
        TraceError: it cannot be read or understood.
    """
    kind = kind_of(directory)
    try:
        text = _text(content_of(directory))
        trace = json_metadata.parse(text) if kind is MetadataKind.JSON else tsdl.parse(text)
        check_shapes(trace)
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


def _text(content: bytes) -> str:
    """Take the text out of its packets, if it is in such."""
    order = BYTE_ORDER_OF_MAGIC.get(content[:4])
    if order is not None:
        parts = []
        offset = 0
        while offset < len(content):
            content_bits, packet_bits = struct.unpack_from(
                f"{order}II", content, offset + SIZES_OFFSET
            )
            parts.append(content[offset + HEADER_SIZE : offset + content_bits // 8])
            offset += packet_bits // 8
        content = b"".join(parts)
    return content.decode("utf-8", "replace")
