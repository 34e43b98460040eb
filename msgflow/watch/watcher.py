"""Reads the chunks of a recording one after the other, and reports window after window."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from msgflow.errors import TraceError
from msgflow.ingest.memory import ingested_in_memory
from msgflow.trace import Continuation
from msgflow.watch.chunk import finished_chunks
from msgflow.watch.history import History
from msgflow.watch.kept_chunk import read_chunk
from msgflow.watch.window_report import report_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from msgflow.clocks import ClockSync
    from msgflow.links import LinksFile
    from msgflow.run.window import Window
    from msgflow.watch.chunk import Chunk
    from msgflow.watch.window_report import WindowReport

_RUN = "watch"


class Watcher:
    """What is known of a recording so far, and the windows over it."""

    def __init__(
        self,
        *,
        window_ns: int,
        step_ns: int,
        links: LinksFile | None,
        clocks: ClockSync,
        note: Callable[[str], None],
    ) -> None:
        """Start before the first chunk.

        Args:
            window_ns: length of a window.
            step_ns: how far a window is from the one before.
            links: indirect links to declare.
            clocks: how clocks of several hosts are brought together.
            note: gets sentences about what is wrong with the recording.
        """
        self.history = History(window_ns, step_ns)
        self._links = links
        self._clocks = clocks
        self._note = note
        self._after = Continuation()
        self._numbers: dict[Path, int] = {}

    def read(self, chunk: Chunk) -> None:
        """Read the next chunk of a host; what is wrong with it is noted, and the others go on."""
        before = self._numbers.get(chunk.source)
        self._numbers[chunk.source] = chunk.number
        if before is not None and chunk.number > before + 1:
            self._note(
                f"{chunk.number - before - 1} chunks are missing before number {chunk.number}"
                f" of {chunk.source}"
            )
        try:
            kept = read_chunk(chunk, self._after)
        except TraceError as error:
            self._note(f"a chunk cannot be read: {error.message}")
            return
        if kept is None:
            return
        if kept.damages:
            first = kept.damages[0]
            self._note(f"{len(kept.damages)} damages in {chunk.path}, the first: {first.message}")
        self.history.add(kept)

    def final_report(self, *, is_live: bool, is_last: bool = False) -> WindowReport | None:
        """Return the next window of which all is known; None if there is none yet.

        Args:
            is_live: the recording goes on at this moment.
            is_last: nothing more comes.
        """
        window = self.history.final_window(is_last=is_last)
        if window is None:
            return None
        report = self._report(window, is_final=True, is_live=is_live)
        self.history.final_ns = window.end_ns
        self.history.forget(window)
        return report

    def _report(self, window: Window, *, is_final: bool, is_live: bool) -> WindowReport:
        traces = self.history.traces(window)
        with ingested_in_memory(traces, _RUN, links=self._links, clocks=self._clocks) as con:
            lag_s = (time.time_ns() - self.history.last_event_ns) / 1e9 if is_live else None
            report = report_of(con, window, is_final=is_final, lag_s=lag_s)
        self.history.longest_ns = max(self.history.longest_ns, report.longest_ns)
        return report


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
        # A host whose chunks begin with a higher number is waited for.
        if chunk.source not in left:
            watcher.history.go_on_without(chunk.source)
        if watcher.history.is_due:
            watcher.history.add_border()
            if (report := watcher.final_report(is_live=False)) is not None:
                yield report
    watcher.history.add_border(is_last=True)
    if (report := watcher.final_report(is_live=False, is_last=True)) is not None:
        yield report
