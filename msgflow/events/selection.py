"""Selection of events by name and time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from fnmatch import fnmatchcase
from itertools import groupby
from operator import attrgetter
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc

from msgflow.errors import UsageError
from msgflow.run.choice import Run
from msgflow.run.slice import Slice
from msgflow.run.window import WHOLE
from msgflow.trace import PACKET, EventBatch
from msgflow.trace.columns import COMMON_SCHEMA

if TYPE_CHECKING:
    from msgflow.trace import Progress, TraceSet

BATCH_ROWS = 20_000
"""Rows of a batch at most: few, so that the first lines appear soon."""

_NOTHING = pa.schema([])
# By position: a payload may have a field of the same name.
_TIME = COMMON_SCHEMA.get_field_index("ts_ns")


class Selection:
    """The events of a set of traces with certain names, or all, from a start to before an end.

    Attributes:
        traces: the set.
        lost_event_count: events that the tracer lost, of any name, as far as they have been read.
    """

    def __init__(
        self,
        traces: TraceSet,
        patterns: Sequence[str] = (),
        start: str | int | None = None,
        end: str | int | None = None,
    ) -> None:
        self.traces = traces
        self.lost_event_count = 0
        for trace in traces.traces:
            if not (trace.has_time or start is end is None):
                raise UsageError(
                    f"the events have no time stamps — {trace.path}", "leave out --start and --end"
                )
        begins = [info.begin_ns for info in traces.traces if info.begin_ns is not None]
        whole = Run(0, "", min(begins, default=None))
        self._window = Slice(start=start, end=end).window([whole])
        self._names = _matching(patterns, {n for t in traces.traces for n in t.event_names})

    def rounds(
        self, progress: Callable[[Progress], None] | None = None
    ) -> Iterator[list[EventBatch]]:
        """Yield the events with all their fields; those of a list precede those of the next."""
        return self._read(dict.fromkeys(self._names), progress)

    def counts(self) -> dict[str, int]:
        """Count the events by name, only those that occur; the most frequent first."""
        counts: Counter[str] = Counter()
        if self._window == WHOLE:
            for _ in self._read({}, None):
                pass
            for (_, name), count in self.traces.event_counts.items():
                if name in self._names:
                    counts[name] += count
        else:
            for events in self._read(dict.fromkeys(self._names, _NOTHING), None):
                for item in events:
                    counts[item.name] += item.batch.num_rows
        return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))

    def _read(
        self, wanted: dict[str, pa.Schema | None], progress: Callable[[Progress], None] | None
    ) -> Iterator[list[EventBatch]]:
        self.lost_event_count = 0
        batches = self.traces.batches(wanted, progress=progress, batch_rows=BATCH_ROWS)
        for _, items in groupby(batches, key=attrgetter("round")):
            events = []
            for item in items:
                if item.name == PACKET:
                    lost = pc.sum(item.batch.column("discarded_event_count")).as_py()
                    self.lost_event_count += lost or 0
                else:
                    events.append(item)
            begins = [item.batch.column(_TIME)[0].as_py() for item in events]
            if begins and min(begins) >= self._window.end_ns:
                return
            events = [self._within_window(item) for item in events]
            events = [item for item in events if item.batch.num_rows]
            if events:
                yield events

    def _within_window(self, item: EventBatch) -> EventBatch:
        times = item.batch.column(_TIME)
        first, last = times[0].as_py(), times[-1].as_py()
        start_ns, end_ns = self._window.start_ns, self._window.end_ns
        if start_ns <= first and last < end_ns:
            return item
        inside = pc.and_(pc.greater_equal(times, start_ns), pc.less(times, end_ns))
        return EventBatch(item.name, item.batch.filter(inside), item.round)


def _matching(patterns: Sequence[str], names: set[str]) -> list[str]:
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise UsageError(
                f"no event of the trace has such a name — {pattern}",
                "msgflow events TRACE --count lists the names; quote a pattern: --event 'ros2:*'",
            )
    return sorted(
        name
        for name in names
        if not patterns or any(fnmatchcase(name, pattern) for pattern in patterns)
    )
