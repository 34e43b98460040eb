"""Chunks of a recording: what LTTng leaves behind at each rotation."""

from __future__ import annotations

import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_ARCHIVES = "archives"
# Begin, end, number; see "Session rotation" of lttng-rotate(1).
_NAME = re.compile(r"\d{8}T\d{6}[+-]\d{4}-(?P<end>\d{8}T\d{6})[+-]\d{4}-(?P<number>\d+)")


@dataclass(frozen=True, order=True)
class Chunk:
    """A chunk that is finished: LTTng renames its directory when all of it is written.

    Attributes:
        number: its place in the recording.
        source: the directory whose `archives` it is in: of one session on one host.
        path: of the chunk.
    """

    number: int
    source: Path
    path: Path


def finished_chunks(directory: Path, after: Mapping[Path, int] | None = None) -> list[Chunk]:
    """Return the finished chunks below a directory, of all hosts, by number.

    Args:
        directory: of a session, or above several, such as that of lttng-relayd.
        after: source -> number of the last chunk that is left out, with all before it.
    """
    last = after or {}
    return sorted(
        chunk
        for chunk in _chunks(directory)
        if chunk.source not in last or chunk.number > last[chunk.source]
    )


def remove_chunk(path: Path) -> None:
    """Remove a chunk from the disk; its session goes on."""
    shutil.rmtree(path, ignore_errors=True)


def _chunks(directory: Path) -> Iterator[Chunk]:
    for folder, below, _ in os.walk(directory):
        if os.path.basename(folder) == _ARCHIVES:
            for name in below:
                if match := _NAME.fullmatch(name):
                    path = Path(folder)
                    yield Chunk(int(match["number"]), path.parent, path / name)
            below.clear()
