"""Staging: what was read, and what the model makes of it, until it is stored.

`raw` is a temporary database file with one table per tracepoint and the packets as read. `staging`
is a database in memory, which spills to the temporary directory: `staging.source` (one row per
trace), `staging.event_count`, `staging.event` (all events of known tracepoints, without payload),
and the objects of `schema/model`.
"""

from __future__ import annotations

import contextlib
import fnmatch
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import duckdb

from msgflow.errors import UsageError
from msgflow.ingest.catalogue import COMMON_COLUMNS, Tracepoint, load
from msgflow.ingest.inserter import Inserter
from msgflow.trace import PACKET, EventBatch, Progress, TraceInfo, TraceSet

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    import pyarrow as pa

    from msgflow.query.interrupt import Interrupts

_PACKET_TABLE = """
CREATE TABLE raw.packet (
    trace_index INTEGER, stream_index INTEGER, stream_class_id BIGINT, stream_instance_id BIGINT,
    cpu_id INTEGER, position BIGINT, begin_ns BIGINT, end_ns BIGINT, last_event_ns BIGINT,
    event_count BIGINT, discarded_event_count BIGINT, lost_packet_count BIGINT
)
"""

_SOURCE_TABLE = """
CREATE TABLE staging.source (
    trace_index INTEGER, path VARCHAR, uuid VARCHAR, domain VARCHAR, hostname VARCHAR,
    tracer VARCHAR, clock_uuid VARCHAR, clock_key VARCHAR, begin_ns BIGINT, end_ns BIGINT
)
"""

_EVENT_COUNT_TABLE = """
CREATE TABLE staging.event_count (
    trace_index INTEGER, name VARCHAR, is_known BOOLEAN, event_count BIGINT
)
"""

_DAMAGE_TABLE = """
CREATE TABLE staging.damage (
    trace_index INTEGER, file VARCHAR, position BIGINT, byte_offset BIGINT, message VARCHAR
)
"""

# Rows that wait for a commit take memory that nothing limits.
_ROWS_PER_TRANSACTION = 2_000_000

# Packets of the target database that the packets just read are the same as.
_SAME_PACKETS = """
SELECT DISTINCT r.run_id, r.name
FROM packet_batch AS b
JOIN staging.source AS s ON b.trace_index = s.trace_index
JOIN store.trace AS t ON s.uuid = t.uuid
JOIN store.packet AS p
    ON t.trace_id = p.trace_id
    AND b.stream_class_id = p.stream_class_id
    AND b.stream_instance_id IS NOT DISTINCT FROM p.stream_instance_id
    AND b.begin_ns = p.begin_ns
JOIN store.run AS r ON p.run_id = r.run_id
ORDER BY r.run_id
"""


@dataclass(frozen=True)
class Loaded:
    """What was loaded.

    Attributes:
        event_counts: (trace index, event name) -> events read, wanted or not.
        duplicate_packet_count: packets that another trace of the input held already.
        replaced_runs: ids of the runs that hold some of these packets already.
    """

    event_counts: Mapping[tuple[int, str], int]
    duplicate_packet_count: int
    replaced_runs: frozenset[int]


def attach(con: duckdb.DuckDBPyConnection, path: Path) -> None:
    """Attach `raw` at `path`, with an empty table per tracepoint, and `staging` in memory."""
    con.execute(f"ATTACH '{_quoted(path)}' AS raw")
    con.execute("ATTACH ':memory:' AS staging")
    for tracepoint in load().tracepoints.values():
        con.execute(tracepoint.create_table_sql("raw"))
    for statement in (_PACKET_TABLE, _SOURCE_TABLE, _EVENT_COUNT_TABLE, _DAMAGE_TABLE):
        con.execute(statement)
    con.execute(_event_view(list(load().tracepoints.values())))


def _event_view(tracepoints: Sequence[Tracepoint]) -> str:
    columns = ", ".join(name for name, _ in COMMON_COLUMNS)
    selects = "\nUNION ALL\n".join(
        f"SELECT {columns} FROM raw.{tracepoint.table}" for tracepoint in tracepoints
    )
    return f"CREATE VIEW staging.event AS\n{selects}"


def load_traces(
    con: duckdb.DuckDBPyConnection,
    traces: TraceSet,
    *,
    hostnames: Mapping[int, str],
    ignore: Sequence[str],
    replace: bool,
    interrupts: Interrupts,
    progress: Callable[[Progress, float], None] | None,
) -> Loaded:
    """Load all wanted events and all packets of `traces`.

    Args:
        con: connection with the target database as current and `staging` attached.
        traces: what to read.
        hostnames: trace index -> name of the host, where the user gave one.
        ignore: patterns of event names to leave out, such as 'dds:*'.
        replace: packets that the database holds already are no error.
        interrupts: asked at every batch.
        progress: called with the reader's progress and the seconds since the begin.

    Raises:
        TraceError: a trace is damaged.
        UsageError: the database holds these packets already, and `replace` is false.
        KeyboardInterrupt: Ctrl-C came.
    """
    tracepoints = load().tracepoints
    wanted = {
        name: tracepoint.arrow_schema()
        for name, tracepoint in tracepoints.items()
        if not any(fnmatch.fnmatchcase(name, pattern) for pattern in ignore)
    }
    _load_sources(con, traces.traces, hostnames)
    replaced: set[int] = set()
    started = time.monotonic()

    def report(state: Progress) -> None:
        interrupts.check()
        if progress is not None:
            progress(state, time.monotonic() - started)

    pending = 0

    def insert(item: EventBatch) -> None:
        nonlocal pending
        if item.name == PACKET:
            replaced.update(_same_packets(con, item.batch, replace))
            _insert(con, "raw.packet", item.batch)
        else:
            _insert(con, f"raw.{tracepoints[item.name].table}", item.batch)
        pending += item.batch.num_rows
        if pending >= _ROWS_PER_TRANSACTION:
            con.commit()
            con.begin()
            pending = 0

    # What is staged is written once and read a few times: compressing it costs more than it saves.
    con.execute("SET force_compression = 'uncompressed'")
    con.execute("SET wal_autocheckpoint = '1TB'")
    con.begin()
    try:
        with Inserter(insert) as inserter:
            for item in traces.batches(wanted, progress=report):
                interrupts.check()
                inserter.put(item)
        con.commit()
    except BaseException:
        with contextlib.suppress(duckdb.Error):  # the transaction may have ended by itself
            con.rollback()
        raise
    finally:
        con.execute("RESET force_compression")
        con.execute("RESET wal_autocheckpoint")
    for (trace_index, name), count in traces.event_counts.items():
        con.execute(
            "INSERT INTO staging.event_count VALUES (?, ?, ?, ?)",
            [trace_index, name, name in tracepoints, count],
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
    return Loaded(dict(traces.event_counts), traces.duplicate_packet_count, frozenset(replaced))


def _load_sources(
    con: duckdb.DuckDBPyConnection, traces: Sequence[TraceInfo], hostnames: Mapping[int, str]
) -> None:
    for trace in traces:
        hostname = hostnames.get(trace.index) or trace.hostname or "unknown"
        con.execute(
            "INSERT INTO staging.source VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
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
            ],
        )


def _insert(con: duckdb.DuckDBPyConnection, table: str, batch: pa.RecordBatch) -> None:
    con.register("event_batch", batch)
    con.execute(f"INSERT INTO {table} SELECT * FROM event_batch")
    con.unregister("event_batch")


def _same_packets(con: duckdb.DuckDBPyConnection, batch: pa.RecordBatch, replace: bool) -> set[int]:
    con.register("packet_batch", batch)
    try:
        runs = con.execute(_SAME_PACKETS).fetchall()
    finally:
        con.unregister("packet_batch")
    if runs and not replace:
        raise UsageError(
            f"these packets are in the database already — run {runs[0][1]} ({runs[0][0]})",
            "give --replace to read them again in place of that run",
        )
    return {run_id for run_id, _ in runs}


def export(con: duckdb.DuckDBPyConnection, directory: Path) -> None:
    """Write every staging table that has rows to `directory` as Parquet."""
    directory.mkdir(parents=True, exist_ok=True)
    for database, table in con.execute(
        "SELECT database_name, table_name FROM duckdb_tables() "
        "WHERE database_name IN ('raw', 'staging') AND estimated_size > 0 ORDER BY ALL"
    ).fetchall():
        target = _quoted(directory / f"{database}.{table}.parquet")
        con.execute(f"COPY {database}.\"{table}\" TO '{target}' (FORMAT parquet)")


def _quoted(path: Path) -> str:
    return str(path).replace("'", "''")
