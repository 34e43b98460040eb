"""What the readers share: one iteration at a time, which closing ends."""

from __future__ import annotations

import weakref
from abc import abstractmethod
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.trace.trace_set import DEFAULT_BATCH_ROWS, TraceSet

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Mapping

    import pyarrow as pa

    from msgflow.trace.model import EventBatch, Progress


class ExclusiveTraceSet(TraceSet):
    """Traces of which one iteration at a time can be under way."""

    def __init__(self) -> None:
        self.event_counts: Mapping[tuple[int, str], int] = {}
        self.duplicate_packet_count = 0
        self.repeated_packet_counts: Mapping[int, int] = {}
        # Weak, so that an iteration which its consumer has dropped is over.
        self._running: weakref.ref[Generator[EventBatch, None, None]] | None = None
        self._closed = False

    @abstractmethod
    def _batches(
        self,
        wanted: Mapping[str, pa.Schema | None] | None,
        progress: Callable[[Progress], None] | None,
        batch_rows: int,
    ) -> Generator[EventBatch, None, None]:
        """Read everything; sets `event_counts` and `duplicate_packet_count` at its end."""

    def batches(
        self,
        wanted: Mapping[str, pa.Schema | None] | None = None,
        *,
        progress: Callable[[Progress], None] | None = None,
        batch_rows: int = DEFAULT_BATCH_ROWS,
    ) -> Iterator[EventBatch]:
        """Read everything once; see `TraceSet.batches`."""
        if self._closed:
            raise UsageError("the traces have been closed", hint="msgflow.trace.open(paths)")
        if self._under_way() is not None:
            raise UsageError(
                "these traces are being read already", hint="open them a second time to read twice"
            )
        iteration = self._batches(wanted, progress, batch_rows)
        self._running = weakref.ref(iteration)
        return iteration

    def close(self) -> None:
        """End an iteration under way."""
        self._closed = True
        iteration = self._under_way()
        if iteration is not None:
            iteration.close()
        self._running = None

    def _under_way(self) -> Generator[EventBatch, None, None] | None:
        return None if self._running is None else self._running()
