"""LTTng's packet indexes (`index/*.idx`), a second witness of where packets lie."""

from __future__ import annotations

import os
import struct
from typing import TYPE_CHECKING, Final, NamedTuple

from msgflow.trace.regular_file import UnsuitableFileError, read_regular

if TYPE_CHECKING:
    from pathlib import Path

DIRECTORY: Final = "index"
"""Name of the directory beside the streams that has the indexes."""

_SUFFIX: Final = ".idx"
_MAGIC: Final = 0xC1F1DCC1
_HEADER: Final = struct.Struct(">IIII")
_ENTRY: Final = struct.Struct(">5Q")
_LONGEST_ENTRY: Final = 4096
_SHORTEST_LIMIT: Final = 1 << 20


class IndexEntry(NamedTuple):
    """A packet: offset in bytes, sizes in bits, clock values."""

    offset: int
    size_bits: int
    content_bits: int
    begin: int
    end: int


def path_of(stream_file: Path) -> Path:
    """Return the path of the index of a stream file, whether or not it exists."""
    return stream_file.parent / DIRECTORY / f"{stream_file.name}{_SUFFIX}"


def orphans(directory: Path) -> list[Path]:
    """List the indexes in a trace directory whose stream files are missing."""
    indexes = sorted((directory / DIRECTORY).glob(f"*{_SUFFIX}"))
    return [path for path in indexes if not os.path.lexists(directory / path.stem)]


def entries(stream_file: Path) -> dict[int, IndexEntry]:
    """Return the entries of a file's index, by offset; nothing if there is no valid index.

    Raises:
        UnsuitableFileError: the index is no regular file, or too long for this stream file.
    """
    try:
        # An entry is shorter than its packet.
        most = max(stream_file.stat().st_size, _SHORTEST_LIMIT)
        content = read_regular(path_of(stream_file), most)
    except UnsuitableFileError:
        raise
    except OSError:
        return {}
    if len(content) < _HEADER.size:
        return {}
    magic, _, _, entry_size = _HEADER.unpack_from(content)
    if magic != _MAGIC or not _ENTRY.size <= entry_size <= _LONGEST_ENTRY:
        return {}
    found = {}
    expected = 0
    for position in range(_HEADER.size, len(content) - entry_size + 1, entry_size):
        entry = IndexEntry(*_ENTRY.unpack_from(content, position))
        if entry.offset != expected or not 0 < entry.content_bits <= entry.size_bits:
            break
        found[entry.offset] = entry
        expected += entry.size_bits // 8
    return found
