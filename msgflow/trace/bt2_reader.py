"""The reader on Babeltrace 2."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.trace import bt2_library
from msgflow.trace.bt2_describe import describe
from msgflow.trace.bt2_iteration import Iteration
from msgflow.trace.reader import DEFAULT_BATCH_ROWS, TraceSet

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

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
        self._iteration: Iteration | None = None
        self._closed = False

    def batches(
        self,
        wanted: Mapping[str, pa.Schema] | None = None,
        *,
        progress: Callable[[Progress], None] | None = None,
        batch_rows: int = DEFAULT_BATCH_ROWS,
    ) -> Iterator[EventBatch]:
        """Read everything once; see `TraceSet.batches`."""
        if self._closed:
            raise UsageError("the traces have been closed", hint="msgflow.trace.open(paths)")
        if self._iteration is not None:
            raise UsageError(
                "these traces are being read already", hint="open them a second time to read twice"
            )
        return self._batches(Iteration(self._library, self.traces, wanted, progress, batch_rows))

    def close(self) -> None:
        """End an iteration under way and give the traces back."""
        self._closed = True
        self._end()

    def _batches(self, iteration: Iteration) -> Iterator[EventBatch]:
        self._iteration = iteration
        try:
            yield from iteration.run()
        finally:
            self._end()

    def _end(self) -> None:
        if self._iteration is not None:
            self.event_counts = self._iteration.event_counts()
            self.duplicate_packet_count = self._iteration.duplicate_packet_count
            self._iteration.close()
            self._iteration = None
