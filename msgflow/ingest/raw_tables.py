"""Tables of `raw`: rows wait here until there are enough of them to insert."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.ingest.catalogue import load
from msgflow.sql.statement import internal_sql
from msgflow.trace import PACKET

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.ingest.sequences import Placed

# Rows that wait for a commit take memory that nothing limits.
_ROWS_PER_TRANSACTION = 2_000_000
# A row group of DuckDB: fewer rows at once cost more each.
ROWS_PER_INSERT = 122_880
# Rows of all tables that wait for an insert.
MOST_WAITING = 500_000


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

    def add_all(self, item: Placed | tuple[str, pa.RecordBatch]) -> None:
        """Add the events of a round, or (table, rows)."""
        if isinstance(item, tuple):
            self.add(*item)
            return
        self.add("thread", item.threads)
        self.add("thread_name", item.thread_names)
        self.add("cpu_return", item.cpu_returns)
        staged = load().staged
        for name, rows in item.batches:
            self.add(staged[name].table, rows)

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
