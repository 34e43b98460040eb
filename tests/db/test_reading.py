"""`Database.sql` reads, whatever is asked of it: every file stays as it is, byte for byte."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest

import msgflow
from msgflow.db import objects
from msgflow.db.reading import (
    _TABLE_FUNCTIONS,
    _VOLATILE_FUNCTIONS,
    reading_statements,
)
from msgflow.errors import QueryError
from msgflow.query.catalogue import load_queries

# By type: statements of it, with places for a file; what is of no use outside of DuckDB is empty.
STATEMENTS = {
    "INVALID": [],
    "SELECT": [
        "SELECT 1",
        "WITH gone AS (DELETE FROM store.run RETURNING *) SELECT * FROM gone",
        "WITH made AS (INSERT INTO store.run SELECT * FROM store.run RETURNING *) FROM made",
        "SELECT * FROM '{file}'",
        "SELECT * FROM 'some.csv'",
    ],
    "INSERT": ["INSERT INTO store.run SELECT * FROM store.run"],
    "UPDATE": ["UPDATE store.run SET name = 'x'"],
    "CREATE": [
        "CREATE TABLE made AS SELECT 1",
        "CREATE TEMP VIEW made AS SELECT 1",
        "CREATE SECRET made (TYPE s3)",
        "CREATE PERSISTENT SECRET made (TYPE s3)",
        "CREATE SEQUENCE made",
        "CREATE TYPE made AS ENUM ('a')",
    ],
    "DELETE": ["DELETE FROM store.run", "TRUNCATE store.run"],
    "PREPARE": ["PREPARE stored AS COPY (SELECT 1) TO '{file}'"],
    "EXECUTE": ["EXECUTE stored"],
    "ALTER": ["ALTER TABLE store.run RENAME TO other", "COMMENT ON TABLE store.run IS 'x'"],
    "TRANSACTION": ["BEGIN", "COMMIT", "ROLLBACK"],
    "COPY": [
        "COPY (SELECT 1) TO '{file}'",
        "COPY (SELECT 'x' AS text) TO '{file}' (FORMAT csv, HEADER false, QUOTE '')",
        "COPY (SELECT 1) TO '{file}' (FORMAT parquet)",
        "COPY (SELECT 1) TO '{file}' (FORMAT json)",
        "COPY store.run FROM '{file}'",
    ],
    "ANALYZE": [],
    "VARIABLE_SET": [],
    "CREATE_FUNC": ["CREATE MACRO made() AS 1"],
    "EXPLAIN": [
        "EXPLAIN SELECT 1",
        "EXPLAIN ANALYZE COPY (SELECT 1) TO '{file}'",
        "EXPLAIN (ANALYZE) COPY (SELECT 1) TO '{file}'",
        "EXPLAIN (ANALYZE, FORMAT json) COPY (SELECT 1) TO '{file}'",
        "/* x */ EXPLAIN /* SELECT 1 */ ANALYZE -- SELECT 2\n COPY (SELECT 1) TO '{file}'",
        "EXPLAIN ANALYZE DELETE FROM store.run",
        "EXPLAIN ANALYZE WITH x AS (DELETE FROM store.run RETURNING *) FROM x",
        "EXPLAIN PRAGMA table_info('run')",
    ],
    "DROP": ["DROP VIEW main.run", "DEALLOCATE stored"],
    "EXPORT": ["EXPORT DATABASE '{directory}'"],
    "PRAGMA": [
        "PRAGMA enable_profiling",
        "IMPORT DATABASE '{directory}'",
        "PRAGMA force_checkpoint",
        "COPY FROM DATABASE memory TO other",
    ],
    "VACUUM": ["VACUUM", "ANALYZE"],
    "CALL": [
        "CALL enable_logging(storage := 'file', storage_path := '{directory}')",
        "CALL enable_profiling(save_location := '{file}')",
        "CHECKPOINT",
        "FORCE CHECKPOINT",
    ],
    "SET": ["SET threads = 1", "RESET threads", "SET VARIABLE x = 1", "USE store"],
    "LOAD": ["LOAD '{file}'", "INSTALL '{file}'", "LOAD json"],
    "RELATION": [],
    "EXTENSION": [],
    "LOGICAL_PLAN": [],
    "ATTACH": ["ATTACH '{file}' AS other", "ATTACH '{directory}/new.duckdb' AS other"],
    "DETACH": ["DETACH small"],
    "MULTI": ["PIVOT store.run ON name USING count(*)"],
    "COPY_DATABASE": [],
    "MERGE_INTO": [
        "MERGE INTO store.run USING store.run AS s ON run.run_id = s.run_id"
        " WHEN MATCHED THEN DELETE"
    ],
}
ALLOWED = ("SELECT 1", "EXPLAIN SELECT 1")


@pytest.fixture
def place(small_database: Path) -> Path:
    """The database with a log, files in its spill directory, and some others."""
    directory = small_database.parent
    spill = directory / f"{small_database.name}.tmp"
    spill.mkdir()
    (spill / "duckdb_temp_storage_DEFAULT-0.tmp").write_bytes(b"spilled")
    (directory / "other.csv").write_text("a\n1\n")
    (directory / "other.json").write_text('{"a": 1}\n')
    return small_database


def content(directory: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in directory.rglob("*") if path.is_file()}


def places(database: Path) -> list[Path]:
    """Return the files that DuckDB itself lets a connection without access to others write."""
    spill = database.parent / f"{database.name}.tmp"
    return [
        database,
        database.with_name(f"{database.name}.wal"),
        spill / "duckdb_temp_storage_DEFAULT-0.tmp",
        spill / "new",
        database.parent / "other.csv",
        database.parent / "other.json",
        database.parent / "new.csv",
    ]


def try_all(database: Path, statements: list[str]) -> list[str]:
    """Return the statements that are run; what they do shows in the files."""
    passed = []
    with msgflow.open_db(database) as opened:
        for statement in statements:
            try:
                opened.sql(statement)
                passed.append(statement)
            except QueryError:
                pass
    return passed


def test_every_type_of_statement_is_known() -> None:
    assert set(STATEMENTS) == set(duckdb.StatementType.__members__)
    with duckdb.connect() as con:
        for kind, statements in STATEMENTS.items():
            for statement in statements:
                found = con.extract_statements(statement.format(file="f", directory="d"))
                assert [one.type.name for one in found] in ([kind], ["CREATE"]), statement


def test_only_queries_run_and_no_file_changes(place: Path) -> None:
    before = content(place.parent)
    statements = [
        statement.format(file=file, directory=place.parent)
        for several in STATEMENTS.values()
        for statement in several
        for file in (places(place) if "{file}" in statement else places(place)[:1])
    ]
    assert try_all(place, statements) == list(ALLOWED)
    assert try_all(place, [f"SELECT 1; {statement}" for statement in statements]) == [
        f"SELECT 1; {statement}" for statement in ALLOWED
    ]
    assert content(place.parent) == before


def test_a_copy_into_the_log_would_change_the_database(place: Path) -> None:
    """What the two tests of files are worth: DuckDB alone lets that through."""
    log = place.with_name(f"{place.name}.wal")
    with duckdb.connect(str(place), read_only=True) as con:
        con.execute("SET enable_external_access = false")
        con.execute("SET lock_configuration = true")
        con.execute(f"COPY (SELECT 1) TO '{log}'")
    assert log.exists()


def test_every_function_that_is_not_listed_is_refused(place: Path) -> None:
    before = content(place.parent)
    with duckdb.connect() as con:
        functions = con.execute(
            "SELECT DISTINCT function_name FROM duckdb_functions() "
            "WHERE function_type IN ('table', 'table_macro', 'pragma') OR stability = 'VOLATILE'"
        ).fetchall()
    allowed = _TABLE_FUNCTIONS | _VOLATILE_FUNCTIONS
    others = sorted({name for (name,) in functions} - allowed)
    assert {"read_csv", "read_text", "glob", "query", "enable_logging", "checkpoint"} < set(others)
    statements = [
        form.format(name=f'"{name}"', file=file)
        for name in others
        for file in places(place)[1:2]
        for form in (
            "FROM {name}('{file}')",
            "SELECT {name}('{file}')",
            "EXPLAIN ANALYZE FROM {name}()",
            "WITH x AS (FROM {name}(['{file}'])) FROM x",
            "SELECT 1 WHERE EXISTS (FROM run, LATERAL (FROM main.{name}('{file}')))",
        )
    ]
    # There is an aggregate of that name, too.
    plain = [statement for statement in statements if statement.startswith('SELECT "histogram"(')]
    assert try_all(place, statements) == plain
    assert content(place.parent) == before


def test_the_listed_functions_leave_every_file_alone(place: Path) -> None:
    before = content(place.parent)
    names = sorted(_TABLE_FUNCTIONS | _VOLATILE_FUNCTIONS)
    try_all(
        place,
        [
            f"FROM {name}({argument})"
            for name in names
            for argument in ("", *(f"'{file}'" for file in places(place)[:2]))
        ],
    )
    assert content(place.parent) == before


def test_functions_hidden_in_text_are_refused(place: Path) -> None:
    with msgflow.open_db(place) as database:
        for statement in (
            "FROM query('SELECT 1')",
            "FROM query_table(['run'])",
            "SELECT json_serialize_plan('SELECT 1')",
            "FROM json_execute_serialized_sql(json_serialize_sql('SELECT 1'))",
        ):
            with pytest.raises(QueryError, match="may do more than read"):
                database.sql(statement)


def test_views_of_other_schemas_are_refused(place: Path) -> None:
    with duckdb.connect(str(place)) as con:
        con.execute("CREATE SCHEMA mine; CREATE VIEW mine.v AS FROM force_checkpoint()")
        con.execute("CREATE MACRO mine.sum(x) AS 42")
    with msgflow.open_db(place) as database:
        for statement in ("FROM mine.v", "SELECT MINE.sum(1)"):
            with pytest.raises(QueryError, match="not a schema of msgflow"):
                database.sql(statement)


def test_all_that_msgflow_asks_itself_is_reading(empty_database: Path) -> None:
    """Every construct of our own SQL is in the lists."""
    headers = [
        *load_queries(),
        *(
            header
            for layer in (*objects.VIEW_LAYERS, "health/check", "health/finding")
            for header in objects.load(layer)
            if header.kind != "macro"
        ),
    ]
    with duckdb.connect(str(empty_database), read_only=True) as con:
        for header in headers:
            assert len(reading_statements(con, header.body)) == 1


@pytest.mark.parametrize(
    "statement",
    [
        "FROM run",
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
        "EXPLAIN (SELECT 1) UNION SELECT 2",
        "SELECT DISTINCT ON (name) * FROM run QUALIFY row_number() OVER (ORDER BY name) = 1",
        "-- a comment\nSELECT 1 -- at the end",
    ],
)
def test_queries_run(small_database: Path, statement: str) -> None:
    with msgflow.open_db(small_database) as database:
        assert len(database.sql(statement)) >= 1


def test_what_is_refused_is_said(small_database: Path) -> None:
    with msgflow.open_db(small_database) as database:
        for statement, message in (
            ("PIVOT run ON name USING count(*)", "PIVOT has to find its columns first"),
            ("SELECT coutn(*) FROM run", "no such function — coutn"),
            ("UPDATE EXTENSIONS", "not a statement that only reads"),
            ("DROP TABLE store.run", "not a statement that only reads — DROP"),
            (f"SELECT {'(' * 300}1{')' * 300}", None),
        ):
            if message is None:
                database.sql(statement)
                continue
            with pytest.raises(QueryError, match=message) as raised:
                database.sql(statement)
            assert raised.value.hint


def test_a_variable_of_python_is_no_table(small_database: Path) -> None:
    import pyarrow

    some_rows = pyarrow.table({"a": [1]})
    with msgflow.open_db(small_database) as database, pytest.raises(QueryError, match="some_rows"):
        database.sql("FROM some_rows")
    assert some_rows.num_rows == 1
