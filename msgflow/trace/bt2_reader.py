"""The reader on Babeltrace 2."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.trace import bt2_library
from msgflow.trace.bt2_describe import describe
from msgflow.trace.bt2_iteration import Iteration
from msgflow.trace.reader import DEFAULT_BATCH_ROWS, TraceSet

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Mapping, Sequence

    import pyarrow as pa

    from msgflow.trace.model import EventBatch, Progress, TraceLocation


class Bt2TraceSet(TraceSet):
    """Traces read through bt2."""

    def __init__(self, locations: Sequence[TraceLocation]) -> None:
        """Describe the traces; nothing is read yet.

        Raises:
            TraceError: bt2 is not installed, or cannot open one of the traces.
        """
        self._library = bt2_library.load()
        self.traces = tuple(
            describe(self._library, location, index) for index, location in enumerate(locations)
        )
        self.event_counts: Mapping[tuple[int, str], int] = {}
        self.duplicate_packet_count = 0
        # Weak, so that an iteration which its consumer has dropped is over.
        self._running: weakref.ref[Generator[EventBatch, None, None]] | None = None
        self._closed = False

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
        """End an iteration under way and give the traces back."""
        self._closed = True
        iteration = self._under_way()
        if iteration is not None:
            iteration.close()
        self._running = None

    def _under_way(self) -> Generator[EventBatch, None, None] | None:
        return None if self._running is None else self._running()

    def _batches(
        self,
        wanted: Mapping[str, pa.Schema | None] | None,
        progress: Callable[[Progress], None] | None,
        batch_rows: int,
    ) -> Generator[EventBatch, None, None]:
        iteration = Iteration(self._library, self.traces, wanted, progress, batch_rows)
        try:
            yield from iteration.run()
        finally:
            self.event_counts = iteration.event_counts()
            self.duplicate_packet_count = iteration.duplicate_packet_count
            iteration.close()
            self._running = None
