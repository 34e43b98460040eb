"""Packet indexes of LTTng (`index/*.idx`): counters of lost events, which Babeltrace hides."""

from __future__ import annotations

import struct
from collections import Counter
from typing import TYPE_CHECKING, Any, Final

from msgflow.trace.regular_file import read_regular

if TYPE_CHECKING:
    from pathlib import Path

_MAGIC: Final = 0xC1F1DCC1
_HEADER: Final = struct.Struct(">IIII")
# Offset, packet size, content size, begin, end, discarded events, stream class; since 1.1 also
# stream instance and sequence number of the packet.
_ENTRY: Final = struct.Struct(">9Q")

Recording = tuple[Any, int, int]
"""Trace uuid (or path), stream class and stream instance: equal in all directories."""


class DiscardCounters:
    """The counters of lost events, which LTTng continues through the directories of a recording."""

    def __init__(self) -> None:
        self._counters: Counter[Recording] = Counter()

    def rise(self, recording: Recording, directory: Path, told: int | None) -> int | None:
        """Return how many events were lost before a packet; None where nothing tells it.

        Args:
            recording: what the counter counts for.
            directory: the trace of the packet.
            told: what Babeltrace tells, None for the first packet of a directory.
        """
        before = self._counters[recording]
        if told is None:
            counter = _first_counter(directory, *recording[1:])
            if counter is None:
                return None
            told = counter - before if counter >= before else counter
            before = counter - told
        self._counters[recording] = before + told
        return told


def _first_counter(directory: Path, class_id: int, instance_id: int) -> int | None:
    """Return the counter of the first packet of a stream; an index may be missing or cut off."""
    firsts = []
    for path in (directory / "index").glob("*.idx"):
        try:
            content = read_regular(path, None, _HEADER.size + _ENTRY.size)
            magic, _, _, entry_size = _HEADER.unpack_from(content)
            entry = _ENTRY.unpack_from(content, _HEADER.size)
        except (OSError, struct.error):
            continue
        _, _, _, begin, _, discarded, *stream, _ = entry
        is_index = magic == _MAGIC and entry_size >= _ENTRY.size
        if is_index and stream == [class_id, instance_id]:
            firsts.append((begin, discarded))
    return min(firsts)[1] if firsts else None
