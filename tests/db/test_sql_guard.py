"""SQL of users reads no other file and changes none: an attack with all that DuckDB has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import duckdb
import pytest
from support.sql_attack import ALLOWED, SECRET, STATEMENTS, answered, attack, content
from support.thorough import few

import msgflow
from msgflow.db.connection import connect
from msgflow.db.sql_guard import guarded_query
from msgflow.errors import DatabaseError, MsgflowError, QueryError, UsageError

newest = pytest.mark.skipif(
    duckdb.__version__ < "2", reason="attacks with statements of DuckDB 2; DuckDB 1.5 aborts"
)


@pytest.fixture
def place(small_database: Path) -> Path:
    """A database; beside it a file in its spill directory, and some others."""
    directory = small_database.parent
    spill = directory / f"{small_database.name}.tmp"
    spill.mkdir()
    (spill / "duckdb_temp_storage_DEFAULT-0.tmp").write_bytes(b"spilled")
    (directory / "other.csv").write_text(f"text\n{SECRET}\n")
    (directory / "other.json").write_text(f'{{"text": "{SECRET}"}}\n')
    with duckdb.connect(str(directory / "other.duckdb")) as con:
        con.execute(f"CREATE TABLE secret AS SELECT '{SECRET}' AS text")
        con.execute(f"COPY secret TO '{directory / 'other.parquet'}'")
    return small_database


def others(database: Path) -> list[Path]:
    return [path for path in content(database.parent) if path.name.startswith("other.")]


def places(database: Path) -> list[Path]:
    """Return all files of the directory, and some that are not there.

    DuckDB itself lets a connection without external access write to the database, to its log and to
    its spill directory.
    """
    new = [database.with_name(f"{database.name}.wal"), database.parent / "new.csv"]
    return [*content(database.parent), *new, database.parent / f"{database.name}.tmp" / "new"]


@newest
def test_every_type_of_statement_is_in_the_attack() -> None:
    assert set(STATEMENTS) == set(duckdb.StatementType.__members__)
    with duckdb.connect() as con:
        for kind, statements in STATEMENTS.items():
            for statement in statements:
                found = con.extract_statements(statement.format(file="f", directory="d", table="t"))
                assert [one.type.name for one in found] in ([kind], ["CREATE"]), statement


@newest
def test_no_statement_reads_or_changes_another_file(place: Path) -> None:
    before = content(place.parent)
    with msgflow.open_db(place) as database:
        passed = answered(database.sql, attack(places(place), place.parent))
        assert answered(database.sql, attack(places(place), place.parent), limit=None) == passed
        assert not answered(
            database.sql, (f"SELECT 1; {each}" for each in attack(places(place), place.parent))
        )
    # The database and its log may be read.
    own = {each for each in passed if f"'{place}" in each}
    assert passed - own == ALLOWED
    assert not [each for each in own if "COPY" in each]
    assert content(place.parent) == before


@newest
def test_a_with_may_write_though_it_is_a_select() -> None:
    """The reason why a query runs as a subquery: the connection of a lake can be written to."""
    with duckdb.connect() as con:
        con.execute("CREATE TABLE kept AS SELECT 1 AS value")
        statement = "WITH gone AS (DELETE FROM kept RETURNING *) FROM gone"
        assert [each.type.name for each in con.extract_statements(statement)] == ["SELECT"]
        with pytest.raises(duckdb.Error, match="WITH"):
            con.execute(guarded_query(con, statement, "msgflow sql"))
        assert con.execute("FROM kept").fetchall() == [(1,)]
        con.execute(statement)
        assert con.execute("FROM kept").fetchall() == []


@newest
@pytest.mark.thorough
def test_no_function_reads_or_changes_another_file(place: Path) -> None:
    before = content(place.parent)
    with duckdb.connect() as con:
        functions = con.execute(
            "SELECT function_name, bool_or(function_type IN ('table', 'table_macro', 'pragma')), "
            "list_distinct(flatten(list(parameters))) FROM duckdb_functions() GROUP BY ALL"
        ).fetchall()
    assert {"read_csv", "query", "enable_logging"} < {name for name, _, _ in functions}

    def calls() -> Iterator[str]:
        text = place.parent / "other.csv"
        for name, is_of_tables, parameters in functions:
            yield f"""FROM "{name}"()"""
            yield f"""SELECT "{name}"('{text}')"""
            yield f"""SELECT "{name}"('{place}', '{text}')"""
            if is_of_tables:
                yield from (f"""FROM "{name}"('{file}')""" for file in others(place))
                yield f"""FROM "{name}"(['{text}'])"""
                yield f"""FROM "{name}"('{text}', '{text}')"""
                yield f"""FROM "{name}"('{place.parent / "new.csv"}')"""
                yield from (f"""FROM "{name}"("{each}" := '{text}')""" for each in parameters)

    with connect(place, read_only=True) as con:

        def sql(text: str, *, limit: int) -> duckdb.DuckDBPyRelation:
            return con.sql(guarded_query(con, text, "")).limit(limit)

        assert len(answered(sql, calls())) > 100
    assert content(place.parent) == before


FORGED = (
    "CREATE OR REPLACE VIEW main.run AS SELECT * REPLACE ((SELECT content FROM "
    "read_text('{secret}')) AS name) FROM store.run",
    "CREATE OR REPLACE VIEW main.run AS SELECT * REPLACE ((SELECT text FROM '{secret}') AS name)"
    " FROM store.run",
    "CREATE MACRO main.upper(x) AS (SELECT content FROM read_text('{secret}'))",
    "CREATE MACRO main.sum(x) AS (SELECT count(*) FROM force_checkpoint())",
    "CREATE OR REPLACE VIEW main.node AS FROM query('FROM read_text(''{secret}'')')",
)


@pytest.mark.parametrize("forged", few(FORGED, FORGED[0], FORGED[2]))
def test_a_forged_view_or_macro_reaches_no_other_file(place: Path, forged: str) -> None:
    """It can give wrong answers, as forged rows can."""
    with duckdb.connect(str(place)) as con:
        con.execute(forged.format(secret=place.parent / "other.csv"))
    before = content(place.parent)
    with msgflow.open_db(place) as database:
        questions: tuple[Callable[[], object], ...] = (
            database.runs,
            database.findings,
            database.check,
            lambda: database.query("info-nodes", run="all").to_arrow().to_pylist(),
            lambda: database.query("info", run="all").to_arrow().to_pylist(),
            lambda: database.query("topics", where="upper(topic_name) = 'X'"),
            lambda: database.sql("SELECT upper(name), sum(1) FROM run GROUP BY ALL").to_arrow(),
            lambda: database.sql("FROM node").to_arrow(),
        )
        for question in questions:
            try:
                told = str(question())
            except (MsgflowError, duckdb.Error) as error:
                told = str(error)
            assert SECRET not in told
    assert content(place.parent) == before


def test_a_forged_view_that_reads_a_file_is_said(place: Path) -> None:
    with duckdb.connect(str(place)) as con:
        con.execute(FORGED[0].format(secret=place.parent / "other.csv"))
    with msgflow.open_db(place) as database:
        with pytest.raises(DatabaseError, match="a view of the database reads more") as raised:
            database.runs()
        assert "msgflow db upgrade" in str(raised.value.hint)


@pytest.mark.parametrize(
    "statement",
    [
        "FROM run",
        "FROM run;",
        "VALUES (1)",
        "TABLE run",
        "DESCRIBE run",
        "SUMMARIZE run",
        "SHOW TABLES",
        "SHOW ALL TABLES",
        "SELECT name.upper(), random(), uuid(), now(), [x + 1 FOR x IN [1]] FROM run",
        "SELECT count(*) FROM flow_path(NULL, NULL, NULL)",
        "SELECT 1 UNION ALL SELECT 2 ORDER BY ALL LIMIT 50%",
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 3) FROM n",
        "PIVOT run ON name IN ('morning', 'noon') USING count(*)",
        "UNPIVOT (SELECT 1 AS a, 2 AS b) ON a, b",
        "SELECT 1.5::DECIMAL(18, 3), {'a': 1}, MAP {'a': 1}",
        "FROM duckdb_tables() SELECT table_name",
        "SELECT table_name FROM information_schema.tables",
        "EXPLAIN ANALYZE FROM run",
        "EXPLAIN (FORMAT json) FROM run",
        pytest.param("EXPLAIN ANALYZE (FORMAT json) (SELECT 1)", marks=newest),
        "EXPLAIN (SELECT 1) UNION SELECT 2",
        "EXPLAIN ANALYZE(SELECT 1)",
        "/* ümläut */ EXPLAIN -- ;\n SELECT 'ö;' -- the end;",
        "SELECT DISTINCT ON (name) * FROM run QUALIFY row_number() OVER (ORDER BY name) = 1",
        "-- a comment\nSELECT 1 -- at the end",
        "/* é */ SELECT ';' AS \"ü;\" ; ; -- at the end",
        f"SELECT {'(' * 300}1{')' * 300}",
    ],
)
def test_queries_run(small_database: Path, statement: str) -> None:
    with msgflow.open_db(small_database) as database:
        assert len(database.sql(statement)) >= 1
        assert len(database.sql(statement, limit=None)) >= 1


def test_a_query_keeps_its_order_and_its_plan(small_database: Path) -> None:
    query = "SELECT i FROM range(100_000) AS r (i) ORDER BY hash(i)"
    with msgflow.open_db(small_database) as database:
        expected = database.connection.execute(query).fetchall()
        assert [(row["i"],) for row in database.sql(query, limit=None).to_arrow().to_pylist()] == (
            expected
        )
        plan = database.connection.execute(f"EXPLAIN {query}").fetchall()[0][1]
        assert database.sql(f"EXPLAIN {query}").to_arrow()["explain_value"][0].as_py() == plan


@newest
def test_what_is_refused_is_said(small_database: Path) -> None:
    with msgflow.open_db(small_database) as database:
        for statement, message in (
            ("PIVOT run ON name USING count(*)", "PIVOT has to find its columns first"),
            ("SELECT coutn(*) FROM run", "name coutn does not exist"),
            ("UPDATE EXTENSIONS", "not a statement that only reads"),
            ("DROP TABLE store.run", "not a statement that only reads — DROP"),
            ("EXPLAIN DELETE FROM store.run", "not a statement that only reads — EXPLAIN"),
            (
                "WITH x AS (DELETE FROM store.run RETURNING *) FROM x",
                "not a statement that only reads — WITH",
            ),
            # DuckDB runs neither as a part of a SELECT.
            ("PRAGMA version", "not a statement that only reads — PRAGMA"),
            ("CALL pragma_version()", "not a statement that only reads — CALL"),
            ("SELECT 1; SELECT 2", "one query at a time — 2 statements"),
        ):
            with pytest.raises(QueryError, match=message) as raised:
                database.sql(statement)
            assert raised.value.hint
        with pytest.raises(UsageError, match="there is no SQL to run"):
            database.sql("-- nothing")


def test_a_variable_of_python_is_no_table(small_database: Path) -> None:
    import pyarrow

    some_rows = pyarrow.table({"a": [1]})
    with msgflow.open_db(small_database) as database, pytest.raises(QueryError, match="some_rows"):
        database.sql("FROM some_rows")
    assert some_rows.num_rows == 1


def test_an_opened_database_has_no_unfinished_result(small_database: Path) -> None:
    """DuckDB would refuse the next query on its connection."""
    with msgflow.open_db(small_database) as database:
        assert database.connection.sql("SELECT 1").fetchall() == [(1,)]
