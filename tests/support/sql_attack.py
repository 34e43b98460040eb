"""An attack with SQL: statements of every kind that would read or change a file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import duckdb

from msgflow.errors import MsgflowError
from msgflow.result.query_result import QueryResult

SECRET = "a secret of another file"
# By type: statements of it, with places for a file; what is of no use outside of DuckDB is empty.
STATEMENTS = {
    "INVALID": [],
    "SELECT": [
        "SELECT 1",
        "SELECT 1; -- the end",
        "WITH gone AS (DELETE FROM {table} RETURNING *) SELECT * FROM gone",
        "WITH made AS (INSERT INTO {table} SELECT * FROM {table} RETURNING *) FROM made",
        "WITH new AS (UPDATE {table} SET name = 'x' RETURNING *) FROM new",
        "WITH x AS (COPY (SELECT 1) TO '{file}') FROM x",
        "WITH x AS (COPY (SELECT 1) TO '{file}' (FORMAT csv, USE_TMP_FILE false)) FROM x",
        "(WITH x AS (COPY (SELECT 1) TO '{file}') FROM x)",
        "WITH x AS (COPY (SELECT 1) TO '{file}') (FROM x) UNION SELECT 1",
        "WITH x AS (COPY (SELECT 1) TO '{file}') VALUES (1)",
        "SELECT * FROM (WITH x AS (COPY (SELECT 1) TO '{file}') FROM x)",
        "DESCRIBE WITH x AS (COPY (SELECT 1) TO '{file}') FROM x",
        "SUMMARIZE WITH x AS (COPY (SELECT 1) TO '{file}') FROM x",
        "FROM query('WITH x AS (COPY (SELECT 1) TO ''{file}'') FROM x')",
        "FROM query('COPY (SELECT 1) TO ''{file}''')",
        "FROM query('DELETE FROM {table}')",
        "FROM query_table('{file}')",
        "SELECT * FROM '{file}'",
        "SELECT * FROM 'some.csv'",
        "SELECT getenv('HOME')",
        "FROM glob('{directory}/*')",
        "FROM read_csv('{directory}/*')",
        "FROM enable_logging(storage := 'file', storage_path := '{directory}')",
        "FROM enable_profiling(save_location := '{file}')",
        "FROM json_execute_serialized_sql(json_serialize_sql('FROM read_text(''{file}'')'))",
    ],
    "INSERT": ["INSERT INTO {table} SELECT * FROM {table}"],
    "UPDATE": ["UPDATE {table} SET name = 'x'"],
    "CREATE": [
        "CREATE TABLE made AS SELECT 1",
        "CREATE TEMP TABLE made AS SELECT 1",
        "CREATE TEMP VIEW made AS SELECT 1",
        "CREATE SECRET made (TYPE s3)",
        "CREATE PERSISTENT SECRET made (TYPE s3)",
        "CREATE SEQUENCE made",
        "CREATE TYPE made AS ENUM ('a')",
    ],
    "DELETE": ["DELETE FROM {table}", "TRUNCATE {table}"],
    "PREPARE": [
        "PREPARE stored AS COPY (SELECT 1) TO '{file}'",
        "PREPARE stored AS FROM read_text('{file}')",
    ],
    "EXECUTE": ["EXECUTE stored"],
    "ALTER": ["ALTER TABLE {table} RENAME TO other", "COMMENT ON TABLE {table} IS 'x'"],
    "TRANSACTION": ["BEGIN", "COMMIT", "ROLLBACK"],
    "COPY": [
        "COPY (SELECT 1) TO '{file}'",
        "COPY (SELECT 'x' AS text) TO '{file}' (FORMAT csv, HEADER false, QUOTE '')",
        "COPY (SELECT 1) TO '{file}' (FORMAT parquet)",
        "COPY (SELECT 1) TO '{file}' (FORMAT json)",
        "COPY {table} FROM '{file}'",
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
        "EXPLAIN ANALYZE DELETE FROM {table}",
        "EXPLAIN ANALYZE INSERT INTO {table} FROM {table}",
        "EXPLAIN ANALYZE WITH x AS (DELETE FROM {table} RETURNING *) FROM x",
        "EXPLAIN ANALYZE WITH x AS (COPY (SELECT 1) TO '{file}') FROM x",
        "EXPLAIN (ANALYZE) WITH x AS (COPY (SELECT 1) TO '{file}') FROM x",
        "EXPLAIN PRAGMA table_info('run')",
        "EXPLAIN EXECUTE stored",
    ],
    "DROP": ["DROP VIEW main.run", "DEALLOCATE stored"],
    "EXPORT": ["EXPORT DATABASE '{directory}'"],
    "PRAGMA": [
        "PRAGMA enable_profiling",
        "PRAGMA database_list",
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
    "DETACH": ["DETACH msgflow"],
    "MULTI": ["PIVOT {table} ON name USING count(*)"],
    "COPY_DATABASE": [],
    "MERGE_INTO": ["MERGE INTO {table} USING {table} AS s ON true WHEN MATCHED THEN DELETE"],
}
ALLOWED = {"SELECT 1", "SELECT 1; -- the end", "EXPLAIN SELECT 1"}


def attack(
    files: Iterable[Path],
    directory: Path,
    table: str = "store.run",
    kinds: Iterable[str] = STATEMENTS,
) -> Iterator[str]:
    """Yield every statement of these kinds, with each of these files."""
    for kind in kinds:
        for statement in STATEMENTS[kind]:
            for file in list(files) if "{file}" in statement else [directory]:
                yield statement.format(file=file, directory=directory, table=table)


def content(directory: Path) -> dict[Path, bytes]:
    """Return the content of all files below a directory."""
    return {path: path.read_bytes() for path in directory.rglob("*") if path.is_file()}


def answered(
    sql: Callable[..., QueryResult | duckdb.DuckDBPyRelation],
    statements: Iterable[str],
    limit: int | None = 20,
) -> set[str]:
    """Return the statements that are answered; the secret is in no answer."""
    passed = set()
    for statement in statements:
        try:
            rows = sql(statement, limit=limit)
            table = rows.to_arrow() if isinstance(rows, QueryResult) else rows.to_arrow_table()
        except (MsgflowError, duckdb.Error) as error:
            told = str(error).encode()
        else:
            told = b"".join(
                buffer.to_pybytes()
                for column in table.columns
                for chunk in column.chunks
                for buffer in chunk.buffers()
                if buffer is not None
            )
            passed.add(statement)
        assert SECRET.encode() not in told, statement
    return passed
