"""Reads the chunks of a recording one after the other, and reports window after window."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from msgflow.clocks.clocks_file import ClockSync
from msgflow.errors import TraceError, UsageError
from msgflow.ingest.repeated_in_memory import database_in_memory, ingest_again, link_again
from msgflow.links.links_file import DeclaredLink, LinksFile
from msgflow.run.window import Window
from msgflow.sql.interrupt import interruptible
from msgflow.trace import Continuation
from msgflow.watch.alarm import Alarm
from msgflow.watch.chunk import Chunk
from msgflow.watch.flight_recorder import FlightRecorder
from msgflow.watch.history import History
from msgflow.watch.kept_chunk import KeptTraces, read_chunk
from msgflow.watch.learned_answers import LearnedAnswers, with_learned
from msgflow.watch.prometheus import Exporter
from msgflow.watch.silences import Silences
from msgflow.watch.window_database import WindowDatabase
from msgflow.watch.window_report import WindowReport, report_of

_RUN = "watch"
_SECOND_NS = 1_000_000_000
# Clocks are kept in step by less.
_LEAST_STEP_NS = 500_000_000


@dataclass(kw_only=True)
class Watcher:
    """What is known of a recording so far, and the windows over it."""

    window_ns: int
    step_ns: int  # a window is so far from the one before
    late_ns: int  # a window waits so long for what is late
    links: LinksFile | None
    clocks: ClockSync
    note: Callable[[str], None]  # gets sentences about what is wrong with the recording
    alarm: Alarm | None = None
    recorder: FlightRecorder | None = None  # keeps the chunks around a violation
    exporter: Exporter | None = None  # counts each moment once
    database: WindowDatabase | None = None  # gets each window, for pages
    has_node: bool = False  # this process has a node, which the windows leave out
    # Gets the directory of each chunk that no window needs any more.
    on_passed: Callable[[Path], None] | None = None

    def __post_init__(self) -> None:
        self.history = History(self.window_ns, self.step_ns, self.late_ns)
        self._earlier_ns = 0 if self.recorder is None else self.recorder.earlier_ns
        self._said: set[str] = set()
        # Since the last report.
        self._late_events = 0
        self._clock_offset_ns = self._last_clock_offset_ns = _clock_offset_ns()
        self._answers = LearnedAnswers()
        self._silences = Silences()
        # Keeps the violation of the last report, if it has one.
        self._keep: Callable[[], None] | None = None
        self._after = Continuation()
        self._con = database_in_memory()
        # Of the last chunk of each source.
        self._numbers: dict[Path, int] = {}

    def read(self, chunk: Chunk) -> None:
        """Read the next chunk of a host; what is wrong with it is noted, and the others go on."""
        before = self._numbers.get(chunk.source)
        self._numbers[chunk.source] = chunk.number
        if before is not None and chunk.number <= before:
            self.note(f"a new recording has begun in {chunk.source}: the view goes on with it")
        elif before is not None and chunk.number > before + 1:
            self.note(
                f"chunks are missing before number {chunk.number} of {chunk.source}:"
                f" {chunk.number - before - 1}"
            )
        try:
            kept = read_chunk(chunk, self._after, without_own=self.has_node)
        except TraceError as error:
            self.note(f"a chunk cannot be read: {error.message}")
            return
        if kept is None:
            return
        if kept.damages:
            first = kept.damages[0]
            self.note(f"{len(kept.damages)} damages in {chunk.path}, the first: {first.message}")
        late = self.history.add(kept)
        self._late_events += late
        if late:
            self._note_once(
                f"events of {chunk.source} come after their window was closed: a longer --late"
                " waits for them"
            )

    def skip_old(self) -> None:
        """Leave out what was recorded long before the first window."""
        self._pass(self.history.skip_old(earlier_ns=self._earlier_ns))

    def report(
        self, newest_ns: int, *, is_live: bool = False, is_last: bool = False
    ) -> WindowReport | None:
        """Close the next window, and return what it shows; None until there is one.

        `is_live` says that the recording goes on at this moment, `is_last` that nothing more comes.
        """
        window = self.history.next_window(newest_ns, is_last=is_last)
        if window is None:
            return None
        return interruptible(self._con, partial(self._report, window, newest_ns, is_live=is_live))

    def keep_violation(self) -> None:
        """Keep the chunks of the last report if it has a violation, once it has been told."""
        if self._keep is not None:
            self._keep()
        self._keep = None

    def close(self) -> None:
        """Free the memory of the database."""
        self._con.close()

    def _pass(self, paths: Sequence[Path]) -> None:
        if self.on_passed is not None:
            for path in paths:
                self.on_passed(path)

    def _ingest(self, traces: KeptTraces) -> tuple[LinksFile | None, str | None]:
        """Ingest what a window needs, without the links of nodes that are not there yet.

        It returns the links that are declared in it, and a file of those of them that were learned
        from earlier windows; None if there are none.
        """
        left: list[DeclaredLink] = []

        def leave_out(link: DeclaredLink, error: UsageError) -> None:
            left.append(link)
            self._note_once(f"a link is left out for now: {error.message}")

        ingest = partial(
            ingest_again, self._con, traces, _RUN, links=self.links, leave_out=leave_out
        )
        clocks = self.clocks
        try:
            ingest(clocks=clocks)
        except UsageError as error:
            if clocks.method != "file":
                raise
            # A host may come later.
            self._note_once(f"clocks are not corrected for now: {error.message}")
            clocks = ClockSync("none")
            ingest(clocks=clocks)
        learned = self._answers.doubted(self._con)
        links = self.links
        if learned is not None:
            both = with_learned(links, learned)
            try:
                link_again(self._con, links=both, clocks=clocks, leave_out=leave_out)
                links = both
            except UsageError as error:
                self._note_once(f"what earlier windows have shown is left out: {error.message}")
                learned = None
        if links is not None:
            links = replace(links, links=tuple(each for each in links.links if each not in left))
        return links, learned

    def _note_once(self, said: str) -> None:
        if said not in self._said:
            self.note(said)
        self._said.add(said)

    def _lag_s(self) -> float:
        """Return how old the last event is; the tracer knows nothing of a clock that was set."""
        offset_ns = _clock_offset_ns()
        step_ns = offset_ns - self._last_clock_offset_ns
        self._last_clock_offset_ns = offset_ns
        # What time servers correct bit by bit is no step.
        if abs(step_ns) > _LEAST_STEP_NS:
            self.note(
                f"the clock of this machine was set by {step_ns / _SECOND_NS:+.1f} s, or the"
                " machine slept: times of the tracer go on as before"
            )
        now_ns = time.monotonic_ns() + self._clock_offset_ns
        return (now_ns - self.history.last_event_ns) / _SECOND_NS

    def _report(self, window: Window, newest_ns: int, *, is_live: bool) -> WindowReport:
        history = self.history
        # What came after the window counts, too: an alarm must be early.
        judged = Window(window.start_ns, newest_ns + 1)
        traces = history.traces(judged)
        links, learned = self._ingest(traces)
        report = replace(
            report_of(self._con, window),
            late_events=self._late_events,
            stopped=self._silences.further(self._con),
        )
        self._late_events = 0
        if self.alarm is not None:
            found, rows = self.alarm.judge(self._con, judged, window.end_ns)
            report = replace(report, violations=found, judged=rows)
        if self.exporter is not None:
            self.exporter.count(self._con, Window(history.closed_ns, window.end_ns))
        if self.database is not None:
            self.database.offer(window.end_ns, traces, links)
        if (report.violations or report.stopped) and self.recorder is not None:
            kept = history.traces(judged, earlier_ns=self._earlier_ns)
            paths = history.paths(judged, earlier_ns=self._earlier_ns)
            self._keep = partial(self.recorder.keep, newest_ns, kept, paths, links, learned)
        if is_live:
            report = replace(report, lag_s=self._lag_s())
        if self.exporter is not None:
            self.exporter.show(report)
        self._pass(history.close(window, earlier_ns=self._earlier_ns))
        return report


def _clock_offset_ns() -> int:
    """Return the time of the system clock less that of the monotonic clock."""
    return time.time_ns() - time.monotonic_ns()
