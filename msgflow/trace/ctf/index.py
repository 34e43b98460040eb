"""LTTng's packet indexes (`index/*.idx`), a second witness of where packets lie."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from pathlib import Path

_MAGIC: Final = 0xC1F1DCC1
_HEADER: Final = struct.Struct(">IIII")
_ENTRY: Final = struct.Struct(">5Q")
_LONGEST_ENTRY: Final = 4096


class IndexEntry(NamedTuple):
    """A packet: offset in bytes, sizes in bits, clock values."""

    offset: int
    size_bits: int
    content_bits: int
    begin: int
    end: int


def entries(stream_file: Path) -> dict[int, IndexEntry]:
    """Return what the index of this file says, by offset; nothing if it is missing or no index."""
    path = stream_file.parent / "index" / f"{stream_file.name}.idx"
    try:
        content = path.read_bytes()
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
