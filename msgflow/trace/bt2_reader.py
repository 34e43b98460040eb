"""The reader on Babeltrace 2."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.trace import bt2_library
from msgflow.trace.bt2_describe import describe
from msgflow.trace.bt2_iteration import Iteration
from msgflow.trace.exclusive import ExclusiveTraceSet
from msgflow.trace.time_base import TimeBase

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Mapping, Sequence

    import pyarrow as pa

    from msgflow.trace.model import EventBatch, Progress, TraceLocation


class Bt2TraceSet(ExclusiveTraceSet):
    """Traces read through bt2."""

    def __init__(self, locations: Sequence[TraceLocation]) -> None:
        """Describe the traces; nothing is read yet.

        Raises:
            TraceError: bt2 is not installed, or cannot open one of the traces.
        """
        super().__init__()
        self._library = bt2_library.load()
        base = TimeBase()
        self.traces = tuple(
            describe(self._library, location, index, base)
            for index, location in enumerate(locations)
        )

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
