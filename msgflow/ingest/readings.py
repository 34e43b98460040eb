"""Readings: what performance counters of a thread had counted at an event, such as its CPU time.

`lttng add-context --type=perf:thread:…` adds them. Where a process may not read its counters, LTTng
writes none of its events: a session of its own beside the main one reads them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pyarrow as pa

from msgflow.ingest.catalogue import Field, Tracepoint
from msgflow.trace.columns import COMMON_SCHEMA, CONTEXT
from msgflow.trace.model import TraceInfo

READING = Tracepoint(
    name="reading",
    fields=(
        Field("event", "VARCHAR"),
        Field("callback", "UBIGINT"),
        Field("counter", "VARCHAR"),
        Field("value", "BIGINT"),
    ),
)
"""What is staged of a reading: the event at which it was taken, its callback, and the counter."""

_READ_AT = ("ros2:callback_start", "ros2:callback_end")
# What a session of readings has; it may have others of a thread's executor beside them.
_EVENTS = frozenset(
    (*_READ_AT, "ros2:rclcpp_executor_wait_for_work", "ros2:rclcpp_executor_execute")
)


def with_counters(
    wanted: dict[str, pa.Schema | None], traces: Sequence[TraceInfo]
) -> dict[str, pa.Schema | None]:
    """Return the wanted events with a column of each counter that the traces read at them."""
    names = sorted({name for trace in traces for name in trace.counters})
    counters = [pa.field(name, pa.int64(), metadata={CONTEXT: b""}) for name in names]
    return {
        event: pa.schema([*schema, *counters])
        if schema is not None and event in _READ_AT
        else schema
        for event, schema in wanted.items()
    }


def of_readings_alone(traces: Sequence[TraceInfo]) -> frozenset[int]:
    """Return the indices of traces that only read counters: their events are in other traces."""
    # A process that may not read its counters declares these events without any.
    few = [trace for trace in traces if trace.event_names and _EVENTS.issuperset(trace.event_names)]
    rest = {_session(trace) for trace in traces if not _EVENTS.issuperset(trace.event_names)}
    read = {_session(trace) for trace in few if trace.counters}
    return frozenset(trace.index for trace in few if _session(trace) in rest & read)


def _session(trace: TraceInfo) -> tuple[object, ...]:
    """Return what sessions of one machine have in common, and its kernel trace has not."""
    return trace.hostname, trace.clock_uuid, trace.domain


def readings(event: str, batch: pa.RecordBatch) -> Iterator[pa.RecordBatch]:
    """Yield the readings at some events of one name, those of a counter at a time."""
    for field in batch.schema:
        if CONTEXT in (field.metadata or {}):
            read = batch.filter(batch[field.name].is_valid())
            columns = {name: read[name] for name in COMMON_SCHEMA.names}
            columns["event"] = pa.repeat(event, read.num_rows)
            columns["callback"] = read["callback"]
            columns["counter"] = pa.repeat(field.name, read.num_rows)
            columns["value"] = read[field.name]
            if read.num_rows:
                yield pa.RecordBatch.from_pydict(columns)


def without_counters(batch: pa.RecordBatch) -> pa.RecordBatch:
    """Return events without the columns of counters."""
    names = [field.name for field in batch.schema if CONTEXT not in (field.metadata or {})]
    return batch.select(names)
