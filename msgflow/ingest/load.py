"""Loads traces into `raw` and `staging`."""

from __future__ import annotations

import contextlib
import itertools
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import duckdb

from msgflow.errors import UsageError
from msgflow.ingest import reconciled, staging, whole
from msgflow.ingest.catalogue import load
from msgflow.ingest.ignored import is_ignored, matches
from msgflow.ingest.implausible import Implausible
from msgflow.ingest.inserter import Inserter
from msgflow.ingest.sequences import Placed, Sequences
from msgflow.sql.statement import internal_sql
from msgflow.trace import PACKET, EventBatch, Progress, TraceInfo, TraceSet

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    import pyarrow as pa

    from msgflow.ingest.catalogue import Tracepoint
    from msgflow.ingest.reconciled import Corrections
    from msgflow.sql.interrupt import Interrupts

# Rows that wait for a commit take memory that nothing limits.
_ROWS_PER_TRANSACTION = 2_000_000
# DuckDB's row group: fewer at once cost more each.
_ROWS_PER_INSERT = 122_880
# Rows that wait for more, of all tables.
_MOST_WAITING = 500_000


@dataclass(frozen=True)
class Loaded:
    """What was loaded.

    Attributes:
        event_counts: (trace index, event name) -> events read, wanted or not.
        replaced_runs: ids of the runs that hold some of these packets already.
    """

    event_counts: Mapping[tuple[int, str], int]
    replaced_runs: frozenset[int]


def load_traces(
    con: duckdb.DuckDBPyConnection,
    traces: TraceSet,
    *,
    hostnames: Mapping[int, str],
    ignore: Sequence[str],
    may_hold: bool,
    replace: bool,
    interrupts: Interrupts,
    progress: Callable[[Progress, float], None] | None,
) -> Loaded:
    """Load all wanted events and all packets of `traces`.

    Args:
        con: connection with `raw` and `staging` attached.
        traces: what to read.
        hostnames: trace index -> name of the host, where the user gave one.
        ignore: patterns of event names to leave out, such as 'dds:*'.
        may_hold: a database is current that may hold some of these packets already.
        replace: packets that the database holds already are no error.
        interrupts: asked at every batch.
        progress: called with the reader's progress and the seconds since the begin.

    Raises:
        TraceError: a trace is damaged.
        UsageError: the database holds these packets already, and `replace` is false.
        KeyboardInterrupt: Ctrl-C came.
    """
    catalogue = load()
    wanted = {
        name: tracepoint.arrow_schema()
        for name, tracepoint in catalogue.in_traces.items()
        if not is_ignored(name, ignore)
    }
    sources = _sources(traces.traces, hostnames)
    for source in sources:
        con.execute(f"INSERT INTO staging.source VALUES ({', '.join('?' * len(source))})", source)
    started = time.monotonic()

    def report(state: Progress) -> None:
        interrupts.check()
        if progress is not None:
            progress(state, time.monotonic() - started)

    tables = _Tables(con, may_hold=may_hold, may_replace=replace)

    def read(corrections: Corrections | None) -> Implausible:
        batches = traces.batches(wanted, progress=report)
        implausible = Implausible()
        sequences = Sequences(catalogue, _hosts(sources))
        con.begin()
        try:
            with Inserter(tables.add_all) as inserter:
                for batch in _placed(batches, sequences, corrections, implausible):
                    interrupts.check()
                    inserter.put(batch)
            tables.flush()
            con.commit()
        except BaseException:
            with contextlib.suppress(duckdb.Error):  # the transaction may have ended by itself
                con.rollback()
            raise
        return implausible

    implausible = read(None)
    corrections = reconciled.find(con)
    if corrections:
        staging.empty(con)
        implausible = read(corrections)
    con.execute(
        "INSERT INTO staging.event_count SELECT unnest(?::INTEGER[]), unnest(?::VARCHAR[]), "
        "unnest(?::BOOLEAN[]), unnest(?::BIGINT[])",
        [
            [trace_index for trace_index, _ in traces.event_counts],
            [name for _, name in traces.event_counts],
            [name in catalogue.in_traces for _, name in traces.event_counts],
            list(traces.event_counts.values()),
        ],
    )
    for trace in traces.traces:
        con.execute(
            "INSERT INTO staging.declared SELECT ?, unnest(?::VARCHAR[])",
            [trace.index, [name for name in trace.event_names if name in wanted]],
        )
    for damage in traces.damages:
        con.execute(
            "INSERT INTO staging.damage VALUES (?, ?, ?, ?, ?)",
            [
                damage.trace_index,
                str(damage.file),
                damage.position,
                damage.offset,
                damage.message,
            ],
        )
    for match in matches(ignore, traces.event_counts):
        con.execute("INSERT INTO staging.ignored VALUES (?, ?, ?)", match)
    for left_out in implausible.rows():
        con.execute("INSERT INTO staging.implausible VALUES (?, ?, ?, ?)", left_out)
    if traces.duplicate_packet_count:
        con.execute(
            "INSERT INTO staging.packet_read_once VALUES (NULL, ?)", [traces.duplicate_packet_count]
        )
    for repeated in traces.repeated_packet_counts.items():
        con.execute("INSERT INTO staging.packet_read_once VALUES (?, ?)", repeated)
    return Loaded(dict(traces.event_counts), frozenset(tables.replaced))


def _placed(
    batches: Iterable[EventBatch],
    sequences: Sequences,
    corrections: Corrections | None,
    implausible: Implausible,
) -> Iterator[Placed | tuple[str, pa.RecordBatch]]:
    """Yield the events of all batches, round by round, and (table, rows) of what has no thread."""
    tracepoints = load().in_traces
    for _, of_round in itertools.groupby(batches, key=lambda batch: batch.round):
        events = []
        for batch in of_round:
            if batch.name == PACKET:
                yield PACKET, batch.batch
                continue
            if tracepoints[batch.name].is_kernel:
                yield without_thread(tracepoints[batch.name], batch.batch)
                continue
            rows = implausible.without(batch.name, batch.batch)
            rows = rows if corrections is None else corrections.applied(rows)
            if rows.num_rows:
                events.append((tracepoints[batch.name].name, rows))
        if events:
            yield sequences.place(events)


def without_thread(tracepoint: Tracepoint, batch: pa.RecordBatch) -> tuple[str, pa.RecordBatch]:
    """Return table and rows of an event of the kernel, whose contexts say nothing."""
    columns = [name for name, _ in tracepoint.common_columns]
    columns += [field.name for field in tracepoint.fields]
    return tracepoint.table, batch.select(columns)


class _Tables:
    """The tables of `raw`, filled inside a transaction that is committed now and then.

    Rows wait until there are enough of them, or `flush` is called.

    Attributes:
        replaced: ids of the runs that hold some of the packets added already.
    """

    def __init__(
        self, con: duckdb.DuckDBPyConnection, *, may_hold: bool, may_replace: bool
    ) -> None:
        self._con = con
        self._may_hold = may_hold
        self._may_replace = may_replace
        self._waiting: dict[str, list[pa.RecordBatch]] = {}
        self._counts: dict[str, int] = {}
        self._uncommitted = 0
        self.replaced: set[int] = set()

    def add_all(self, item: Placed | tuple[str, pa.RecordBatch]) -> None:
        """Add the events of a round, or (table, rows).

        Raises:
            UsageError: the database holds these packets already, and must not replace them.
        """
        if isinstance(item, tuple):
            self.add(*item)
            return
        self.add("thread", item.threads)
        self.add("thread_name", item.thread_names)
        for table, rows in whole.staged(item.batches):
            self.add(table, rows)

    def add(self, table: str, rows: pa.RecordBatch) -> None:
        """Add rows to a table.

        Raises:
            UsageError: the database holds these packets already, and must not replace them.
        """
        if table == PACKET and self._may_hold:
            self.replaced |= self._same_packets(rows)
        self._waiting.setdefault(table, []).append(rows)
        self._counts[table] = self._counts.get(table, 0) + rows.num_rows
        if self._counts[table] >= _ROWS_PER_INSERT:
            self._insert(table)
        elif sum(self._counts.values()) > _MOST_WAITING:
            self._insert(max(self._counts, key=self._counts.__getitem__))

    def flush(self) -> None:
        """Insert what waits."""
        for table in list(self._waiting):
            self._insert(table)

    def _insert(self, table: str) -> None:
        import pyarrow as pa

        rows = pa.Table.from_batches(self._waiting.pop(table))
        self._con.from_arrow(rows).insert_into(f"raw.main.{table}")
        self._uncommitted += self._counts.pop(table)
        if self._uncommitted >= _ROWS_PER_TRANSACTION:
            self._con.commit()
            self._con.begin()
            self._uncommitted = 0

    def _same_packets(self, rows: pa.RecordBatch) -> set[int]:
        self._con.register("packet_batch", rows)
        try:
            runs = self._con.execute(internal_sql().text("known_packet")).fetchall()
        finally:
            self._con.unregister("packet_batch")
        if runs and not self._may_replace:
            raise UsageError(
                f"these packets are in the database already — run {runs[0][1]} ({runs[0][0]})",
                "give --replace to read them again in place of that run",
            )
        return {run_id for run_id, _ in runs}


def _sources(traces: Sequence[TraceInfo], hostnames: Mapping[int, str]) -> list[list[object]]:
    """Return the rows of `staging.source`."""
    rows = []
    for trace in traces:
        hostname = hostnames.get(trace.index) or trace.hostname or "unknown"
        rows.append(
            [
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
            ]
        )
    return rows


def _hosts(sources: Sequence[Sequence[object]]) -> list[int]:
    """Number the hosts of traces: (clock, hostname), see `schema/model/identity/host.sql`."""
    numbers: dict[tuple[object, object], int] = {}
    return [numbers.setdefault((row[7], row[4]), len(numbers)) for row in sources]
