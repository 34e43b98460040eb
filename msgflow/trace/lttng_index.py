"""LTTng's packet indexes (`index/*.idx`), for what Babeltrace reads there and does not tell."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_MAGIC: Final = 0xC1F1DCC1
_HEADER: Final = struct.Struct(">IIII")
# Offset, packet size, content size, begin, end, discarded events, stream class; since 1.1 also
# stream instance and sequence number of the packet.
_ENTRY: Final = struct.Struct(">9Q")


def first_discard_counters(directory: Path) -> dict[tuple[int, int], int]:
    """Return (stream class, stream instance) to the counter of lost events in its first packet.

    Streams without a usable index are absent: an index may be missing, old or cut off.
    """
    counters: dict[tuple[int, int], tuple[int, int]] = {}
    for path in sorted((directory / "index").glob("*.idx")):
        for begin, discarded, class_id, instance_id in _first_entry(path):
            earliest = counters.get((class_id, instance_id))
            if earliest is None or begin < earliest[0]:
                counters[class_id, instance_id] = (begin, discarded)
    return {stream: discarded for stream, (_, discarded) in counters.items()}


def _first_entry(path: Path) -> Iterator[tuple[int, int, int, int]]:
    try:
        with path.open("rb") as file:
            content = file.read(_HEADER.size + _ENTRY.size)
    except OSError:
        return
    if len(content) < _HEADER.size + _ENTRY.size:
        return
    magic, _, _, entry_size = _HEADER.unpack_from(content)
    if magic != _MAGIC or entry_size < _ENTRY.size:
        return
    _, _, _, begin, _, discarded, class_id, instance_id, _ = _ENTRY.unpack_from(
        content, _HEADER.size
    )
    yield begin, discarded, class_id, instance_id
