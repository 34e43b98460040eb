"""Chunks of a recording: what LTTng leaves behind at each rotation."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import NamedTuple

from msgflow.errors import TraceError

_ARCHIVES = "archives"
# Begin, end, number; see "Session rotation" of lttng-rotate(1).
_NAME = re.compile(r"(?P<begin>\d{8}T\d{6}[+-]\d{4})-(?P<end>\d{8}T\d{6}[+-]\d{4})-(?P<number>\d+)")
_TIME = "%Y%m%dT%H%M%S%z"
# Seconds from one search for further recordings to the next, or more: a search is no longer part
# of the time than this.
_BETWEEN_SEARCHES = 1.0
# Rotations in a second, at most.
_MOST_A_SECOND = 20
_MOST_OF_TIME = 0.05


class _Found(NamedTuple):
    """What the name of a chunk says."""

    number: int
    begin: datetime
    end: datetime
    path: Path


class _Last(NamedTuple):
    """The last chunk of a source; a session that is created anew is another recording."""

    recording: int
    number: int
    end: datetime


@dataclass(frozen=True, order=True)
class Chunk:
    """A chunk that is finished: LTTng renames its directory when all of it is written."""

    number: int  # its place in the recording
    source: Path  # the directory whose `archives` it is in: of one session on one host
    path: Path

    @property
    def length_s(self) -> float:
        """From its begin to its end, in whole seconds; 0 if its name does not say it."""
        match = _NAME.fullmatch(self.path.name)
        return (_time(match["end"]) - _time(match["begin"])).total_seconds() if match else 0


class ChunkFinder:
    """Finds the finished chunks below a directory, of all hosts, each once."""

    def __init__(self, directory: Path, refuse: Callable[[TraceError], None]) -> None:
        self._directory = directory
        self._refuse = refuse
        self._refused: set[Path] = set()
        # The names that each `archives` had at the last look.
        self._names: dict[Path, set[str]] = {}
        self._last: dict[Path, _Last] = {}
        # Of each source, what has the form of a chunk and follows none, by number.
        self._odd: dict[Path, dict[int, _Found]] = {}
        self._next_search = 0.0

    def further(self, *, is_last: bool = False) -> list[Chunk]:
        """Return the chunks that have come since the last call, by number.

        Any program may make a directory of this form: what does not follow the last chunk counts as
        one when the next has come, or at the last look. Where a session was created anew in the
        directory of an earlier one, numbers begin again: all chunks of the earlier recording come
        first.
        """
        if time.monotonic() >= self._next_search:
            self._search()
        found = [pair for archives in list(self._names) for pair in self._of(archives, is_last)]
        return [chunk for _, chunk in sorted(found)]

    def _search(self) -> None:
        """Look for further recordings: there may be many old ones, so this is done seldom."""
        begin = time.monotonic()
        for folder, below, _ in os.walk(self._directory, onerror=self._fail):
            if os.path.basename(folder) == _ARCHIVES:
                self._names.setdefault(Path(folder), set())
                below.clear()
        end = time.monotonic()
        self._next_search = end + max(_BETWEEN_SEARCHES, (end - begin) / _MOST_OF_TIME)

    def _of(self, archives: Path, is_last: bool) -> Iterator[tuple[int, Chunk]]:
        """Yield the further chunks of a source, each with the number of its recording."""
        try:
            names = set(os.listdir(archives))
        except OSError as error:
            self._fail(error)
            # It may come back, with other chunks.
            del self._names[archives]
            self._last.pop(archives.parent, None)
            return
        found = [each for name in names - self._names[archives] if (each := _read(archives / name))]
        self._names[archives] = names
        source = archives.parent
        last = self._number(source)
        numbers = [each.number for each in found]
        # A clock that is set does not mix them up.
        is_by_number = len(set(numbers)) == len(numbers) and all(each > last for each in numbers)
        if is_by_number:
            found.sort(key=lambda each: each.number)
        else:
            found.sort(key=lambda each: (each.begin, each.number))
        odd = self._odd.setdefault(source, {})
        for each in found:
            number = each.number
            if number == self._number(source) + 1 and self._may_follow(source, each):
                yield from self._taken(source, each)
            elif number - 1 in odd:
                yield from self._taken(source, odd.pop(number - 1))
                yield from self._taken(source, each)
            else:
                odd[number] = each
        if is_last:
            now = datetime.now(timezone.utc)
            for each in sorted(odd.values(), key=lambda each: each.begin):
                if each.end <= now and self._may_follow(source, each):
                    yield from self._taken(source, each)
            odd.clear()

    def _number(self, source: Path) -> int:
        return self._last[source].number if source in self._last else -1

    def _taken(self, source: Path, found: _Found) -> Iterator[tuple[int, Chunk]]:
        recording = 0
        if source in self._last:
            last = self._last[source]
            # Where numbers begin again, so does the recording.
            recording = last.recording if found.number > last.number else last.recording + 1
        self._last[source] = _Last(recording, found.number, found.end)
        if os.access(found.path, os.R_OK | os.X_OK):
            yield recording, Chunk(found.number, source, found.path)
        elif os.path.lexists(found.path):
            self._fail(PermissionError(0, "permission denied", str(found.path.parent)))

    def _may_follow(self, source: Path, found: _Found) -> bool:
        """Tell whether there was time for the chunks that are missing before one."""
        if source not in self._last:
            return True
        last = self._last[source]
        missing = found.number
        if found.number > last.number:
            missing -= last.number + 1
        passed_s = (found.begin - last.end).total_seconds()
        # Names have whole seconds.
        return passed_s >= -1 and missing <= _MOST_A_SECOND * max(passed_s, 1)

    def _fail(self, error: OSError) -> None:
        # What has gone meanwhile is no fault.
        place = Path(error.filename)
        if isinstance(error, FileNotFoundError) or place in self._refused:
            return
        self._refused.add(place)
        self._refuse(
            TraceError(
                f"cannot read {place}: {(error.strerror or str(error)).lower()}",
                "run msgflow watch as the user that records, such as that of lttng-relayd",
            )
        )


def finished_chunks(directory: Path) -> list[Chunk]:
    """Return all finished chunks below a directory, of all hosts, by number."""

    def refuse(error: TraceError) -> None:
        raise error

    return ChunkFinder(directory, refuse).further(is_last=True)


def _read(path: Path) -> _Found | None:
    """Return what the name of a chunk says; None of what LTTng does not write."""
    match = _NAME.fullmatch(path.name)
    if match is None or path.is_symlink() or not path.is_dir():
        return None
    try:
        return _Found(int(match["number"]), _time(match["begin"]), _time(match["end"]), path)
    except ValueError:
        return None


def _time(text: str) -> datetime:
    return datetime.strptime(text, _TIME)
