"""When chunks came, on the clock of this machine: which source vanished, and whose clock errs."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

from msgflow.watch.chunk import Chunk

_SECOND_NS = 1_000_000_000
# A source without a chunk for so many steps, or so many times the length of its last chunk, has
# vanished. One whose clock errs by so many steps is left out.
PATIENCE = 5
# A chunk may come late; the earliest of so many tells the clock of its host.
_LEAST_CHUNKS = 3


@dataclass
class _Source:
    """What is known of a source."""

    number: int  # of its last chunk
    came_s: float  # when that came [s, monotonic]
    length_s: float  # of that chunk
    live_chunks: int = 0  # chunks that came while we looked
    ahead_ns: int | None = None  # by how much its clock is ahead of ours, at least
    has_vanished: bool = False
    is_left_out: bool = False


class Arrivals:
    """The sources of the chunks that have come so far."""

    def __init__(self, step_ns: int) -> None:
        """Start before the first chunk.

        Chunks come at most once every `step_ns`.
        """
        self._step_ns = step_ns
        self._sources: dict[Path, _Source] = {}

    def is_left_out(self, chunk: Chunk) -> bool:
        """Tell whether the clock of a chunk errs: until its session is created anew."""
        source = self._sources.get(chunk.source)
        if source is not None and chunk.number <= source.number:
            del self._sources[chunk.source]
            return False
        return source is not None and source.is_left_out

    def add(self, chunk: Chunk, end_ns: int | None, *, is_live: bool) -> None:
        """Add a chunk that was read.

        Its source has recorded up to `end_ns` by its own clock; None means nothing yet. `is_live`
        says that it came while we looked: only then is it known when it came.
        """
        age_s = _age_s(chunk.path)
        source = self._sources.setdefault(chunk.source, _Source(chunk.number, 0, 0))
        source.number = chunk.number
        source.came_s = time.monotonic() - age_s
        source.length_s = chunk.length_s
        source.has_vanished = False
        if is_live and end_ns is not None:
            ahead_ns = end_ns - time.time_ns() + round(age_s * _SECOND_NS)
            source.live_chunks += 1
            source.ahead_ns = max(ahead_ns, source.ahead_ns or ahead_ns)

    def vanished(self, looked_s: float, waiting: Collection[Path] = ()) -> list[Path]:
        """Return the sources whose next chunk is overdue, each once until a chunk comes again.

        We looked for chunks at `looked_s`, in seconds of the monotonic clock: reading them takes
        time. Those of `waiting` have come, and are not read.
        """
        found = []
        for path, source in self._sources.items():
            usual_s = max(self._step_ns / _SECOND_NS, source.length_s)
            is_late = looked_s - source.came_s > PATIENCE * usual_s
            is_silent = is_late and path not in waiting
            if is_silent and not (source.has_vanished or source.is_left_out):
                source.has_vanished = True
                found.append(path)
        return found

    def clocks_ahead_s(self) -> dict[Path, float]:
        """Return by how many seconds the clocks of sources are ahead of the right one, if known.

        The right one is that with which most others are in step; else the one nearest to ours.
        """
        known = {
            path: source.ahead_ns
            for path, source in self._sources.items()
            if source.ahead_ns is not None
            and source.live_chunks >= _LEAST_CHUNKS
            and not (source.has_vanished or source.is_left_out)
        }

        def trust(ahead_ns: int) -> tuple[int, int]:
            in_step = [abs(other - ahead_ns) <= self._step_ns for other in known.values()]
            return sum(in_step), -abs(ahead_ns)

        right_ns = max(known.values(), key=trust, default=0)
        return {path: (ahead - right_ns) / _SECOND_NS for path, ahead in known.items()}

    def leave_out(self, path: Path) -> None:
        """Leave out a source from now on."""
        self._sources[path].is_left_out = True


def by_arrival(chunks: Iterable[Chunk]) -> list[Chunk]:
    """Return chunks of several sources as they came; those of one source in their order."""
    ages_s: dict[Path, float] = {}
    keyed = []
    for chunk in chunks:
        age_s = _age_s(chunk.path)
        ages_s[chunk.source] = min(age_s, ages_s.get(chunk.source, age_s))
        keyed.append((-ages_s[chunk.source], chunk))
    return [chunk for _, chunk in sorted(keyed, key=lambda pair: pair[0])]


def _age_s(path: Path) -> float:
    """Return for how long a chunk has been finished: LTTng renames it then."""
    try:
        return max(time.time() - path.stat().st_ctime, 0)
    except OSError:
        # It is gone already.
        return 0
