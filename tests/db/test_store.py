"""A run is copied from staging into the tables of a database, with its ids after what is there."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest

from msgflow.db import store
from msgflow.db.store_table import store_tables


@pytest.fixture
def con(fresh_database: Path) -> duckdb.DuckDBPyConnection:
    """A database, and staging with takes 3, 1 and 2."""
    con = duckdb.connect(str(fresh_database))
    con.execute("ATTACH ':memory:' AS staging")
    # As an ingest has it: order is kept only where it is asked for.
    con.execute("SET preserve_insertion_order = false")
    columns = ", ".join(
        f'"{column.name}" {column.type}'
        for column in store_tables()["take"].columns.values()
        if column.name != "run_id"
    )
    con.execute(f"CREATE TABLE staging.take ({columns})")
    con.execute(
        "INSERT INTO staging.take (take_id, trace_id, process_id, thread_id, taken_ns, method, "
        "start_event_id, end_event_id, is_loss_affected) "
        "SELECT unnest([3, 1, 2]), 1, 1, 1, 0, 'rmw', 1, 1, false"
    )
    return con


def stored(con: duckdb.DuckDBPyConnection) -> list[int]:
    rows = con.execute("SELECT take_id FROM store.take ORDER BY rowid").fetchall()
    return [take_id for (take_id,) in rows]


def test_rows_are_stored_in_order_of_their_ids(con: duckdb.DuckDBPyConnection) -> None:
    store.store(con, 1)
    assert stored(con) == [1, 2, 3]
    store.store(con, 2)
    assert stored(con) == [1, 2, 3, 4, 5, 6]
