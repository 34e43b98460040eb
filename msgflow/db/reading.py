"""SQL that anybody may run on a database: statements that read its tables, and nothing else.

DuckDB lets a connection without external access still write to the open database's own file, its
log and its spill directory, by COPY. Hence statements are parsed, by DuckDB itself, and everything
in them has to stand in one of the lists below: what is new in DuckDB is refused until it is added.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import duckdb

from msgflow.db.objects import SCHEMAS, views
from msgflow.errors import QueryError, UsageError
from msgflow.nearest import nearest

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

_NODES = {"SELECT_NODE", "SET_OPERATION_NODE", "RECURSIVE_CTE_NODE", "CTE_NODE"}
_SOURCES = {
    "BASE_TABLE", "SUBQUERY", "JOIN", "TABLE_FUNCTION", "EXPRESSION_LIST", "EMPTY", "PIVOT",
    "SHOW_REF",
}  # fmt: skip
_MODIFIERS = {
    "ORDER_MODIFIER", "LIMIT_MODIFIER", "LIMIT_PERCENT_MODIFIER", "DISTINCT_MODIFIER",
    "ASCENDING", "DESCENDING", "ORDER_DEFAULT",
}  # fmt: skip
_PARTS = _NODES | _SOURCES | _MODIFIERS
# Parameters of types, such as those of DECIMAL(18, 3).
_TYPE_INFO = "_TYPE_INFO"

# Table functions that read no file, set nothing and run no SQL that they are given as text.
_TABLE_FUNCTIONS = {
    "duckdb_columns", "duckdb_constraints", "duckdb_databases", "duckdb_dependencies",
    "duckdb_extensions", "duckdb_functions", "duckdb_indexes", "duckdb_keywords", "duckdb_memory",
    "duckdb_optimizers", "duckdb_schemas", "duckdb_sequences", "duckdb_settings", "duckdb_tables",
    "duckdb_temporary_files", "duckdb_triggers", "duckdb_types", "duckdb_variables",
    "duckdb_views", "generate_series", "icu_calendar_names", "json_each", "json_tree",
    "pg_timezone_names", "pragma_collations", "pragma_database_size", "pragma_metadata_info",
    "pragma_platform", "pragma_show", "pragma_storage_info", "pragma_table_info",
    "pragma_user_agent", "pragma_version", "range", "repeat", "repeat_row", "summary",
    "test_all_types", "unnest",
}  # fmt: skip
# Functions whose result differs from call to call, and that change nothing all the same.
_VOLATILE_FUNCTIONS = {
    "current_connection_id", "current_query", "current_query_id", "current_transaction_id",
    "error", "gen_random_uuid", "random", "setseed", "stats", "uuid", "uuidv4", "uuidv7",
    "vector_type",
}  # fmt: skip
# Binds SQL that it is given as text.
_PLANNING_FUNCTIONS = {"json_serialize_plan"}

_FUNCTIONS = """
SELECT function_name, function_type, has_side_effects OR stability = 'VOLATILE'
FROM duckdb_functions()
WHERE internal
"""
_FOREIGN_SCHEMAS = """
SELECT schema_name FROM duckdb_schemas()
WHERE NOT internal AND database_name = current_database() AND NOT list_contains(?, schema_name)
"""
_PARSED = "SELECT json_serialize_sql(?, skip_null := true, skip_empty := true)"
_CONDITION_HINT = "such as --where \"p99_ns > 80e6 AND node LIKE '%planner'\""
_HINT = "SELECT, FROM, WITH, VALUES, DESCRIBE, SUMMARIZE, SHOW and EXPLAIN of such read"


def reading_statements(
    con: duckdb.DuckDBPyConnection, text: str, schemas: Sequence[str] = SCHEMAS
) -> list[str]:
    """Return the statements in `text`, all of which only read the tables of the database.

    Args:
        con: connection to a current msgflow database, or to one that nobody else has filled.
        text: one or more statements.
        schemas: those of msgflow in it.

    Raises:
        QueryError: one of them might do something else.
        duckdb.Error: no SQL.
    """
    statements = _split(con, text)
    for kind, statement in statements:
        if kind == "EXPLAIN":
            _require_reading(con, _explained(con, statement), kind, schemas)
        else:
            _require_reading(con, statement, kind, schemas)
    return [statement for _, statement in statements]


def require_condition(
    con: duckdb.DuckDBPyConnection, text: str, hint: str = _CONDITION_HINT
) -> None:
    """Raise unless `text` is one expression of SQL that only reads.

    Args:
        con: connection to a current msgflow database, or to one in memory.
        text: what a user gave as a condition.
        hint: an example of one.

    Raises:
        UsageError: it is something else.
    """
    try:
        statements = _split(con, f"SELECT {text}\n")
    except duckdb.Error as error:
        raise UsageError(
            f"--where is no condition in SQL: {str(error).splitlines()[0]}", hint
        ) from error
    except QueryError as error:
        raise UsageError(f"--where is no condition in SQL — {text}", hint) from error
    tree = _parse(con, statements[0][1]) if len(statements) == 1 else None
    if tree is None or not _is_expression(tree["node"]):
        raise UsageError(f"--where is no condition in SQL — {text}", hint)
    if any(part.get("class") == "PARAMETER" for part in _parts(tree)):
        raise UsageError(f"--where takes no parameters — {text}", hint)
    try:
        _require_reading(con, statements[0][1], "SELECT")
    except QueryError as error:
        raise UsageError(f"--where may only read: {error.message}", error.hint) from error


def _is_expression(node: dict[str, Any]) -> bool:
    """Tell whether a query is a SELECT of one expression and nothing else."""
    return (
        node["type"] == "SELECT_NODE"
        and len(node["select_list"]) == 1
        and not node["select_list"][0].get("alias")
        and node["from_table"]["type"] == "EMPTY"
        and not any(
            node.get(key)
            for key in ("where_clause", "group_expressions", "having", "qualify", "modifiers")
        )
        and not node.get("cte_map", {}).get("map")
    )


def _split(con: duckdb.DuckDBPyConnection, text: str) -> list[tuple[str, str]]:
    try:
        return [
            (statement.type.name, statement.query) for statement in con.extract_statements(text)
        ]
    except ValueError as error:  # a kind of statement that Python has no name for
        raise _refused("a kind of statement that msgflow does not know") from error


def _require_reading(
    con: duckdb.DuckDBPyConnection, statement: str, kind: str, schemas: Sequence[str] = SCHEMAS
) -> None:
    """Raise unless a statement is a query, of the parts and functions above only."""
    tree = _parse(con, statement)
    if tree is None:
        if kind == "MULTI":
            raise QueryError(
                "PIVOT has to find its columns first, by creating a type",
                "name them: PIVOT … ON column IN ('a', 'b') USING …",
            )
        raise _refused(kind.replace("_", " "))
    foreign = {
        name.lower() for (name,) in con.execute(_FOREIGN_SCHEMAS, [list(schemas)]).fetchall()
    }
    sources: list[dict[str, Any]] = []
    for part in _parts(tree):
        what = part.get("type")
        if isinstance(what, str) and "class" not in part:
            if what not in _PARTS and not what.endswith(_TYPE_INFO):
                raise _refused(what.removesuffix("_NODE").replace("_", " "))
            if what == "BASE_TABLE":
                _require_table(part)
            if what == "TABLE_FUNCTION":
                _require_function(part["function"]["function_name"], _functions().of_tables)
                sources.append(part["function"])
        if isinstance(name := part.get("function_name"), str) and not any(
            part is s for s in sources
        ):
            _require_function(name, _functions().of_values)
        for name in part.get("qualified_name", {}).get("path", ())[:-1]:
            if name.lower() in foreign:
                raise QueryError(
                    f"not a schema of msgflow, whose views may do anything — {name}",
                    "open the database with DuckDB to read it",
                )


def _parse(con: duckdb.DuckDBPyConnection, statement: str) -> dict[str, Any] | None:
    """Return the syntax tree of a query, None where the statement is none."""
    try:
        tree = json.loads(con.execute(_PARSED, [statement]).fetchall()[0][0])
    except RecursionError as error:
        raise QueryError("the statement is nested too deeply", "use WITH") from error
    if tree["error"] or len(tree["statements"]) != 1:
        return None
    return dict(tree["statements"][0])


def _explained(con: duckdb.DuckDBPyConnection, statement: str) -> str:
    """Return what an EXPLAIN explains: behind the word, ANALYZE, and options in parentheses."""
    starts = [start for start, kind in duckdb.tokenize(statement) if kind.name != "comment"]
    at = 1
    if re.match(r"ANALYZE\b", statement[starts[at] :], re.IGNORECASE):
        at += 1
    if statement[starts[at]] == "(" and _parse(con, statement[starts[at] :]) is None:
        at += 1 + next(n for n, start in enumerate(starts[at:]) if statement[start] == ")")
    return statement[starts[at] :]


def _parts(tree: Any) -> Iterator[dict[str, Any]]:
    """Yield every object of a syntax tree."""
    left = [tree]
    while left:
        part = left.pop()
        if isinstance(part, dict):
            yield part
            left.extend(part.values())
        elif isinstance(part, list):
            left.extend(part)


def _require_table(part: dict[str, Any]) -> None:
    # A name that is no word is looked for among files where no table has it.
    name = str(part.get("table_name", ""))
    if not name.replace("$", "_").isidentifier():
        raise QueryError(f"there is no table of that name — {name}", "msgflow db schema")


def _require_function(name: str, allowed: frozenset[str]) -> None:
    name = name.lower()
    if name in allowed:
        return
    if name in _functions().known:
        raise QueryError(
            f"the function may do more than read this database — {name}",
            "open the database with DuckDB to use it",
        )
    near = nearest(name, sorted(allowed))
    raise QueryError(
        f"there is no such function — {name}",
        f"did you mean {' or '.join(near)}" if near else None,
    )


@dataclass(frozen=True)
class _Functions:
    """Names: of those that only read, in FROM and elsewhere, and of all that there are."""

    of_tables: frozenset[str]
    of_values: frozenset[str]
    known: frozenset[str]


@cache
def _functions() -> _Functions:
    with duckdb.connect() as con:
        found = con.execute(_FUNCTIONS).fetchall()
    ours = {header.name.partition(".")[2] for header in views() if header.kind == "macro"}
    plain = {
        name
        for name, kind, is_volatile in found
        if kind in ("scalar", "aggregate", "window", "macro") and not is_volatile
    }
    return _Functions(
        of_tables=frozenset(_TABLE_FUNCTIONS | ours),
        of_values=frozenset(
            (plain | ours | {"unnest"} | _VOLATILE_FUNCTIONS) - _PLANNING_FUNCTIONS
        ),
        known=frozenset(name for name, _, _ in found),
    )


def _refused(what: str) -> QueryError:
    return QueryError(f"not a statement that only reads — {what}", _HINT)
