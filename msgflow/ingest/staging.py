"""Staging: the events as read and the tables of the model, until they are stored.

`raw` and `staging` are temporary database files. A database in memory would have to compress what
it spills, and keep the beginning of each column of each row group. `raw` has one table per
tracepoint, and with `staging` what `schema/staging.sql` has. Views of `staging` are `event` (all
events of the user and of known tracepoints, but those of the kernel, without payload) and
`predecessor` (the pointers from event to event).
"""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import duckdb
import pyarrow as pa

from msgflow.db.transaction import transaction
from msgflow.errors import UsageError
from msgflow.files.atomic_directory import replacing_entries
from msgflow.files.resources import resource_directory
from msgflow.ingest.catalogue import COMMON_COLUMNS, Tracepoint, load
from msgflow.sql.quoting import literal
from msgflow.sql.statement import internal_sql, registered
from msgflow.trace import PACKET

# Rows that wait for a commit take memory that nothing limits.
_ROWS_PER_TRANSACTION = 2_000_000
# A row group of DuckDB: fewer rows at once cost more each.
ROWS_PER_INSERT = 122_880
# Rows of all tables that wait for an insert.
MOST_WAITING = 500_000

_COLUMNS = ", ".join(name for name, _ in COMMON_COLUMNS)
# Views of all events, which unite the tables of all tracepoints.
OF_ALL_EVENTS = {"staging.event", "staging.predecessor"}


def attach(con: duckdb.DuckDBPyConnection, directory: Path | None) -> None:
    """Attach `raw`, with an empty table per tracepoint, and `staging`."""
    for name in ("raw", "staging"):
        path = ":memory:" if directory is None else str(directory / f"{name}.duckdb")
        # Staged tables are of no use after a crash.
        con.execute(f"ATTACH {literal(path)} AS {name} (RECOVERY_MODE no_wal_writes)")
    catalogue = load()
    with transaction(con):  # a commit after each would take longer than the table
        for each in catalogue.staged.values():
            con.execute(each.create_table_sql("raw", catalogue))
    text = (resource_directory("schema") / "staging.sql").read_text(encoding="utf-8")
    # One by one: what looks at a statement before it runs, such as EXPLAIN, sees it.
    for statement in con.extract_statements(text):
        con.execute(statement)


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
    events = [f"SELECT {_COLUMNS} FROM raw.{each.table}" for each in left or known]
    pointers = _predecessors(left) or _predecessors(known)
    for view, selects in (("event", events), ("predecessor", pointers)):
        rows = "\nUNION ALL\n".join(selects)
        con.execute(f"CREATE OR REPLACE VIEW staging.{view} AS\n{rows}")


def _predecessors(tracepoints: Sequence[Tracepoint]) -> list[str]:
    return [
        f"SELECT {_COLUMNS}, '{before.sequence}' AS sequence, {before.column} AS previous_event_id "
        f"FROM raw.{tracepoint.table}"
        for tracepoint in tracepoints
        for before in tracepoint.predecessors
        if before.origin == "event_id"
    ]


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


class RawTables:
    """The tables of `raw`, filled inside a transaction that is committed now and then.

    Rows wait until there are enough of them, or `flush` is called.
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
        # Ids of the runs that hold some of the packets added already.
        self.replaced: set[int] = set()

    def add(self, table: str, rows: pa.RecordBatch) -> None:
        """Add rows to a table."""
        if table == PACKET and self._may_hold:
            self.replaced |= self._same_packets(rows)
        self._waiting.setdefault(table, []).append(rows)
        self._counts[table] = self._counts.get(table, 0) + rows.num_rows
        if self._counts[table] >= ROWS_PER_INSERT:
            self._insert(table)
        elif sum(self._counts.values()) > MOST_WAITING:
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
        with registered(self._con, packet_batch=rows):
            runs = self._con.execute(internal_sql().text("known_packet")).fetchall()
        if runs and not self._may_replace:
            raise UsageError(
                f"these packets are in the database already — run {runs[0][1]} ({runs[0][0]})",
                "give --replace to read them again in place of that run",
            )
        return {run_id for run_id, _ in runs}
