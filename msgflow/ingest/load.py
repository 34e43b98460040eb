"""Loads traces into `raw` and `staging`."""

from __future__ import annotations

import contextlib
import itertools
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence

import duckdb
import numpy as np
import pyarrow as pa

from msgflow.db.store import empty
from msgflow.db.transaction import transaction
from msgflow.ingest import overlapping_traces
from msgflow.ingest.catalogue import USER_EVENT, Tracepoint, load
from msgflow.ingest.cpus import Cpus
from msgflow.ingest.overlapping_traces import Corrections
from msgflow.ingest.readings import (
    READING,
    of_readings_alone,
    readings,
    with_counters,
    without_counters,
)
from msgflow.ingest.sequences import Sequences
from msgflow.ingest.staging import RawTables
from msgflow.ingest.user_events import is_match, matches, names_of, user_rows
from msgflow.sql.interrupt import Interrupts
from msgflow.trace import PACKET, EventBatch, Progress, TraceInfo, TraceSet
from msgflow.trace.numpy_arrow import is_valid, text_lengths, to_arrow, to_numpy, without
from msgflow.trace.prefetch import prefetched

_TIMES = {"timestamp", "source_timestamp", "message_timestamp", "init_timestamp", "period"}
# 146 years in nanoseconds: differences of any two times fit, as they do in the reader.
_LATEST_NS = (1 << 62) - 1
# Bytes. ROS allows 255 for a name; symbols of templates can be long. Every message is joined with
# the name of its topic.
_LONGEST_NAME = 1 << 10
_LONGEST_SYMBOL = 1 << 16


def load_traces(
    con: duckdb.DuckDBPyConnection,
    traces: TraceSet,
    *,
    hostnames: Mapping[int, str],
    ignore: Sequence[str],
    events: Sequence[str] = (),
    may_hold: bool,
    replace: bool,
    interrupts: Interrupts,
    progress: Callable[[Progress, float], None] | None,
) -> frozenset[int]:
    """Load all wanted events and packets; return the runs that hold some of these packets already.

    `may_hold` says that the current database may hold some of these packets already; `replace`,
    that this is no error. `interrupts` is asked at every batch. `progress` gets the progress of the
    reader and the seconds since the begin.
    """
    catalogue = load()
    user_names = {n for n in names_of(events, traces.traces) if not is_match(n, ignore)}
    wanted = wanted_events(ignore)
    for name in superfluous(traces.traces):
        wanted.pop(name, None)
    wanted = with_counters(wanted, traces.traces) | dict.fromkeys(user_names)
    readers = of_readings_alone(traces.traces)
    sources = list(_sources(traces.traces, hostnames))
    # A host is a clock and a name, as in `schema/model/identity/host.sql`.
    numbers: dict[tuple[object, object], int] = {}
    hosts = [numbers.setdefault((row[7], row[4]), len(numbers)) for row in sources]
    _insert(con, "source", sources)
    _insert(con, "reader", ((index,) for index in readers))
    started = time.monotonic()

    def report(state: Progress) -> None:
        interrupts.check()
        if progress is not None:
            progress(state, time.monotonic() - started)

    tables = RawTables(con, may_hold=may_hold, may_replace=replace)

    def read(corrections: Corrections | None) -> Counter[tuple[str, str, str]]:
        batches = traces.batches(wanted, progress=report)
        implausible: Counter[tuple[str, str, str]] = Counter()
        sequences, cpus = Sequences(catalogue, hosts), Cpus(catalogue)
        with transaction(con), con.cursor() as beside:
            # A thread reads the next round while DuckDB inserts this one.
            placed = _placed(batches, readers, sequences, cpus, corrections, implausible, beside)
            with contextlib.closing(prefetched(placed, 1)) as ahead:
                for of_round in ahead:
                    interrupts.check()
                    for table, rows in of_round:
                        tables.add(table, rows)
            tables.flush()
        return implausible

    implausible = read(None)
    corrections = overlapping_traces.corrections_of(con)
    if corrections:
        empty(con, "raw")
        implausible = read(corrections)
    known = catalogue.in_traces.keys() | user_names
    counts = ((*of, of[1] in known, count) for of, count in traces.event_counts.items())
    _insert(con, "event_count", counts)
    declared = ((trace.index, name) for trace in traces.traces for name in trace.event_names)
    _insert(con, "declared", (row for row in declared if row[1] in wanted))
    damages = (
        (d.trace_index, str(d.file), d.position, d.offset, d.message) for d in traces.damages
    )
    _insert(con, "damage", damages)
    _insert(con, "ignored", matches(ignore, traces.event_counts))
    _insert(con, "asked", matches(events, traces.event_counts))
    _insert(con, "implausible", ((*key, count) for key, count in sorted(implausible.items())))
    if traces.duplicate_packet_count:
        _insert(con, "packet_read_once", [(None, traces.duplicate_packet_count)])
    _insert(con, "packet_read_once", traces.repeated_packet_counts.items())
    return frozenset(tables.replaced)


def _insert(con: duckdb.DuckDBPyConnection, table: str, rows: Iterable[Sequence[object]]) -> None:
    if columns := list(zip(*rows, strict=True)):
        values = ", ".join(["unnest(?)"] * len(columns))
        con.execute(f"INSERT INTO staging.{table} SELECT {values}", [*map(list, columns)])


def wanted_events(ignore: Sequence[str] = ()) -> dict[str, pa.Schema | None]:
    """Return the events that a model needs, and their payload, as `TraceSet.batches` takes them."""
    return {
        name: schema
        for name, schema in load().arrow_schemas().items()
        if not is_match(name, ignore)
    }


def _placed(
    batches: Iterable[EventBatch],
    readers: frozenset[int],
    sequences: Sequences,
    cpus: Cpus,
    corrections: Corrections | None,
    implausible: Counter[tuple[str, str, str]],
    beside: duckdb.DuckDBPyConnection,
) -> Generator[list[tuple[str, pa.RecordBatch]], None, None]:
    """Yield (table, rows) of all batches, round by round.

    Of traces with these indices (`readers`) only readings are kept.
    Nothing else uses the connection `beside` meanwhile.
    """
    tracepoints = load().in_traces
    for _, of_round in itertools.groupby(batches, key=lambda batch: batch.round):
        placed, events, of_cpus = [], [], []
        for batch in of_round:
            tracepoint = tracepoints.get(batch.name, USER_EVENT)
            if batch.name == PACKET:
                placed.append((PACKET, _of_others(batch.batch, readers)))
            elif tracepoint.role is not None:
                of_cpus.append((tracepoint, batch.batch))
            elif tracepoint.is_kernel:
                placed.append(without_thread(tracepoint, batch.batch))
            else:
                if tracepoint is USER_EVENT:
                    found = [(tracepoint, user_rows(beside, batch.name, batch.batch))]
                else:
                    rows = plausible(batch.name, batch.batch, implausible)
                    found = [(READING, each) for each in readings(batch.name, rows)]
                    found.append((tracepoint, without_counters(_of_others(rows, readers))))
                for kind, rows in found:
                    corrected = rows if corrections is None else corrections.applied(rows)
                    if corrected.num_rows:
                        events.append((kind, corrected))
        placed += cpus.place(of_cpus) if of_cpus else []
        read = [pair for pair in events if pair[0] is READING]
        others = [pair for pair in events if pair[0] is not READING]
        placed += sequences.place(others) if others else []
        placed += sequences.place_readings(read) if read else []
        yield placed


def _of_others(batch: pa.RecordBatch, left_out: frozenset[int]) -> pa.RecordBatch:
    """Return the rows of a batch that are not of the traces with these indices."""
    if not left_out:
        return batch
    is_out = np.isin(to_numpy(batch["trace_index"]), list(left_out))
    return batch.filter(to_arrow(~is_out)) if is_out.any() else batch


def superfluous(traces: Sequence[TraceInfo]) -> frozenset[str]:
    """Return the names of `sched_wakeup`, if a `sched_waking` came before each."""
    wakeup, waking = (
        {name, *load().tracepoints[name].aliases} for name in ("sched_wakeup", "sched_waking")
    )
    is_needed = any(
        wakeup.intersection(trace.event_names) and waking.isdisjoint(trace.event_names)
        for trace in traces
    )
    return frozenset() if is_needed else frozenset(wakeup)


def without_thread(tracepoint: Tracepoint, batch: pa.RecordBatch) -> tuple[str, pa.RecordBatch]:
    """Return table and rows of an event of the kernel, without its contexts."""
    columns = [name for name, _ in tracepoint.common_columns]
    columns += [field.name for field in tracepoint.fields]
    return tracepoint.table, batch.select(columns)


def _sources(
    traces: Sequence[TraceInfo], hostnames: Mapping[int, str]
) -> Iterator[tuple[object, ...]]:
    for trace in traces:
        hostname = hostnames.get(trace.index) or trace.hostname or "unknown"
        yield (
            trace.index,
            str(trace.path),
            trace.uuid,
            trace.domain,
            hostname,
            trace.tracer,
            trace.clock_uuid,
            trace.clock_uuid or f"host {hostname}",
            trace.begin_ns,
            trace.end_ns,
            trace.clock_correction_ns,
            trace.clock_offset_ns + trace.clock_correction_ns,
        )


def plausible(
    name: str, batch: pa.RecordBatch, left_out: Counter[tuple[str, str, str]]
) -> pa.RecordBatch:
    """Return events of this name with NULL in place of values that cannot be times or names.

    One of them must not end an ingest. `left_out` counts them by event, field and what is wrong.
    """
    for place, field in enumerate(batch.schema):
        values = batch.column(place)
        if field.name in _TIMES:
            what, numbers, least, most = "times", to_numpy(values), -_LATEST_NS, _LATEST_NS
        elif pa.types.is_string(field.type):
            what, numbers, least = "names: too long", text_lengths(values), 0
            most = _LONGEST_SYMBOL if field.name == "symbol" else _LONGEST_NAME
        else:
            continue
        if not numbers.size or (least <= numbers.min() and numbers.max() <= most):
            continue
        bad = is_valid(values) & ~((least <= numbers) & (numbers <= most))
        if bad.any():
            left_out[name, field.name, what] += int(bad.sum())
            batch = batch.set_column(place, field, without(values, bad))
    return batch
