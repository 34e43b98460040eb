"""Follows a recording: from chunk to chunk of a finished one, or as the chunks come."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

from msgflow.errors import TraceError
from msgflow.sql.interrupt import noted_interrupts
from msgflow.watch.arrivals import PATIENCE, Arrivals, by_arrival
from msgflow.watch.chunk import Chunk, ChunkFinder, finished_chunks
from msgflow.watch.watcher import Watcher
from msgflow.watch.window_report import WindowReport

# Seconds.
_BETWEEN_LOOKS = 0.1
_SECOND_NS = 1_000_000_000
# The view lags if its last event is older than so many steps.
_MOST_LAG = 4
_REMEDY = "clocks are in step (chrony) and its session is created anew"


def watch_finished(directory: Path, watcher: Watcher) -> Iterator[WindowReport]:
    """Watch a recording that has ended, from its first to its last chunk."""
    chunks = finished_chunks(directory)
    if not chunks:
        raise TraceError(
            f"there are no chunks of a rotated recording — {directory}",
            f"msgflow ingest {directory} reads what was recorded as a whole",
        )
    firsts = {chunk.source: chunk for chunk in reversed(chunks)}
    for chunk in firsts.values():
        watcher.read(chunk)
    left = [chunk for chunk in chunks if chunk not in firsts.values()]
    while left:
        # Nothing is late that is on the disk: windows wait for all sources that have more, also
        # for those whose first chunks are empty.
        ends = [watcher.history.ends_ns.get(chunk.source, 0) for chunk in left]
        if all(ends) and (report := watcher.report(min(ends))) is not None:
            yield report
            watcher.keep_violation()
        watcher.read(left.pop(0))
    yield from _last(watcher)


def watch_live(
    directory: Path,
    watcher: Watcher,
    *,
    step_ns: int,
    is_over: Callable[[], bool],
    note: Callable[[str], None],
) -> Iterator[WindowReport]:
    """Watch a recording while it grows; where there is no chunk yet, wait for one.

    If chunks come faster than they can be read, several of them become one step, and others wait on
    the disk: a step must not take any memory. `note` gets sentences about what goes wrong.
    """
    begin = time.monotonic()
    finder = ChunkFinder(directory, lambda error: note(f"{error.message}: {error.hint}"))
    arrivals = Arrivals(step_ns)
    # Those that have come and are not read, in this order.
    waiting: deque[Chunk] = deque()
    is_first = True
    is_last = are_apart = lags = False

    def known_ns() -> int:
        """Return up to when all is known: windows wait for sources that have more on the disk."""
        # A clock that is ahead must not make all that others record late.
        ahead = {
            source
            for source, seconds in arrivals.clocks_ahead_s().items()
            if seconds * _SECOND_NS > step_ns
        }
        history = watcher.history
        behind = {chunk.source for chunk in waiting}.difference(ahead) & history.ends_ns.keys()
        ends = [history.ends_ns[source] for source in behind]
        return min([history.newest_without(ahead), *ends])

    while True:
        # Asked first: what came until then is read.
        is_last = is_over() or is_last
        looked_s = time.monotonic()
        waiting.extend(by_arrival(finder.further(is_last=is_last)))
        # A backlog takes a while to read: Ctrl-C does not wait for all of it.
        with noted_interrupts() as interrupts:
            while waiting and not watcher.history.is_full(known_ns()):
                interrupts.check()
                chunk = waiting.popleft()
                if not arrivals.is_left_out(chunk):
                    watcher.read(chunk)
                    end_ns = watcher.history.ends_ns.get(chunk.source)
                    arrivals.add(chunk, end_ns, is_live=not is_first)
                    watcher.skip_old()
        is_first = False
        for source in arrivals.vanished(looked_s, {chunk.source for chunk in waiting}):
            note(f"no chunk comes any more from {source}")
        for source, seconds in arrivals.clocks_ahead_s().items():
            if abs(seconds) * _SECOND_NS > PATIENCE * step_ns:
                arrivals.leave_out(source)
                watcher.history.leave_out(source)
                note(f"{_wrong(source, seconds)}: going on without it, until {_REMEDY}")
            elif abs(seconds) * _SECOND_NS > step_ns and not are_apart:
                are_apart = True
                note(f"{_wrong(source, seconds)}: windows wait as long as --late, until {_REMEDY}")
        if is_last and not waiting:
            yield from _last(watcher)
            return
        report = watcher.report(known_ns(), is_live=True)
        if report is None:
            time.sleep(_BETWEEN_LOOKS)
            continue
        lag_s = report.lag_s or 0
        is_late = lag_s * _SECOND_NS > _MOST_LAG * step_ns
        if is_late and not lags:
            # A recording that was old when the view began does not mean that we are slow.
            said = (
                f"the view lags by {lag_s:.0f} s: steps are longer until it has caught up"
                if (lag_s - time.monotonic() + begin) * _SECOND_NS < _MOST_LAG * step_ns
                else f"the last event is {lag_s:.0f} s old: if the recording has ended, --once"
                " shows all of it"
            )
            note(said)
        lags = is_late
        yield report
        watcher.keep_violation()


def _wrong(source: Path, ahead_s: float) -> str:
    direction = "ahead of" if ahead_s > 0 else "behind"
    return f"the clock of {source} is {abs(ahead_s):.0f} s {direction} the others"


def _last(watcher: Watcher) -> Iterator[WindowReport]:
    if (report := watcher.report(watcher.history.newest_ns, is_last=True)) is not None:
        yield report
        watcher.keep_violation()
