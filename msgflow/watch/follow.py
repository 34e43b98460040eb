"""Follows a recording: from chunk to chunk of a finished one, or as the chunks come."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from msgflow.errors import TraceError
from msgflow.watch.chunk import finished_chunks

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from msgflow.watch.watcher import Watcher
    from msgflow.watch.window_report import WindowReport

# Seconds.
_BETWEEN_LOOKS = 0.1
_SECOND_NS = 1_000_000_000
# A host without a chunk for so many steps is not waited for any more.
_PATIENCE = 5
# The view lags if its last event is older than so many steps.
_MOST_LAG = 4


def watch_finished(directory: Path, watcher: Watcher) -> Iterator[WindowReport]:
    """Watch a recording that has ended, from its first to its last chunk.

    Raises:
        TraceError: there is no chunk.
    """
    chunks = finished_chunks(directory)
    if not chunks:
        raise TraceError(
            f"there are no chunks of a rotated recording — {directory}",
            f"msgflow ingest {directory} reads what was recorded as a whole",
        )
    left = [chunk.source for chunk in chunks]
    for chunk in chunks:
        watcher.read(chunk)
        left.remove(chunk.source)
        if chunk.source not in left:
            watcher.history.go_on_without(chunk.source)
        watcher.go_on()
        if (report := watcher.report(is_live=False)) is not None:
            yield report
            watcher.keep_violation()
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

    If chunks come faster than they can be read, several of them become one step.

    Args:
        directory: of a session, or above several.
        watcher: reads it.
        step_ns: how often to report at most.
        is_over: tells whether no further chunk comes.
        note: gets sentences about what goes wrong.
    """
    begin = time.monotonic()
    lags = False
    while True:
        # Asked first: what came until then is read.
        is_last = is_over()
        for chunk in finished_chunks(directory, watcher.numbers):
            watcher.read(chunk)
            watcher.go_on()
        for source in watcher.history.behind(_PATIENCE * step_ns):
            note(f"no chunk comes any more from {source}: going on without it")
            watcher.history.go_on_without(source)
            watcher.go_on()
        if is_last:
            yield from _last(watcher)
            return
        if (report := watcher.report(is_live=True)) is None:
            time.sleep(_BETWEEN_LOOKS)
            continue
        lag_s = report.lag_s or 0
        is_late = lag_s * _SECOND_NS > _MOST_LAG * step_ns
        if is_late and not lags:
            # What is older than the view itself has another cause.
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


def _last(watcher: Watcher) -> Iterator[WindowReport]:
    if watcher.history.is_empty:
        return
    watcher.history.add_border(is_last=True)
    if (report := watcher.report(is_live=False, is_last=True)) is not None:
        yield report
        watcher.keep_violation()
