"""Batches of events and packets, from one pass over a set of traces."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from typing import Any

import numpy as np
import pyarrow as pa

from msgflow.trace.columns import PACKET_SCHEMA, complete_schemas, merged_schemas
from msgflow.trace.ctf.arrow import declared_schema
from msgflow.trace.ctf.event_order import Batch, ordered_batches
from msgflow.trace.ctf.events import event_reader_of
from msgflow.trace.ctf.field_reader import EventReader
from msgflow.trace.ctf.field_types import BYTE
from msgflow.trace.ctf.packet_order import Entry, OnDamage, PacketEvents
from msgflow.trace.ctf.record_batch import ClassPlan, build_batch, make_plan
from msgflow.trace.ctf.stream_layout import StreamLayout
from msgflow.trace.model import PACKET, EventBatch, Progress
from msgflow.trace.numpy_arrow import integers_to_arrow
from msgflow.trace.prefetch import prefetched

LARGEST_BATCH = 8 << 20
SMALLEST_BATCH = 64 << 10
_BYTES_PER_ROW = 256
_AHEAD = 1


class Iteration:
    """Reads packets once."""

    def __init__(
        self,
        layouts: Sequence[StreamLayout],
        entries: Sequence[Entry],
        wanted: Mapping[str, pa.Schema | None] | None,
        progress: Callable[[Progress], None] | None,
        batch_rows: int,
        report: OnDamage,
    ) -> None:
        """Prepare to read `entries`; see `TraceSet.batches` for the rest."""
        self._entries = entries
        self._progress = progress
        self._batch_rows = batch_rows
        self._report_damage = report
        self._classes = [(layout, known) for layout in layouts for known in layout.classes.values()]
        self._counts = np.zeros(len(self._classes), np.int64)
        declared = merged_schemas(
            (known.event.name, declared_schema(known.event.payload)) for _, known in self._classes
        )
        self._plans = self._planned(complete_schemas(wanted, declared))
        self.event_count = 0  # events read so far

    def event_counts(self) -> dict[tuple[int, str], int]:
        """Return (trace index, event name) to the number of events read so far."""
        counts: dict[tuple[int, str], int] = {}
        for (layout, known), count in zip(self._classes, self._counts.tolist(), strict=True):
            if count:
                key = (layout.trace_index, known.event.name)
                counts[key] = counts.get(key, 0) + count
        return dict(sorted(counts.items()))

    def run(self) -> Iterator[EventBatch]:
        """Yield all batches."""
        size = min(max(self._batch_rows * _BYTES_PER_ROW, SMALLEST_BATCH), LARGEST_BATCH)
        total = sum(entry.size for entry in self._entries) or 1
        done = 0
        latest_ns = 0
        # A thread finds the events of the next batch while the columns of this one are made.
        whole = self._field_by_field()
        batches = ordered_batches(self._entries, size, self._report_damage, whole)
        with closing(prefetched(batches, _AHEAD)) as ahead:
            for number, batch in enumerate(ahead):
                if batch.rows.size:
                    latest_ns = int(batch.events.ts_ns[batch.rows[-1]])
                yield from self.events(batch, number)
                yield from packet_batches(
                    batch.packets, self._batch_rows, number, self._report_damage
                )
                done += sum(packet.entry.size for packet in batch.packets)
                if done < total:
                    self._report_progress(done / total, latest_ns)
        self._report_progress(1.0, latest_ns)

    def _field_by_field(self) -> set[StreamLayout]:
        """Return the streams with events read field by field: their packets cannot be cut."""
        plans = itertools.chain.from_iterable(self._plans.values())
        without_header = {layout for layout, _ in self._classes if layout.header is None}
        return without_header | {plan.stream for plan in plans if plan.is_field_by_field}

    def _planned(self, wanted: Mapping[str, pa.Schema]) -> dict[str, list[ClassPlan]]:
        plans: dict[str, list[ClassPlan]] = {}
        for layout, known in self._classes:
            name = known.event.name
            if name in wanted:
                plans.setdefault(name, []).append(make_plan(layout, known, wanted[name]))
        return plans

    def events(self, batch: Batch, number: int) -> Iterator[EventBatch]:
        """Yield the wanted events of a batch, class by class; `number` is that of the round."""
        first_id = self.event_count
        self.event_count += batch.rows.size
        classes = batch.events.classes[batch.rows]
        classes = classes.astype(np.uint16 if len(self._classes) < 1 << 16 else np.uint32)
        by_class = np.argsort(classes, kind="stable")
        ends = np.cumsum(np.bincount(classes, minlength=len(self._classes)))
        counts = np.diff(ends, prepend=0)
        self._counts += counts
        readers: dict[int, EventReader] = {}

        def reader_at(packet: int, position: int) -> tuple[EventReader, int]:
            entry, base = batch.entries[packet], batch.bases[packet]
            layout = entry.stream.layout
            if packet not in readers:
                readers[packet] = event_reader_of(layout, batch.memory, entry, base)
            is_field_by_field = layout.header is None
            return readers[packet], position if is_field_by_field else (position - base) * BYTE

        for name, plans in self._plans.items():
            parts = []
            for plan in plans:
                place = plan.layout.number
                if counts[place]:
                    rows = by_class[ends[place] - counts[place] : ends[place]]
                    parts.append(build_batch(plan, batch, rows, first_id, reader_at))
            if parts:
                whole = parts[0] if len(parts) == 1 else _in_order(parts)
                for begin in range(0, whole.num_rows, self._batch_rows):
                    yield EventBatch(name, whole.slice(begin, self._batch_rows), number)

    def _report_progress(self, fraction: float, time_ns: int) -> None:
        if self._progress is not None:
            self._progress(Progress(self.event_count, fraction, time_ns))


def _in_order(parts: list[pa.RecordBatch]) -> pa.RecordBatch:
    table = pa.Table.from_batches(parts).unify_dictionaries().sort_by("event_id")
    return table.combine_chunks().to_batches()[0]


def packet_batches(
    packets: Sequence[PacketEvents], most: int, number: int, report: OnDamage
) -> Iterator[EventBatch]:
    """Yield the rows of packets that were read in a round, at most `most` in a batch.

    `report` is called for packets whose times contradict those of their events.
    """
    rows = [_row(packet, report) for packet in packets]
    for begin in range(0, len(rows), most):
        columns = zip(*rows[begin : begin + most], strict=True)
        arrays = list(map(integers_to_arrow, columns, PACKET_SCHEMA.types))
        batch = pa.RecordBatch.from_arrays(arrays, schema=PACKET_SCHEMA)
        yield EventBatch(PACKET, batch, number)


def _row(packet: PacketEvents, report: OnDamage) -> tuple[Any, ...]:
    entry, stream = packet.entry, packet.entry.stream
    header, last = entry.packet.header, packet.last
    if packet.falls_back:
        report(entry, 0, "time runs backward in the packet")
    if packet.first is not None and packet.first < entry.begin:
        report(entry, 0, "an event is earlier than the begin of its packet")
    clock = stream.layout.clock
    end_ns = None
    if header.end is not None:
        # A crash leaves packets without an end; old tracers give one before the last event.
        end_ns = clock.to_ns(max(header.end, entry.begin if last is None else last))
        is_late = bool(header.end) and last is not None and last > header.end
        if is_late and not _events_may_follow_end(stream.layout.trace.environment):
            report(entry, 0, "an event is later than the end of its packet")
    return (
        stream.trace_index,
        stream.index,
        stream.class_id,
        stream.instance,
        header.cpu,
        entry.position,
        None if header.begin is None else clock.to_ns(header.begin),
        end_ns,
        packet.last_ns if stream.has_time else None,
        packet.count,
        entry.discarded,
        entry.lost,
        header.sequence is not None,
    )


def _events_may_follow_end(environment: Mapping[str, int | str]) -> bool:
    """Tell whether events may be later than the end of their packet.

    True of LTTng-UST before 2.11 and LTTng-modules before 2.9.13, 2.10.10 and 2.11.
    """
    version = tuple(
        value if isinstance(value := environment.get(f"tracer_{part}", 0), int) else 0
        for part in ("major", "minor", "patchlevel")
    )
    match environment.get("tracer_name"):
        case "lttng-ust":
            return version < (2, 11, 0)
        case "lttng-modules":
            return version < (2, 9, 13) or (2, 10, 0) <= version < (2, 10, 10)
        case _:
            return False
