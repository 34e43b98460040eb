"""Sets of traces: what every reader of them does, one iteration at a time."""

from __future__ import annotations

import weakref
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator, Mapping
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.trace.archive import Unpacked
from msgflow.trace.model import Damage, EventBatch, Progress, TraceInfo

if TYPE_CHECKING:
    import pyarrow as pa

DEFAULT_BATCH_ROWS = 65_536

Wanted = Mapping[str, "pa.Schema | None"] | None
Batches = Generator[EventBatch, None, None]
Report = Callable[[Progress], None]
"""What a reader calls now and then to say how far it has come."""


class TraceSet(ABC):
    """Traces opened together, read as one sequence of events in time order.

    A context manager; closing it ends an iteration that is under way.
    """

    traces: tuple[TraceInfo, ...]  # what each trace declares, in order of path

    def __init__(self, unpacked: Unpacked) -> None:
        """Take over the archives that were unpacked for the traces."""
        # (trace index, event name) to the number of events read, wanted or not; only events that
        # occur. Complete after `batches` has ended.
        self.event_counts: Mapping[tuple[int, str], int] = {}
        # Packets skipped because another trace of the set holds them.
        self.duplicate_packet_count = 0
        # Trace index to the packets skipped because that trace holds them twice, such as those of a
        # stream file copied beside itself.
        self.repeated_packet_counts: Mapping[int, int] = {}
        # What is damaged and was left out or read as far as possible. Complete after `batches` has
        # ended.
        self.damages: list[Damage] = []
        self.unpacked = unpacked  # until the set is closed
        # Weak, so that an iteration which its consumer has dropped is over.
        self._running: weakref.ref[Batches] | None = None
        self._closed = False

    def batches(
        self,
        wanted: Wanted = None,
        *,
        progress: Report | None = None,
        batch_rows: int = DEFAULT_BATCH_ROWS,
    ) -> Iterator[EventBatch]:
        """Read everything once; may be called again, which reads again from the start.

        The batches of one name come in order of `event_id`, those of all names in rounds: see
        `EventBatch.round`. Memory stays bounded by `batch_rows`, whatever the size of the traces.

        `wanted` has the payload columns to deliver by name of event, None for all its fields; None:
        all events with all fields. A column is filled from the field of its name, else of a name in
        its metadata `aliases` (comma separated), else it is NULL. `progress` is called now and
        then, at the least for every 16 MB, and once at the end. `batch_rows` are held before they
        are handed over.

        Raises:
            TraceError: a trace is damaged, and the reader does not go on after that (it is
                strict, or bt2); what came before has been delivered.
            UsageError: the set is closed, or an earlier iteration has not ended.
        """
        if self._closed:
            raise UsageError("the traces have been closed", hint="msgflow.trace.open(paths)")
        if self._under_way() is not None:
            raise UsageError(
                "these traces are being read already", hint="open them a second time to read twice"
            )
        iteration = self._explained(wanted, progress, batch_rows)
        self._running = weakref.ref(iteration)
        return iteration

    def close(self) -> None:
        """End an iteration under way, and give everything back; may be called more than once."""
        self._closed = True
        iteration = self._under_way()
        if iteration is not None:
            iteration.close()
        self._running = None
        self.unpacked.remove()

    def __enter__(self) -> TraceSet:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _explained(self, wanted: Wanted, progress: Report | None, batch_rows: int) -> Batches:
        """Read everything; errors name what the user knows."""
        try:
            with self.unpacked.explained():
                yield from self._batches(wanted, progress, batch_rows)
        finally:
            self._running = None

    @abstractmethod
    def _batches(self, wanted: Wanted, progress: Report | None, batch_rows: int) -> Batches:
        """Read everything; sets `event_counts` and `duplicate_packet_count` at its end."""

    def _under_way(self) -> Batches | None:
        return None if self._running is None else self._running()
