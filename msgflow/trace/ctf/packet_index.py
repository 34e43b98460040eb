"""LTTng's packet indexes (`index/*.idx`): where packets lie, and counters of lost events."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from msgflow.trace.regular_file import UnsuitableFileError, read_regular

DIRECTORY: Final = "index"
"""Name of the directory beside the streams that has the indexes."""

_SUFFIX: Final = ".idx"
_MAGIC: Final = 0xC1F1DCC1
_HEADER: Final = struct.Struct(">IIII")
_WORD: Final = 8
_LEAST_FIELDS: Final = 5
_LONGEST_ENTRY: Final = 4096
_SHORTEST_LIMIT: Final = 1 << 20


class IndexEntry(NamedTuple):
    """A packet: offset in bytes, sizes in bits, clock values.

    Old indexes lack the last fields.
    """

    offset: int
    size_bits: int
    content_bits: int
    begin: int
    end: int
    discarded: int | None = None
    class_id: int | None = None
    instance_id: int | None = None
    sequence: int | None = None


def path_of(stream_file: Path) -> Path:
    """Return the path of the index of a stream file, whether or not it exists."""
    return stream_file.parent / DIRECTORY / f"{stream_file.name}{_SUFFIX}"


def orphans(directory: Path) -> list[Path]:
    """List the indexes in a trace directory whose stream files are missing."""
    return [path for path in _indexes(directory) if not os.path.lexists(directory / path.stem)]


def entries(stream_file: Path) -> dict[int, IndexEntry]:
    """Return the entries of a file's index, by offset; nothing if there is no valid index."""
    try:
        # An entry is shorter than its packet.
        most = max(stream_file.stat().st_size, _SHORTEST_LIMIT)
        content = read_regular(path_of(stream_file), most)
    except UnsuitableFileError:
        raise
    except OSError:
        return {}
    found = {}
    expected = 0
    for entry in _entries(content):
        if entry.offset != expected or not 0 < entry.content_bits <= entry.size_bits:
            break
        found[entry.offset] = entry
        expected += entry.size_bits // 8
    return found


def written(index: Path) -> tuple[int, int]:
    """Return the bytes of all packets in an index, without what fills them up, and its losses.

    The losses are events that the stream had lost up to its latest packet. Both are 0 if the index
    is damaged; it may still grow.
    """
    try:
        found = list(_entries(read_regular(index, None)))
    except OSError:
        found = []
    lost = found[-1].discarded if found else 0
    return sum(entry.content_bits for entry in found) // 8, lost or 0


def first_counter(directory: Path, class_id: int, instance_id: int) -> int | None:
    """Return how many events a stream had lost up to the end of its first packet.

    None: the index is missing or cut off.
    """
    firsts = []
    for path in _indexes(directory):
        try:
            content = read_regular(path, None, _HEADER.size + _LONGEST_ENTRY)
        except OSError:
            continue
        entry = next(_entries(content), None)
        if entry is not None and entry[6:8] == (class_id, instance_id):
            firsts.append((entry.begin, entry.discarded))
    return min(firsts)[1] if firsts else None


def _indexes(directory: Path) -> list[Path]:
    return sorted((directory / DIRECTORY).glob(f"*{_SUFFIX}"))


def _entries(content: bytes) -> Iterator[IndexEntry]:
    """Yield the entries of an index; none if its header is damaged."""
    if len(content) < _HEADER.size:
        return
    magic, _, _, size = _HEADER.unpack_from(content)
    if magic != _MAGIC or not _LEAST_FIELDS * _WORD <= size <= _LONGEST_ENTRY:
        return
    fields = struct.Struct(f">{min(size // _WORD, len(IndexEntry._fields))}Q")
    for position in range(_HEADER.size, len(content) - size + 1, size):
        yield IndexEntry(*fields.unpack_from(content, position))
