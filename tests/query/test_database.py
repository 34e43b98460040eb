from __future__ import annotations

import shutil
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import duckdb
import pytest
from support.thorough import few

import msgflow
from msgflow import DatabaseError, QueryError, UsageError
from msgflow.db.store_table import store_tables

NOTHING = ("NULL", "NULL")
EXTREMES = {
    "BIGINT": (str(-(2**63)), str(2**63 - 1)),
    "INTEGER": (str(-(2**31)), str(2**31 - 1)),
    "DOUBLE": ("'inf'::DOUBLE", "'nan'::DOUBLE"),
    "VARCHAR": ("chr(27) || '[31m' || chr(8232)", "''"),
}


def test_the_public_names_are_there() -> None:
    for name in msgflow.__all__:
        assert getattr(msgflow, name) is not None
    assert dir(msgflow) == sorted(msgflow.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = msgflow.nothing


def test_asking_a_database(small_database: Path) -> None:
    with msgflow.open_db(small_database) as database:
        assert [run.name for run in database.runs()] == ["morning", "noon"]
        topics = database.query("topics")
        assert topics.to_arrow()["topic_name"].to_pylist() == ["/chatter"]
        assert [run.name for run in topics.runs] == ["noon"]
        both = database.query("topics", run="all", internal=True)
        assert len(both) == 3
        assert "topics" in [header.name for header in database.list_queries()]


def test_sql_is_read_only_and_shut_in(small_database: Path, tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    refused = (
        "DROP TABLE store.run",
        "UPDATE store.run SET name = 'x'",
        f"COPY (SELECT 1) TO '{target}'",
        f"SELECT * FROM read_text('{__file__}')",
        f"ATTACH '{tmp_path / 'other.duckdb'}' AS other",
        "SET enable_external_access = true",
        "SET threads = 1",
        "INSTALL httpfs",
    )
    with msgflow.open_db(small_database) as database:
        for statement in refused:
            with pytest.raises(QueryError):
                database.sql(statement)
        assert [run.name for run in database.runs()] == ["morning", "noon"]
    assert not target.exists()


def test_sql_takes_one_query_and_says_what_it_cut(small_database: Path) -> None:
    with msgflow.open_db(small_database) as database:
        assert database.sql("SELECT 1 AS a; -- end").to_arrow().to_pylist() == [{"a": 1}]
        with pytest.raises(QueryError, match="one query at a time"):
            database.sql("SELECT 1 AS a; SELECT 2 AS b")
        assert database.sql("FROM range(10)", limit=10).notes == []
        cut = database.sql("FROM range(10)", limit=9)
        assert len(cut) == 9
        assert cut.notes == ["only the first 9 rows are shown; --limit raises that"]
        assert len(database.sql("FROM range(20000)", limit=None)) == 20_000
        assert len(database.sql("FROM range(20000)")) == 10_000


def test_sql_errors_keep_what_helps(small_database: Path) -> None:
    with msgflow.open_db(small_database) as database:
        with pytest.raises(QueryError) as raised:
            database.sql("SELECT * FROM publishr")
        assert raised.value.message == (
            "Table with name publishr does not exist\n"
            "LINE 1: SELECT * FROM publishr\n"
            "                      ^^^^^^^^"
        )
        assert "publisher" in str(raised.value.hint)
        with pytest.raises(QueryError, match="LINE 1: selec 1"):
            database.sql("selec 1")
        with pytest.raises(QueryError, match="Could not convert"):
            database.sql("SELECT CAST(full_name AS BIGINT) FROM node")
        with pytest.raises(UsageError, match="no SQL to run"):
            database.sql(" ; ")


@pytest.mark.parametrize("explained", ["", "EXPLAIN "])
@pytest.mark.parametrize("lines", [0, 1, 9])
def test_an_error_is_in_the_line_that_its_author_counts(
    small_database: Path, explained: str, lines: int
) -> None:
    text = explained + "SELECT" + lines * "\n" + " nothing FROM run"
    with msgflow.open_db(small_database) as database, pytest.raises(QueryError) as raised:
        database.sql(text)
    _, line, mark = raised.value.message.splitlines()
    assert line.startswith(f"LINE {lines + 1}: ")
    assert line[mark.index("^") : mark.index("^") + 7] == "nothing"


def test_what_needs_more_memory_than_it_may_take_says_so(small_database: Path) -> None:
    all_at_once = "SELECT len(list(range)) AS n FROM range(9000000)"
    with (
        msgflow.open_db(small_database, memory_limit="60MB") as database,
        pytest.raises(QueryError, match=r"more memory is needed .* — the SQL") as raised,
    ):
        database.sql(all_at_once)
    assert "MSGFLOW_MEMORY_LIMIT" in str(raised.value.hint)
    with (
        msgflow.open_db(small_database, memory_limit="60MB") as database,
        pytest.raises(QueryError, match=r"more memory is needed .* — callbacks") as raised,
    ):
        database.query("callbacks-each", where=f"start_ns > ({all_at_once})")
    assert "MSGFLOW_MEMORY_LIMIT" in str(raised.value.hint)


def test_a_limit_that_is_no_amount_is_not_blamed_on_the_file(fresh_database: Path) -> None:
    with (
        msgflow.open_db(fresh_database, memory_limit="plenty") as database,
        pytest.raises(DatabaseError, match="not an amount of memory — plenty") as raised,
    ):
        database.runs()
    assert raised.tb is not None
    # Nor is it left open, half prepared: with other settings it would be refused.
    duckdb.connect(str(fresh_database), config={"threads": 1}).close()


def test_the_schema_is_described(small_database: Path) -> None:
    with msgflow.open_db(small_database) as database:
        rows = database.schema().to_arrow().to_pylist()
    by_column = {(row["view"], row["column"]): row for row in rows}
    assert by_column["node", "node_id"]["type"] == "BIGINT"
    assert all(row["description"] for row in rows)


def test_closing_lets_go_of_the_file(small_database: Path) -> None:
    database = msgflow.open_db(small_database)
    assert len(database.runs()) == 2
    database.close()
    database.close()
    assert len(database.runs()) == 2
    database.close()


def test_a_missing_database_is_named_when_it_is_asked(tmp_path: Path) -> None:
    database = msgflow.open_db(tmp_path / "none.duckdb")
    with pytest.raises(DatabaseError, match=r"none\.duckdb"):
        database.runs()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("value", [2**63 - 1, -(2**63)])
def test_values_that_no_recording_has_are_said(small_database: Path, value: int) -> None:
    with duckdb.connect(str(small_database)) as connection:
        connection.execute("UPDATE store.publication SET start_ns = $value", {"value": value})
        connection.execute("UPDATE store.clock SET offset_ns = $value", {"value": value})
    with (
        msgflow.open_db(small_database) as database,
        pytest.raises(DatabaseError, match="values that no recording has: Overflow"),
    ):
        database.flow("/chatter")


@pytest.mark.thorough
@pytest.mark.parametrize("place", few([0, 1], 1))
@pytest.mark.parametrize("table", few(store_tables(), "publication"))
def test_extremes_in_all_columns_are_answered_or_said(
    simulated: Callable[..., Path], tmp_path: Path, table: str, place: int
) -> None:
    path = Path(shutil.copyfile(simulated("pipeline", 0.1), tmp_path / "run.duckdb"))
    with duckdb.connect(str(path)) as connection:
        columns = connection.execute(
            "SELECT column_name, data_type FROM duckdb_columns()"
            " WHERE schema_name = 'store' AND table_name = $table AND column_name <> 'run_id'",
            {"table": table},
        ).fetchall()
        for name, kind in columns:
            # What the table refuses is no such database.
            with suppress(duckdb.Error):
                connection.execute(
                    f"UPDATE store.{table} SET {name} = {EXTREMES.get(kind, NOTHING)[place]}"
                    " WHERE rowid % 3 = 0"
                )
    with msgflow.open_db(path) as database:
        asked: list[Callable[[], object]] = [database.check, database.findings, database.why]
        asked += [partial(database.query, each) for each in ("info", "e2e-latency", "callbacks")]
        writers = database.export_perfetto, database.export_mcap, database.export_folded
        asked += [partial(write, tmp_path / "written") for write in writers]
        for ask in asked:
            with suppress(msgflow.MsgflowError):
                ask()
