"""Frame of the metadata of a trace: its kind, and whether it is whole.

This module looks only at the frame, so that no reader meets a file that is cut off or no metadata.
"""

from __future__ import annotations

import struct
from enum import Enum
from typing import TYPE_CHECKING

from msgflow.errors import TraceError
from msgflow.trace.regular_file import read_regular

if TYPE_CHECKING:
    from pathlib import Path

FILE_NAME = "metadata"

DIRECTORY_HINT = "give the directory that `ros2 trace` or `lttng` wrote"
"""Hint for those who gave something that is no trace."""

BYTE_ORDER_OF_MAGIC = {b"\x57\x1d\xd1\x75": "<", b"\x75\xd1\x1d\x57": ">"}
# Of a metadata packet: magic, uuid, checksum, content size and packet size in bits, then five
# bytes that say nothing useful (the version in them is 1.8 even for CTF 2).
HEADER_SIZE = 37
SIZES_OFFSET = 24
# Of the largest kernel traces it is a few megabytes.
_MOST_BYTES = 64 << 20
_RECORD_SEPARATOR = b"\x1e"
_TSDL_BEGIN = (b"/* CTF 1.", b"trace", b"typealias", b"typedef", b"clock", b"env", b"struct")


class MetadataKind(Enum):
    """The language of the metadata."""

    TSDL = "CTF 1.8"
    JSON = "CTF 2"


def content_of(directory: Path) -> bytes:
    """Return the metadata file of the trace in this directory."""
    return read_regular(directory / FILE_NAME, _MOST_BYTES)


def kind_of(directory: Path) -> MetadataKind:
    """Tell the kind of metadata of the trace in this directory."""
    content = content_of(directory)
    if not content:
        raise TraceError(
            f"the trace's `metadata` is empty, nothing of it was written yet — {directory}",
            hint="stop the recording (lttng stop), then copy it again",
        )
    order = BYTE_ORDER_OF_MAGIC.get(content[:4])
    if order is not None:
        content = _first_content(content, order, directory)
    if content.startswith(_RECORD_SEPARATOR):
        return MetadataKind.JSON
    if order is not None or content.lstrip().startswith(_TSDL_BEGIN):
        return MetadataKind.TSDL
    raise TraceError(
        f"not a CTF trace, its `metadata` is something else — {directory}",
        hint=DIRECTORY_HINT,
    )


def _first_content(content: bytes, order: str, directory: Path) -> bytes:
    """Check that packet follows packet up to the end, return the text of the first one."""
    offset = 0
    while offset < len(content):
        rest = len(content) - offset
        if rest < HEADER_SIZE:
            raise _cut_off_error(directory)
        bits = struct.unpack_from(f"{order}II", content, offset + SIZES_OFFSET)
        content_size, packet_size = bits[0] // 8, bits[1] // 8
        if not HEADER_SIZE <= content_size <= packet_size <= rest:
            raise _cut_off_error(directory)
        offset += packet_size
    return content[HEADER_SIZE:]


def _cut_off_error(directory: Path) -> TraceError:
    return TraceError(
        f"the trace's `metadata` is damaged or cut off — {directory}",
        hint="copy it again from where it was recorded",
    )
