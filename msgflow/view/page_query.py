"""Page queries: the SQL below `sql`, whose rows have the shape of a picture, not of an answer.

They are no named queries, because their rows mean nothing without the page: bins as wide as a
pixel, keys of rows, times that count from the begin of the run. They have the same headers, and
read the public views alone. A file of kind 'inline' is put in front of each file that reads it.
"""

from __future__ import annotations

import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb

from msgflow.sql.statement import Statements

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import pyarrow as pa

    from msgflow.sql.value import Value

DIRECTORY = Path(__file__).parent / "sql"
_PAGES = Statements(DIRECTORY)

page_query = _PAGES.header


def run_page_query(
    connection: duckdb.DuckDBPyConnection, name: str, values: Mapping[str, Value]
) -> pa.Table:
    """Return the rows of a page query; see `Statements.run`."""
    return _PAGES.run(connection, name, values).to_arrow_table()


class Scratch:
    """Tables in memory, beside the database: what is computed once per run and asked often."""

    def __init__(self) -> None:
        self._connection = duckdb.connect(":memory:")
        self._connection.execute(
            "CREATE TABLE flow (run_id BIGINT, path_id BIGINT, root_kind VARCHAR, root_id BIGINT,"
            " root_at BIGINT, take_id BIGINT, latency BIGINT, status VARCHAR,"
            " is_loss_affected BOOLEAN)"
        )
        self._connection.execute(
            "CREATE TABLE level (run_id BIGINT, row_key BIGINT, kind UTINYINT, id BIGINT,"
            " start_at BIGINT, length BIGINT, flags UTINYINT, count BIGINT, busy BIGINT)"
        )
        self._locks: dict[tuple[str, int], threading.Lock] = {}
        self._filled: set[tuple[str, int]] = set()
        self._guard = threading.Lock()

    def fill(self, table: str, run_id: int, read: Callable[[], pa.Table]) -> None:
        """Put the rows of a run into a table, unless they are there."""
        key = (table, run_id)
        with self._guard:
            lock = self._locks.setdefault(key, threading.Lock())
        with lock:
            if key in self._filled:
                return
            rows = read()
            with self._connection.cursor() as cursor:
                cursor.register("incoming", rows)
                cursor.execute(
                    f"INSERT INTO {table} BY NAME SELECT $run::BIGINT AS run_id, * FROM incoming",
                    {"run": run_id},
                )
            self._filled.add(key)

    def ask(self, name: str, values: Mapping[str, Any]) -> pa.Table:
        """Return the rows of a page query over these tables."""
        with self._connection.cursor() as cursor:
            return run_page_query(cursor, name, values)

    def close(self) -> None:
        """Free the memory."""
        self._connection.close()
