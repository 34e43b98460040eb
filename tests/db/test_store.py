"""A run is copied from staging into the tables of a database, with its ids after what is there."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest

from msgflow.db import store
from msgflow.db.tables import STORE


@pytest.fixture
def con(fresh_database: Path) -> duckdb.DuckDBPyConnection:
    """A database, and staging with takes 3, 1 and 2."""
    con = duckdb.connect(str(fresh_database))
    con.execute("ATTACH ':memory:' AS staging")
    # As an ingest has it: order is kept only where it is asked for.
    con.execute("SET preserve_insertion_order = false")
    columns = ", ".join(
        f'"{column.name}" {column.type}'
        for column in STORE.tables["store.take"].columns
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


@pytest.mark.parametrize(("enough", "first"), [(4, [3, 1, 2]), (3, [1, 2, 3])])
def test_many_rows_are_put_in_order(
    con: duckdb.DuckDBPyConnection, monkeypatch: pytest.MonkeyPatch, enough: int, first: list[int]
) -> None:
    """In any order, what is stored takes far more room; to sort few rows costs more."""
    monkeypatch.setattr(store, "_ROWS_WORTH_ORDERING", enough)
    store.store(con, 1)
    assert stored(con) == first
    store.store(con, 2)
    assert stored(con) == [*first, *(take_id + 3 for take_id in first)]
