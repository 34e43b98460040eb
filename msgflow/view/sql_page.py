"""Data of the SQL page: rows of any query, and what its editor knows."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Protocol

import duckdb
import pyarrow as pa
from pyarrow import compute

from msgflow.errors import UsageError
from msgflow.files.resources import resource_directory
from msgflow.result.query_result import QueryResult
from msgflow.text.json_value import json_text, json_value
from msgflow.view.table_encoding import encode

# As many as `msgflow sql` prints; the most that a browser sorts and draws without a pause.
DEFAULT_ROWS = 1_000
MOST_ROWS = 100_000
# As long as an agent may ask.
MOST_SECONDS = 60.0
# A row per word. Columns have their view and type, macros their parameters as `detail`.
_WORDS = """
WITH view AS (
    SELECT view_name AS name, comment AS description
    FROM duckdb_views()
    WHERE database_name = current_database() AND schema_name = 'main' AND NOT internal
),
view_column AS (
    SELECT
        c.column_name AS name, c.table_name AS view, c.data_type AS type, c.comment AS description
    FROM duckdb_columns() AS c
    JOIN view AS v ON c.table_name = v.name
    WHERE c.database_name = current_database() AND c.schema_name = 'main'
)
SELECT 'view' AS kind, name, NULL::VARCHAR AS view, NULL::VARCHAR AS detail, description
FROM view
UNION ALL
SELECT 'column', name, view, type, description
FROM view_column
UNION ALL
SELECT DISTINCT 'macro', function_name, NULL, array_to_string(parameters, ', '), comment
FROM duckdb_functions()
WHERE database_name = current_database() AND schema_name = 'main' AND NOT internal
UNION ALL
SELECT DISTINCT 'function', function_name, NULL, NULL, NULL
FROM duckdb_functions()
WHERE internal
    AND function_type IN ('scalar', 'aggregate', 'window', 'macro', 'table')
    AND regexp_full_match(function_name, '[a-z][a-z0-9_]*')
UNION ALL
SELECT DISTINCT 'type', lower(logical_type), NULL, NULL, NULL
FROM duckdb_types()
WHERE regexp_full_match(logical_type, '[A-Za-z]+')
UNION ALL
SELECT 'keyword', keyword_name, NULL, NULL, NULL
FROM duckdb_keywords()
-- What names a view or a column is one: 'publication' and 'name' are words of DuckDB too.
WHERE keyword_name NOT IN (SELECT name FROM view UNION ALL SELECT name FROM view_column)
ORDER BY kind, view, name, detail
"""
_EXAMPLE = re.compile(r"^## (?:\d+\. )?(?P<title>.+?)\n(?P<text>[^#].*?)(?=^## |\Z)", re.M | re.S)
_SQL = re.compile(r"^```sql\n(?P<sql>.*?)^```", re.MULTILINE | re.DOTALL)


class Sql(Protocol):
    """A function that runs SQL that a person wrote, one query after the other."""

    def __call__(self, text: str, limit: int) -> QueryResult:
        """Return the rows of a query, `limit` at most; a note says if there are more."""

    def interrupt(self) -> None:
        """End the query that runs."""


def most_rows(params: Mapping[str, Any]) -> int:
    """Return how many rows the page asks for."""
    given = str(params.get("rows", DEFAULT_ROWS))
    if not re.fullmatch(r"\d{1,6}", given) or not 0 < int(given) <= MOST_ROWS:
        raise UsageError(f"rows is a whole number from 1 to {MOST_ROWS} — {given}")
    return int(given)


def encoded_rows(result: QueryResult) -> bytes:
    """Return the rows of a query as bytes.

    Its columns may have any names: they are sent as c0, c1 and so on, and their names besides.
    Values that are no numbers, truth values or text are sent as text.
    """
    table = result.table
    columns = {f"c{at}": _sendable(column) for at, column in enumerate(table.columns)}
    meta = {
        "names": [json_value(name) for name in table.column_names],
        "integers": [pa.types.is_integer(column.type) for column in columns.values()],
        "is_cut": bool(result.notes),
    }
    return encode(pa.table(columns), meta=meta)


def encoded_error(message: str, hint: str | None) -> bytes:
    """Return what is wrong with a query as bytes: an answer too."""
    return encode(pa.table({}), meta={"error": message, "hint": hint})


def words(connection: duckdb.DuckDBPyConnection) -> pa.Table:
    """Return what the editor completes and colours."""
    return connection.sql(_WORDS).to_arrow_table()


def examples() -> pa.Table:
    """Return the examples of the cookbook: title and SQL of each."""
    text = (resource_directory("docs") / "cookbook.md").read_text(encoding="utf-8")
    found = [
        {"title": section["title"], "sql": sql["sql"].strip()}
        for section in _EXAMPLE.finditer(text)
        if (sql := _SQL.search(section["text"]))
    ]
    return pa.Table.from_pylist(found, pa.schema({"title": pa.string(), "sql": pa.string()}))


def _sendable(column: pa.ChunkedArray) -> pa.Array:
    kind = column.type
    array = column.combine_chunks()
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
        return array
    if pa.types.is_decimal(kind):
        # Sums have no fraction, and stay exact: as text, if they are too large for a number.
        with suppress(pa.ArrowInvalid):
            return compute.cast(array, pa.float64() if kind.scale else pa.int64())
        return compute.cast(array, pa.string())
    if pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_dictionary(kind):
        return compute.cast(array, pa.string())
    return pa.array(map(json_text, array.to_pylist()), pa.string())
