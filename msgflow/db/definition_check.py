"""Definition check: tables, views and macros of a database are those of this msgflow.

Commands that write check this first, since they would run changed views, macros and triggers.
DuckDB prints definitions in its own words, and prints those of a file differently from those just
created. Hence the check compares the definitions with those of a new file.
"""

from __future__ import annotations

import shlex
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import duckdb

from msgflow.db.empty_database import write_empty
from msgflow.errors import DatabaseError

if TYPE_CHECKING:
    from collections.abc import Mapping

# Keys are left out: their place in the statement differs, and they hold no SQL.
_RENDERED = r"""
SELECT 'view ' || schema_name || '.' || view_name AS name, sql
FROM duckdb_views()
WHERE NOT internal AND database_name = current_database()
    AND schema_name IN ('store', 'main', 'derive')
UNION ALL
SELECT
    'macro ' || schema_name || '.' || function_name,
    string_agg(
        concat_ws(chr(0), function_type, parameters::VARCHAR, macro_definition), chr(0)
        ORDER BY function_type, parameters::VARCHAR, macro_definition
    )
FROM duckdb_functions()
WHERE NOT internal AND database_name = current_database()
    AND schema_name IN ('store', 'main', 'derive')
GROUP BY schema_name, function_name
UNION ALL
SELECT
    'table ' || schema_name || '.' || table_name,
    regexp_replace(sql, ',? PRIMARY KEY(\([^)]*\))?', '', 'g')
FROM duckdb_tables()
WHERE database_name = current_database() AND schema_name IN ('store', 'main', 'derive')
    AND table_name <> 'alembic_version'
UNION ALL
SELECT 'trigger ' || schema_name || '.' || trigger_name, coalesce(sql, '')
FROM duckdb_triggers()
WHERE database_name = current_database()
UNION ALL
SELECT 'type ' || schema_name || '.' || type_name, ''
FROM duckdb_types()
WHERE NOT internal AND database_name = current_database()
    AND schema_name IN ('store', 'main', 'derive')
"""


def definitions(con: duckdb.DuckDBPyConnection) -> dict[str, str]:
    """Return the definitions in the current database by kind and name; read none of its tables."""
    return dict(con.execute(_RENDERED).fetchall())


def require_ours(con: duckdb.DuckDBPyConnection, path: Path) -> None:
    """Raise unless tables, views and macros are those of this msgflow."""
    _require(definitions(con), expected_definitions(), path)


def require_tables(
    con: duckdb.DuckDBPyConnection, path: Path, wanted: Mapping[str, str] | None = None
) -> None:
    """Raise unless tables are as they should be; an upgrade makes views and macros anew."""
    found, wanted = (
        {name: text for name, text in each.items() if not name.startswith(("view", "macro"))}
        for each in (definitions(con), wanted or expected_definitions())
    )
    _require(found, wanted, path)


def _require(found: Mapping[str, str], wanted: Mapping[str, str], path: Path) -> None:
    if found == wanted:
        return
    names = sorted(name for name in {**found, **wanted} if found.get(name) != wanted.get(name))
    name = min(names, key=lambda name: name.startswith(("view", "macro")))
    how = (
        "lacks a" if name not in found else "has a foreign" if name not in wanted else "has another"
    )
    # An upgrade makes views and macros anew, but not the rest.
    can_upgrade = name.startswith(("view", "macro"))
    raise DatabaseError(
        f"the database is not as msgflow makes it: it {how} {name} — {path}",
        f"msgflow db upgrade --db {shlex.quote(str(path))} makes views and macros anew"
        if can_upgrade
        else "ingest the traces into a new file",
    )


@cache
def expected_definitions() -> Mapping[str, str]:
    """Return the definitions that a database of this msgflow has, by kind and name."""
    with tempfile.TemporaryDirectory(prefix="msgflow-") as directory:
        path = Path(directory) / "new.duckdb"
        write_empty(path)
        with duckdb.connect(str(path), read_only=True) as con:
            return definitions(con)
