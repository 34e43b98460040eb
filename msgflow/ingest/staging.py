"""Staging: the events as read and the tables of the model, until they are stored.

`raw` and `staging` are temporary database files. A database in memory would have to compress what
it spills, and keep the beginning of each column of each row group. `raw` has one table per
tracepoint, the packets, and the threads, all as read (`raw.cpu_return`: events of threads that
changed their CPU twice faster than a thread can; `raw.interrupt`: interrupts, each with the thread
that it interrupted; `raw.kernel_thread`: ids of threads to the kernel and in their PID namespace,
as contexts of switches have them; `raw.user_event`: the user's events of all names;
`raw.stack_sample`: lines of `perf script`).
`staging` has `staging.source` (one row per trace), `staging.event_count`, `staging.declared`
(tracepoints that were enabled in a trace, also if they never occurred), `staging.left_out` (events
that another trace holds as well),
`staging.ignored` (patterns of events to leave out, with the events that match, NULL if none does),
`staging.asked` (patterns of the user's events to load, with the events that match, likewise),
`staging.packet_read_once` (packets that a trace holds twice, or where it is NULL several traces),
`staging.implausible` (values that were left out), `staging.damage`, `staging.event` (all events of
the user and of known tracepoints, but those of the kernel, without payload), `staging.predecessor`
(the pointers from event to event), and the objects of `schema/alignment`, `model` and `kernel`.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from msgflow.files.atomic_directory import replacing_entries
from msgflow.ingest.catalogue import (
    COMMON_COLUMNS,
    Origin,
    Predecessor,
    Tracepoint,
    enum_type,
    load,
)
from msgflow.sql.quoting import literal

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence
    from pathlib import Path

    import duckdb

_TABLES = """
CREATE TABLE raw.packet (
    trace_index INTEGER, stream_index INTEGER, stream_class_id BIGINT, stream_instance_id BIGINT,
    cpu_id INTEGER, position BIGINT, begin_ns BIGINT, end_ns BIGINT, last_event_ns BIGINT,
    event_count BIGINT, discarded_event_count BIGINT, lost_packet_count BIGINT,
    is_numbered BOOLEAN
);
CREATE TABLE raw.thread (
    thread_index INTEGER, trace_index INTEGER, pid_ns BIGINT, vpid INTEGER, vtid INTEGER
);
CREATE TABLE raw.thread_name (
    thread_index INTEGER, procname VARCHAR, first_event_id BIGINT, last_event_id BIGINT,
    first_seen_ns BIGINT, last_seen_ns BIGINT
);
CREATE TABLE raw.cpu_return (thread_index INTEGER, event_id BIGINT);
CREATE TABLE raw.interrupt (
    trace_index INTEGER, kind {kind}, start_ns BIGINT, end_ns BIGINT, tid INTEGER
);
CREATE TABLE raw.kernel_thread (
    trace_index INTEGER, tid INTEGER, vpid INTEGER, vtid INTEGER, pid_ns BIGINT, first_ns BIGINT,
    last_ns BIGINT
);
CREATE TABLE raw.stack_sample (
    hostname VARCHAR, is_monotonic BOOLEAN, head VARCHAR, stack VARCHAR
);
CREATE TABLE staging.source (
    trace_index INTEGER, path VARCHAR, uuid VARCHAR, domain VARCHAR, hostname VARCHAR,
    tracer VARCHAR, clock_uuid VARCHAR, clock_key VARCHAR, begin_ns BIGINT, end_ns BIGINT,
    clock_correction_ns BIGINT, clock_origin_ns BIGINT
);
CREATE TABLE staging.event_count (
    trace_index INTEGER, name VARCHAR, is_known BOOLEAN, event_count BIGINT
);
CREATE TABLE staging.declared (trace_index INTEGER, name VARCHAR);
CREATE TABLE staging.left_out (
    trace_index INTEGER, used_index INTEGER, event_count BIGINT, thread_count BIGINT,
    length_ns BIGINT
);
CREATE TABLE staging.ignored (place INTEGER, pattern VARCHAR, event VARCHAR);
CREATE TABLE staging.asked (place INTEGER, pattern VARCHAR, event VARCHAR);
CREATE TABLE staging.packet_read_once (trace_index INTEGER, packet_count BIGINT);
CREATE TABLE staging.implausible (
    event VARCHAR, field VARCHAR, what VARCHAR, value_count BIGINT
);
CREATE TABLE staging.damage (
    trace_index INTEGER, file VARCHAR, position BIGINT, byte_offset BIGINT, message VARCHAR
)
"""

OF_ALL_EVENTS = {"staging.event", "staging.predecessor"}
"""Views of all events, which unite the tables of all tracepoints."""


def attach(con: duckdb.DuckDBPyConnection, directory: Path | None) -> None:
    """Attach `raw`, with an empty table per tracepoint, and `staging`."""
    for name in ("raw", "staging"):
        path = ":memory:" if directory is None else str(directory / f"{name}.duckdb")
        # Staged tables are of no use after a crash.
        con.execute(f"ATTACH {literal(path)} AS {name} (RECOVERY_MODE no_wal_writes)")
    catalogue = load()
    for each in catalogue.staged.values():
        con.execute(each.create_table_sql("raw", catalogue.labels, catalogue.interrupts))
    con.execute(_TABLES.format(kind=enum_type(catalogue.interrupts)))


def empty_tables(con: duckdb.DuckDBPyConnection) -> set[str]:
    """Return the tables of `raw` and `staging` without a row, as `schema.name`."""
    rows = con.execute(
        "SELECT database_name || '.' || table_name FROM duckdb_tables() "
        "WHERE database_name IN ('raw', 'staging') AND estimated_size = 0"
    ).fetchall()
    return {name for (name,) in rows}


def narrow(con: duckdb.DuckDBPyConnection, empty: Collection[str]) -> None:
    """Create the views of all events over the tables that have rows: empty ones cost planning."""
    known = [each for each in load().of_threads if not each.is_translated]
    left = [each for each in known if f"raw.{each.table}" not in empty]
    con.execute(_event_view(left or known))
    con.execute(_predecessor_view([each for each in left if _event_predecessors(each)] or known))


def empty(con: duckdb.DuckDBPyConnection) -> None:
    """Empty `raw`, to read everything again."""
    others = ("packet", "thread", "thread_name", "cpu_return", "interrupt", "kernel_thread")
    for table in (*event_tables(), *others):
        con.execute(f"TRUNCATE raw.{table}")


def event_tables() -> tuple[str, ...]:
    """Return the tables of `raw` that events are read into, without their schema."""
    return tuple(tracepoint.table for tracepoint in load().staged.values())


@contextlib.contextmanager
def writing(con: duckdb.DuckDBPyConnection) -> Iterator[None]:
    """Write staged tables once, without compression, inside this block.

    They are read a few times and dropped: to rewrite or compress them costs more than it saves.
    """
    con.execute("SET force_compression = 'uncompressed'")
    con.execute("SET wal_autocheckpoint = '1TB'")
    yield
    con.execute("RESET force_compression")
    con.execute("RESET wal_autocheckpoint")


def leave(con: duckdb.DuckDBPyConnection) -> None:
    """Let the connection close without a checkpoint of the staged tables.

    This holds for all databases of the connection: the target needs a checkpoint before.
    """
    con.execute("PRAGMA disable_checkpoint_on_shutdown")


def _event_view(tracepoints: Sequence[Tracepoint]) -> str:
    columns = ", ".join(name for name, _ in COMMON_COLUMNS)
    selects = "\nUNION ALL\n".join(
        f"SELECT {columns} FROM raw.{tracepoint.table}" for tracepoint in tracepoints
    )
    return f"CREATE OR REPLACE VIEW staging.event AS\n{selects}"


def _predecessor_view(tracepoints: Sequence[Tracepoint]) -> str:
    columns = ", ".join(name for name, _ in COMMON_COLUMNS)
    selects = "\nUNION ALL\n".join(
        f"SELECT {columns}, '{before.sequence}' AS sequence, {before.column} AS previous_event_id "
        f"FROM raw.{tracepoint.table}"
        for tracepoint in tracepoints
        for before in _event_predecessors(tracepoint)
    )
    return f"CREATE OR REPLACE VIEW staging.predecessor AS\n{selects}"


def _event_predecessors(tracepoint: Tracepoint) -> list[Predecessor]:
    return [each for each in tracepoint.predecessors if each.origin is Origin.EVENT_ID]


def export(con: duckdb.DuckDBPyConnection, directory: Path) -> None:
    """Write all staged tables and views with rows to `directory` as Parquet."""
    found = con.execute(
        "SELECT database_name || '.' || table_name FROM duckdb_tables() "
        "WHERE database_name IN ('raw', 'staging') "
        "UNION ALL SELECT database_name || '.' || view_name FROM duckdb_views() "
        "WHERE database_name IN ('raw', 'staging') AND NOT internal ORDER BY ALL"
    ).fetchall()
    files = {
        f"{name}.parquet": name
        for (name,) in found
        if name not in OF_ALL_EVENTS and con.execute(f"SELECT 1 FROM {name} LIMIT 1").fetchall()
    }
    with replacing_entries(directory, list(files), force=True) as aside:
        for file, name in files.items():
            con.execute(f"COPY {name} TO {literal(str(aside / file))} (FORMAT parquet)")
