"""Rows wait until there are enough of them for the database, but not too many."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pyarrow as pa
import pytest

from msgflow.ingest import staging
from msgflow.ingest.staging import RawTables


@pytest.fixture
def con() -> duckdb.DuckDBPyConnection:
    """Tables `a` to `d` of `raw`."""
    con = duckdb.connect()
    con.execute("ATTACH ':memory:' AS raw")
    for table in "abcd":
        con.execute(f"CREATE TABLE raw.{table} (n BIGINT)")
    con.begin()
    return con


def counts(con: duckdb.DuckDBPyConnection) -> list[int]:
    rows = (con.execute(f"SELECT count(*) FROM raw.{table}").fetchall() for table in "abcd")
    return [count for ((count,),) in rows]


def rows(count: int) -> pa.RecordBatch:
    return pa.record_batch({"n": pa.array(range(count))})


@pytest.fixture(autouse=True)
def few_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    """100 rows are enough, and 150 are too many."""
    monkeypatch.setattr("msgflow.ingest.staging.ROWS_PER_INSERT", 100)
    monkeypatch.setattr("msgflow.ingest.staging.MOST_WAITING", 150)


def raw_tables(con: duckdb.DuckDBPyConnection) -> RawTables:
    return RawTables(con, may_hold=False, may_replace=False)


def test_rows_wait_for_more(con: duckdb.DuckDBPyConnection) -> None:
    tables = raw_tables(con)
    tables.add("a", rows(60))
    assert counts(con) == [0, 0, 0, 0]
    tables.add("b", rows(60))
    tables.add("a", rows(40))
    assert counts(con) == [100, 0, 0, 0]
    tables.flush()
    assert counts(con) == [100, 60, 0, 0]
    tables.flush()
    assert counts(con) == [100, 60, 0, 0]


def test_not_too_many_wait(con: duckdb.DuckDBPyConnection) -> None:
    """Those of the table with most of them go first."""
    tables = raw_tables(con)
    for table, count in (("a", 40), ("b", 70), ("c", 40), ("d", 1)):
        tables.add(table, rows(count))
    assert counts(con) == [0, 70, 0, 0]
    tables.flush()
    assert counts(con) == [40, 70, 40, 1]


def test_what_is_staged_is_in_files(tmp_path: Path) -> None:
    """What a database in memory spills is compressed, and some of it stays."""
    with duckdb.connect() as con:
        staging.attach(con, tmp_path)
        places = con.execute(
            "SELECT database_name, path FROM duckdb_databases() WHERE NOT internal ORDER BY ALL"
        ).fetchall()
    assert dict(places)["raw"] == str(tmp_path / "raw.duckdb")
    assert dict(places)["staging"] == str(tmp_path / "staging.duckdb")
