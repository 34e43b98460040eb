"""The interface that every reader fulfils."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from types import TracebackType

    import pyarrow as pa

    from msgflow.trace.model import Damage, EventBatch, Progress, TraceInfo

DEFAULT_BATCH_ROWS = 65_536


class TraceSet(ABC):
    """Traces opened together, read as one sequence of events in time order.

    A context manager; closing it ends an iteration that is under way.

    Attributes:
        traces: what each trace declares, in order of path.
        event_counts: (trace index, event name) to the number of events read, wanted or not;
            only events that occur. Complete after `batches` has ended.
        duplicate_packet_count: packets skipped because another trace of the set holds them.
        repeated_packet_counts: trace index to the packets skipped because that trace holds them
            twice, such as those of a stream file copied beside itself.
        damages: what is damaged and was left out or read as far as possible. Complete after
            `batches` has ended.
    """

    traces: tuple[TraceInfo, ...]
    event_counts: Mapping[tuple[int, str], int]
    duplicate_packet_count: int
    repeated_packet_counts: Mapping[int, int] = MappingProxyType({})
    damages: Sequence[Damage] = ()

    @abstractmethod
    def batches(
        self,
        wanted: Mapping[str, pa.Schema | None] | None = None,
        *,
        progress: Callable[[Progress], None] | None = None,
        batch_rows: int = DEFAULT_BATCH_ROWS,
    ) -> Iterator[EventBatch]:
        """Read everything once; may be called again, which reads again from the start.

        The batches of one name come in order of `event_id`, those of all names in rounds: see
        `EventBatch.round`. Memory stays bounded by `batch_rows`, whatever the size of the traces.

        Args:
            wanted: event name to the payload columns to deliver, None for all its fields. A
                column is filled from the field of its name, else of a name in its metadata
                `aliases` (comma separated), else it is NULL. None: all events with all fields.
            progress: called now and then, at the least for every 16 MB, and once at the end.
            batch_rows: events held before they are handed over.

        Raises:
            TraceError: a trace is damaged, and the reader does not go on after that (it is
                strict, or bt2); what came before has been delivered.
            UsageError: the set is closed, or an earlier iteration has not ended.
        """

    @abstractmethod
    def close(self) -> None:
        """Give everything back. May be called more than once."""

    def __enter__(self) -> TraceSet:
        return self

    def __exit__(
        self,
        exception_type: type[BaseException] | None,
        exception: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
