"""The last chunks of all hosts, and the windows over them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from msgflow.run.window import Window
from msgflow.watch.kept_chunk import KeptChunk, KeptTraces

# One takes up to two kilobytes of memory while it is analysed.
_MOST_EVENTS = 250_000


class History:
    """What is kept of a recording: the last chunks, and what lasts of those before.

    Windows end at multiples of a step. A window is closed once the newest time of all chunks passes
    its end by as much as something may be late: a chunk of another host, or the last message of a
    flow. As much of the time before a window is kept, for flows that began there.
    """

    def __init__(self, window_ns: int, step_ns: int, late_ns: int) -> None:
        self._window_ns = window_ns
        self._step_ns = step_ns
        self._late_ns = late_ns
        self._lasting: dict[Path, KeptChunk] = {}
        self._chunks: list[KeptChunk] = []
        # Up to when each source has recorded.
        self.ends_ns: dict[Path, int] = {}
        self._begin_ns = 0
        # The end of the last window that is closed; before the first one, where that begins.
        self.closed_ns = 0
        self._has_closed = False
        # Events that have come since the last window.
        self._further = 0

    @property
    def newest_ns(self) -> int:
        """The newest time of all sources; 0 before the first chunk."""
        return max(self.ends_ns.values(), default=0)

    def newest_without(self, sources: Collection[Path]) -> int:
        """Return the newest time of the other sources, or of all if there are no others."""
        ends = (end for source, end in self.ends_ns.items() if source not in sources)
        return max(ends, default=self.newest_ns)

    @property
    def last_event_ns(self) -> int:
        """Time of the last event of all."""
        return max(chunk.last_event_ns for chunk in self._chunks)

    def add(self, chunk: KeptChunk) -> int:
        """Add the next chunk of a source; return how many of its events are of closed windows."""
        self._further += chunk.times_ns.size
        self._chunks.append(chunk)
        self._chunks.sort(key=lambda each: each.end_ns)
        self.ends_ns[chunk.source] = max(chunk.end_ns, self.ends_ns.get(chunk.source, 0))
        if not self._has_closed:
            self._begin()
            return 0
        return int(np.count_nonzero(chunk.times_ns < self.closed_ns))

    def leave_out(self, source: Path) -> None:
        """Forget all of a source whose clock errs, as if it had never recorded.

        Nothing happens to the only source.
        """
        if not self.ends_ns.keys() - {source}:
            return
        self.ends_ns.pop(source, None)
        self._chunks = [chunk for chunk in self._chunks if chunk.source != source]
        if self.closed_ns > self.newest_ns:
            # Windows so far had its time.
            self._has_closed = False
            self._begin()

    def skip_old(self, *, earlier_ns: int = 0) -> list[Path]:
        """Let the first window be no longer than others, however much was recorded before it.

        Like `close` and `forget`, it returns the directories of the chunks that are forgotten.
        """
        if self._has_closed or (window := self.next_window(self.newest_ns)) is None:
            return []
        self.closed_ns = max(window.start_ns, window.end_ns - self._window_ns)
        return self.forget(Window(self.closed_ns, window.end_ns), earlier_ns=earlier_ns)

    def next_window(self, newest_ns: int, *, is_last: bool = False) -> Window | None:
        """Return the next window that can be closed; else None.

        It leaves out nothing since the last one: where steps were late it is longer.
        """
        if not self._chunks:
            return None
        # The step that the last moment is in counts as a whole: windows meet there as elsewhere.
        known_ns = newest_ns + self._step_ns if is_last else newest_ns - self._late_ns
        end_ns = known_ns // self._step_ns * self._step_ns
        if end_ns <= self.closed_ns:
            return None
        start_ns = min(end_ns - self._window_ns, self.closed_ns)
        return Window(max(start_ns, self._begin_ns), min(end_ns, newest_ns + 1))

    def is_full(self, newest_ns: int) -> bool:
        """Tell whether the next window has to be closed before more is added.

        Many chunks may wait. Together they would take any memory, so a window is longer than others
        only up to so many events.
        """
        window = self.next_window(newest_ns)
        return (
            self._has_closed
            and self._further >= _MOST_EVENTS
            and window is not None
            and window.end_ns - self.closed_ns >= self._window_ns
        )

    def close(self, window: Window, *, earlier_ns: int = 0) -> list[Path]:
        """Close a window: what comes of it from now on is late."""
        self.closed_ns = window.end_ns
        self._has_closed = True
        self._further = 0
        return self.forget(window, earlier_ns=earlier_ns)

    def traces(self, window: Window, *, earlier_ns: int = 0) -> KeptTraces:
        """Return what a window needs: itself, and what comes before and after."""
        needed = self._needed(window, earlier_ns)
        return KeptTraces([*self._lasting.values(), *self._lasting_without(needed)], needed)

    def paths(self, window: Window, *, earlier_ns: int = 0) -> list[Path]:
        """Return the directories of the chunks of `traces`."""
        return [chunk.path for chunk in self._needed(window, earlier_ns)]

    def forget(self, window: Window, *, earlier_ns: int = 0) -> list[Path]:
        """Forget what no window needs that comes after this one, but for what lasts."""
        needed = self._needed(window, earlier_ns)
        for lasting in self._lasting_without(needed):
            before = self._lasting.get(lasting.source)
            # To put many parts together in each step would take long.
            self._lasting[lasting.source] = (
                lasting if before is None else before.followed_by(lasting)
            )
        passed = [chunk.path for chunk in self._chunks if chunk not in needed]
        self._chunks = needed
        return passed

    def _begin(self) -> None:
        """Let windows begin with the chunks that there are."""
        begins = [chunk.begin_ns for chunk in self._chunks]
        self._begin_ns = self.closed_ns = min(begins, default=0)

    def _needed(self, window: Window, earlier_ns: int) -> list[KeptChunk]:
        reach = window.start_ns - self._late_ns - earlier_ns
        return [chunk for chunk in self._chunks if chunk.end_ns > reach]

    def _lasting_without(self, needed: Sequence[KeptChunk]) -> list[KeptChunk]:
        passed = (chunk.lasting() for chunk in self._chunks if chunk not in needed)
        return [lasting for lasting in passed if lasting is not None]
