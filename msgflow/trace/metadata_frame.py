"""Frame of the metadata of a trace: its kind, whether it is whole, and the text in it.

No reader meets a file that is cut off, or one that is no metadata.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from enum import Enum
from pathlib import Path

from msgflow.errors import TraceError
from msgflow.trace.regular_file import read_regular

FILE_NAME = "metadata"

DIRECTORY_HINT = "give the directory that `ros2 trace` or `lttng` wrote"
"""Hint for those who gave something that is no trace."""

_BYTE_ORDER_OF_MAGIC = {b"\x57\x1d\xd1\x75": "<", b"\x75\xd1\x1d\x57": ">"}
# Of a metadata packet: magic, uuid, checksum, content size and packet size in bits, then five
# bytes that say nothing useful (the version in them is 1.8 even for CTF 2).
_HEADER_SIZE = 37
_SIZES_OFFSET = 24
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


def text_of(directory: Path) -> tuple[MetadataKind, bytes]:
    """Return the kind and the text of the metadata of the trace in this directory."""
    content = content_of(directory)
    if not content:
        raise TraceError(
            f"the trace's `metadata` is empty, nothing of it was written yet — {directory}",
            hint="stop the recording (lttng stop), then copy it again",
        )
    order = _BYTE_ORDER_OF_MAGIC.get(content[:4])
    if order is not None:
        content = b"".join(_in_packets(content, order, directory))
    if content.startswith(_RECORD_SEPARATOR):
        return MetadataKind.JSON, content
    if order is not None or content.lstrip().startswith(_TSDL_BEGIN):
        return MetadataKind.TSDL, content
    raise TraceError(
        f"not a CTF trace, its `metadata` is something else — {directory}",
        hint=DIRECTORY_HINT,
    )


def _in_packets(content: bytes, order: str, directory: Path) -> Iterator[bytes]:
    """Yield the text of each packet; each has to follow the one before, up to the end."""
    offset = 0
    while offset < len(content):
        rest, bits = len(content) - offset, (0, 0)
        if rest >= _HEADER_SIZE:
            bits = struct.unpack_from(f"{order}II", content, offset + _SIZES_OFFSET)
        content_size, packet_size = bits[0] // 8, bits[1] // 8
        if not _HEADER_SIZE <= content_size <= packet_size <= rest:
            raise TraceError(
                f"the trace's `metadata` is damaged or cut off — {directory}",
                hint="copy it again from where it was recorded",
            )
        yield content[offset + _HEADER_SIZE : offset + content_size]
        offset += packet_size
