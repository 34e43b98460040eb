"""What a database says its tables, views and macros are, compared with what they have to be.

A file from elsewhere can hold any SQL under our names, which would run with the first query. DuckDB
renders definitions its own way, and what it read from a file not as what was just created: hence
they are compared with those of a new file, which are kept in the user's cache.
"""

from __future__ import annotations

import shlex
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import duckdb

from msgflow.db import cache as cache_of_user
from msgflow.db.create import write_new
from msgflow.errors import DatabaseError

if TYPE_CHECKING:
    from collections.abc import Mapping

# By kind and name: the SHA-256 of the definition.
Definitions = dict[str, str]

_KIND = "definitions"

# Keys are left out: where they stand in the statement differs, and none has SQL in it.
_RENDERED = r"""
SELECT 'view ' || schema_name || '.' || view_name AS name, sha256(sql) AS hash
FROM duckdb_views()
WHERE NOT internal AND database_name = current_database() AND schema_name IN ('main', 'derive')
UNION ALL
SELECT
    'macro ' || schema_name || '.' || function_name,
    sha256(string_agg(
        concat_ws(chr(0), function_type, parameters::VARCHAR, macro_definition), chr(0)
        ORDER BY function_type, parameters::VARCHAR, macro_definition
    ))
FROM duckdb_functions()
WHERE NOT internal AND database_name = current_database()
    AND schema_name IN ('store', 'main', 'derive')
GROUP BY schema_name, function_name
UNION ALL
SELECT
    'table ' || schema_name || '.' || table_name,
    sha256(regexp_replace(sql, ',? PRIMARY KEY(\([^)]*\))?', '', 'g'))
FROM duckdb_tables()
WHERE database_name = current_database() AND schema_name = 'store'
    AND table_name <> 'alembic_version'
UNION ALL
SELECT 'trigger ' || schema_name || '.' || trigger_name, sha256(coalesce(sql, ''))
FROM duckdb_triggers()
WHERE database_name = current_database()
UNION ALL
SELECT 'type ' || schema_name || '.' || type_name, ''
FROM duckdb_types()
WHERE NOT internal AND database_name = current_database()
    AND schema_name IN ('store', 'main', 'derive')
"""


def rendered(con: duckdb.DuckDBPyConnection) -> Definitions:
    """Return the definitions in the current database, without reading any of its tables."""
    return dict(con.execute(_RENDERED).fetchall())


def require_ours(con: duckdb.DuckDBPyConnection, path: Path, *, only_tables: bool = False) -> None:
    """Raise unless tables, views and macros are those of this msgflow.

    Args:
        con: to the database.
        path: its file.
        only_tables: leave out views and macros, which an upgrade makes anew.

    Raises:
        DatabaseError: one is missing, changed, or not ours.
    """
    found, wanted = rendered(con), dict(expected())
    if only_tables:
        found, wanted = (
            {name: text for name, text in each.items() if not name.startswith(("view", "macro"))}
            for each in (found, wanted)
        )
    if found == wanted:
        return
    names = sorted(name for name in found | wanted if found.get(name) != wanted.get(name))
    name = min(names, key=lambda name: name.startswith(("view", "macro")))
    how = (
        "lacks a" if name not in found else "has a foreign" if name not in wanted else "has another"
    )
    # Views and macros are made anew by an upgrade, the rest is not.
    can_upgrade = name.startswith(("view", "macro"))
    raise DatabaseError(
        f"the database is not as msgflow makes it: it {how} {name} — {path}",
        f"msgflow db upgrade --db {shlex.quote(str(path))} makes views and macros anew"
        if can_upgrade
        else "ingest the traces into a new file",
    )


def remember(con: duckdb.DuckDBPyConnection) -> None:
    """Keep the definitions of a database that this process has just made, and opened again."""
    cache_of_user.made_once(_KIND, _RENDERED, lambda: rendered(con))


@cache
def expected() -> Mapping[str, str]:
    """Return the definitions that a database of this msgflow has."""
    found: Definitions = cache_of_user.made_once(_KIND, _RENDERED, _made)
    return found


def _made() -> Definitions:
    with tempfile.TemporaryDirectory(prefix="msgflow-") as directory:
        path = Path(directory) / "new.duckdb"
        write_new(path)
        with duckdb.connect(str(path), read_only=True) as con:
            return rendered(con)
