"""Ingest into a database in memory, run after run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import duckdb
import pytest

from msgflow import trace
from msgflow.clocks.clocks_file import read_clock_sync
from msgflow.ingest.repeated_in_memory import database_in_memory, ingest_again
from msgflow.schema import store
from msgflow_sim import simulate

# It says when it was made.
_OF_THE_MOMENT = {"run"}


def ingested(con: duckdb.DuckDBPyConnection, path: Path) -> dict[str, list[Any]]:
    """Ingest a trace, and return the rows of all tables with runs."""
    with trace.open([path]) as traces:
        ingest_again(
            con, traces, "run", links=None, clocks=read_clock_sync("none"), leave_out=print
        )
    return {
        table.name: con.execute(f"FROM {table.fullname} ORDER BY ALL").fetchall()
        for table in store.tables.values()
        if "run_id" in table.columns and table.name not in _OF_THE_MOMENT
    }


def identities(con: duckdb.DuckDBPyConnection) -> dict[str, int]:
    """Return the number that DuckDB gave each staged table when it was made."""
    rows = con.execute(
        "SELECT table_name, table_oid FROM duckdb_tables() WHERE database_name = 'staging'"
    ).fetchall()
    return dict(rows)


@pytest.mark.thorough
def test_a_run_leaves_nothing_to_the_next(tmp_path: Path) -> None:
    calls = simulate("calls", tmp_path / "calls", factor=0.1, layout="rolling").directory
    pipeline = simulate("pipeline", tmp_path / "pipeline", factor=0.1).directory
    with database_in_memory() as con, database_in_memory() as fresh:
        first = ingested(con, calls)
        second = ingested(con, pipeline)
        assert second == ingested(fresh, pipeline)
        assert ingested(con, calls) == first
    assert first["request"]
    assert not second["request"]
    assert second["publication"]


@pytest.mark.thorough
def test_tables_that_stay_empty_are_not_made_again(tmp_path: Path) -> None:
    path = simulate("pipeline", tmp_path / "trace", factor=0.1).directory
    with database_in_memory() as con:
        ingested(con, path)
        before = identities(con)
        ingested(con, path)
        after = identities(con)
    kept = {name for name, identity in before.items() if after[name] == identity}
    assert {"client_event", "service_event", "annotation", "near_gap"} <= kept
    assert "callback" not in kept
