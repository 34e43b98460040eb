"""The last chunks of all hosts, and the windows over them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.run.window import Window
from msgflow.watch.kept_traces import KeptTraces

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from msgflow.watch.kept_chunk import KeptChunk

# A window may be so much longer, and chunks so much shorter than a step: rotations are never on
# time. Parts of the whole.
_SLACK = 0.1
# No message is waited for longer than so many windows: what is kept has an end.
_MOST_WINDOWS = 2


class History:
    """What is kept of a recording: the last chunks, and what lasts of those before.

    *Borders* are the begin of all, and times up to which all hosts had recorded at a step. Windows
    reach from border to border, so that each moment belongs to a window once its last message can
    have arrived: at the next border, or later if messages have taken longer.

    Where messages take longer than a step, the window up to the last border is shown meanwhile, and
    a final one once in the length of a window.

    Attributes:
        final_ns: the end of the last final window; None before the first.
    """

    def __init__(self, window_ns: int, step_ns: int) -> None:
        """Start with nothing.

        Args:
            window_ns: length of a window.
            step_ns: least distance of borders.
        """
        self._window_ns = window_ns
        self._step_ns = step_ns
        self._lasting: dict[Path, KeptChunk] = {}
        self._chunks: list[KeptChunk] = []
        self._borders: list[int] = []
        self._ends: dict[Path, int] = {}
        self._last_end_ns = 0
        # Borders, with what the report at that time has shown.
        self._longest: list[tuple[int, int, int]] = []
        self.final_ns: int | None = None
        self._shown_ns = 0

    @property
    def is_empty(self) -> bool:
        """Whether there was no chunk yet."""
        return not self._chunks

    @property
    def complete_ns(self) -> int:
        """Time up to which all hosts have recorded; there must be a chunk."""
        return min(self._ends.values())

    @property
    def ends_ns(self) -> Mapping[Path, int]:
        """Up to when each source has recorded that is waited for."""
        return self._ends

    @property
    def border_ns(self) -> int:
        """The last border."""
        return self._borders[-1]

    @property
    def last_step(self) -> Window:
        """The time between the last two borders."""
        return Window(self._borders[-2], self._borders[-1])

    @property
    def last_event_ns(self) -> int:
        """Time of the last event of all."""
        return max(chunk.last_event_ns for chunk in self._chunks)

    @property
    def is_due(self) -> bool:
        """Whether a further border has come."""
        if not self._ends:
            return False
        return self.complete_ns - self._borders[-1] >= self._step_ns * (1 - _SLACK)

    def add(self, chunk: KeptChunk) -> None:
        """Add the next chunk of a host."""
        self._chunks.append(chunk)
        self._chunks.sort(key=lambda each: each.end_ns)
        if len(self._borders) < 2:
            self._borders = [min(each.begin_ns for each in self._chunks)]
        self._ends[chunk.source] = max(chunk.end_ns, self._ends.get(chunk.source, chunk.end_ns))
        self._last_end_ns = max(self._last_end_ns, chunk.end_ns)

    def go_on_without(self, source: Path) -> bool:
        """Wait for no more chunks of a source; a later chunk of it counts again.

        Returns:
            False if it is the only one.
        """
        # One whose chunks cannot be read has no end.
        if not self._ends.keys() - {source}:
            return False
        self._ends.pop(source, None)
        return True

    def leave_out(self, source: Path) -> None:
        """Forget all of a source whose clock errs, as if it had never recorded."""
        if not self.go_on_without(source):
            return
        self._chunks = [chunk for chunk in self._chunks if chunk.source != source]
        self._last_end_ns = max(self._ends.values())
        begin_ns = min((chunk.begin_ns for chunk in self._chunks), default=self._last_end_ns)
        if len(self._borders) < 2 or self._borders[-1] < begin_ns:
            # Borders and windows so far had its time.
            self._borders = [begin_ns]
            self.final_ns = None
            self._shown_ns = 0

    @property
    def behind_ns(self) -> int:
        """How long something may come that belongs to a window, after its end."""
        return max((flow_ns for _, flow_ns, _ in self._longest), default=0)

    @property
    def before_ns(self) -> int:
        """How much earlier something may have begun that belongs to a window."""
        return max((max(flow_ns, wait_ns) for _, flow_ns, wait_ns in self._longest), default=0)

    def note_longest(self, flow_ns: int, wait_ns: int) -> None:
        """Note what a report has shown. It counts for two windows, and as two windows at most.

        Args:
            flow_ns: how long a message or a flow was on the way at most.
            wait_ns: how long a node kept data at most.
        """
        most_ns = _MOST_WINDOWS * self._window_ns
        border_ns = self._borders[-1]
        self._longest = [each for each in self._longest if each[0] > border_ns - most_ns]
        self._longest.append((border_ns, min(flow_ns, most_ns), min(wait_ns, most_ns)))

    def add_border(self, *, is_last: bool = False) -> None:
        """Make a border of the time that all hosts have reached, or of the end of all if it is."""
        end_ns = self._last_end_ns + 1 if is_last else self.complete_ns
        if end_ns > self._borders[-1]:
            self._borders.append(end_ns)

    def newest_window(self) -> Window:
        """Return the window up to the last border, whose last messages may be on the way."""
        return Window(self._start_of(self._borders[-1]), self._borders[-1])

    def next_window(self, *, is_live: bool, is_last: bool = False) -> tuple[Window, bool] | None:
        """Return the next window to show, and whether it may be final; None until there is one.

        Args:
            is_live: a window that is not final counts, too: somebody looks at the screen.
            is_last: nothing more comes.
        """
        final = self.final_window(is_last=is_last)
        if not is_live or is_last:
            return None if final is None else (final, True)
        if final is not None and self._is_timely(final):
            return final, True
        # The window up to the border before the last could be final, but messages take longer.
        if len(self._borders) < 3 or self._borders[-1] <= self._shown_ns:
            return None
        return self.newest_window(), False

    def final_window(self, *, is_last: bool = False) -> Window | None:
        """Return the window of which all is known; None if there is no further one.

        Args:
            is_last: nothing more comes.
        """
        if not self._borders:
            return None
        ends = self._borders[1:] if is_last else self._borders[1:-1]
        known = [end for end in ends if is_last or self._is_over(end)]
        if not known or (self.final_ns is not None and known[-1] <= self.final_ns):
            return None
        return self._window_to(known[-1])

    def is_over(self, window: Window) -> bool:
        """Whether nothing more can come of a window."""
        return self._is_over(window.end_ns)

    def note_shown(self, window: Window, *, is_final: bool) -> None:
        """Note that a window has been shown: until the next border, no other one is."""
        self._shown_ns = self._borders[-1]
        if is_final:
            self.final_ns = window.end_ns

    def judged_window(self, window: Window) -> Window:
        """Return a window to show with all that is not final behind and before it."""
        start_ns = window.start_ns
        if self.final_ns is not None:
            start_ns = min(start_ns, self.final_ns)
        return Window(start_ns, self._borders[-1])

    def traces(self, window: Window, *, earlier_ns: int = 0) -> KeptTraces:
        """Return what a window needs: itself, and what comes before and after.

        Args:
            window: the window.
            earlier_ns: how much more of what came before to return.
        """
        needed = self._needed(window, earlier_ns)
        return KeptTraces([*self._lasting.values(), *self._lasting_without(needed)], needed)

    def paths(self, window: Window, *, earlier_ns: int = 0) -> list[Path]:
        """Return the directories of the chunks of `traces`."""
        return [chunk.path for chunk in self._needed(window, earlier_ns)]

    def forget(self, window: Window, *, earlier_ns: int = 0) -> list[Path]:
        """Forget what no window needs that comes after this one, but for what lasts.

        Args:
            window: the window.
            earlier_ns: how much of what came before is kept all the same.

        Returns:
            The directories of the chunks that are forgotten.
        """
        needed = self._needed(window, earlier_ns)
        for lasting in self._lasting_without(needed):
            before = self._lasting.get(lasting.source)
            # To put many parts together in each step would take long.
            self._lasting[lasting.source] = (
                lasting if before is None else before.followed_by(lasting)
            )
        passed = [chunk.path for chunk in self._chunks if chunk not in needed]
        self._chunks = needed
        reach = self._reach(window)
        self._borders = [border for border in self._borders if border >= reach]
        return passed

    def _is_over(self, end_ns: int) -> bool:
        return end_ns <= self._borders[-1] - self.behind_ns

    def _is_timely(self, final: Window) -> bool:
        if final.end_ns == self._borders[-2] or self.final_ns is None:
            return True
        return final.end_ns - self.final_ns >= self._window_ns * (1 - _SLACK)

    def _start_of(self, end_ns: int) -> int:
        """Return where the window that ends at a border begins: at a border, too."""
        before = [border for border in self._borders if border < end_ns]
        reached = [b for b in before if b >= end_ns - self._window_ns * (1 + _SLACK)]
        return reached[0] if reached else before[-1]

    def _window_to(self, end_ns: int) -> Window:
        """Return the window that ends at a border, and leaves out nothing since the last one."""
        start_ns = self._start_of(end_ns)
        # Windows as short as steps overlap in nothing.
        if self.final_ns is not None and (
            start_ns > self.final_ns or self._window_ns <= self._step_ns
        ):
            start_ns = self.final_ns
        return Window(start_ns, end_ns)

    def _reach(self, window: Window) -> int:
        """Return the last border that is long enough before a window."""
        before = [b for b in self._borders if b < window.start_ns]
        known = [b for b in before if b <= window.start_ns - self.before_ns]
        return max(known, default=0)

    def _needed(self, window: Window, earlier_ns: int) -> list[KeptChunk]:
        reach = self._reach(window) - earlier_ns
        return [chunk for chunk in self._chunks if chunk.end_ns > reach]

    def _lasting_without(self, needed: Sequence[KeptChunk]) -> list[KeptChunk]:
        """Return what lasts of the chunks that are not needed."""
        passed = (chunk.lasting() for chunk in self._chunks if chunk not in needed)
        return [lasting for lasting in passed if lasting is not None]
