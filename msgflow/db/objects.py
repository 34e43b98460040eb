"""The SQL objects of `schema/`: loaded, ordered by what they need, and applied to a database."""

from __future__ import annotations

import hashlib
from functools import cache
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING

from msgflow.resources import resource_directory
from msgflow.sql.header import Header, parse
from msgflow.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    import duckdb

# Folders whose objects live in the database; each may need only those to its left, and itself.
VIEW_LAYERS = ("link", "flow", "clock", "stat", "public")

# Of a database: tables, what is derived from them, and what users read.
SCHEMAS = ("store", "derive", "main")


@cache
def load(layer: str) -> tuple[Header, ...]:
    """Return the objects of one folder of `schema/` and its rooms, each after those it needs.

    Raises:
        ValueError: two objects need each other.
    """
    directory = resource_directory("schema") / layer
    return sort(
        parse(path.read_text(encoding="utf-8"), path) for path in sorted(directory.rglob("*.sql"))
    )


def sort(headers: Iterable[Header]) -> tuple[Header, ...]:
    """Order objects so that each comes after those that it needs; ties by name.

    Raises:
        ValueError: two objects need each other.
    """
    by_name = {header.name: header for header in headers}
    sorter = TopologicalSorter(
        {
            name: [need for need in by_name[name].needs if need in by_name]
            for name in sorted(by_name)
        }
    )
    try:
        return tuple(by_name[name] for name in sorter.static_order())
    except CycleError as error:
        raise ValueError(f"objects need each other: {error.args[1]}") from error


def views() -> tuple[Header, ...]:
    """Return every view and macro of a database, in the order of creation."""
    return sort(header for layer in VIEW_LAYERS for header in load(layer))


def _hash(texts: Iterable[str]) -> str:
    digest = hashlib.sha256()
    for text in texts:
        digest.update(text.encode())
        digest.update(b"\0")
    return digest.hexdigest()


@cache
def definition_hash() -> str:
    """Return the SHA-256 of everything that `apply` would apply.

    Reads the files without parsing them, so that opening a database stays quick.
    """
    return _hash(_texts(VIEW_LAYERS))


@cache
def derivation_hash() -> str:
    """Return the SHA-256 of the SQL that derives what is stored of links and of what is missing."""
    return _hash(_texts(("link", "clock", "stat")))


def _texts(layers: Sequence[str]) -> Iterable[str]:
    root = resource_directory("schema")
    for layer in layers:
        for path in sorted((root / layer).rglob("*.sql")):
            yield path.name
            yield path.read_text(encoding="utf-8")


@cache
def head_revision() -> str:
    """Return the newest schema revision: the number that the last migration begins with."""
    return max(known_revisions())


@cache
def known_revisions() -> frozenset[str]:
    """Return all schema revisions that there have been."""
    versions = resource_directory("migrations") / "versions"
    return frozenset(_revision(path) for path in versions.glob("[0-9]*_*.py"))


def _revision(path: Path) -> str:
    return path.name.split("_", 1)[0]


def apply(con: duckdb.DuckDBPyConnection) -> None:
    """Create or replace all views and macros with their comments, inside the open transaction.

    Objects that no longer exist in `schema/` are dropped.
    """
    drop(con)
    for header in views():
        con.execute(create_statement(header))
        if header.kind == "view":
            _comment(con, header)
    con.execute("DELETE FROM store.definition WHERE name = 'views'")
    con.execute(
        "INSERT INTO store.definition (name, hash, msgflow_version) VALUES ('views', ?, ?)",
        [definition_hash(), __version__],
    )


def create_statement(header: Header) -> str:
    """Return the statement that creates an object in the current database."""
    if header.kind == "macro":
        return header.body
    return f"CREATE OR REPLACE VIEW {header.name} AS\n{header.body}"


def drop(con: duckdb.DuckDBPyConnection) -> None:
    """Drop all views and macros, inside the open transaction."""
    con.execute("CREATE SCHEMA IF NOT EXISTS derive")
    for schema, name in con.execute(
        "SELECT schema_name, view_name FROM duckdb_views() WHERE NOT internal "
        "AND database_name = current_database() AND schema_name IN ('main', 'derive')"
    ).fetchall():
        con.execute(f"DROP VIEW {_quoted(schema)}.{_quoted(name)}")
    for schema, name, kind in con.execute(
        "SELECT DISTINCT schema_name, function_name, function_type FROM duckdb_functions() "
        "WHERE NOT internal AND database_name = current_database() "
        "AND function_type IN ('macro', 'table_macro')"
    ).fetchall():
        table = "TABLE " if kind == "table_macro" else ""
        con.execute(f"DROP MACRO {table}{_quoted(schema)}.{_quoted(name)}")


def _comment(con: duckdb.DuckDBPyConnection, header: Header) -> None:
    con.execute(
        f"COMMENT ON VIEW {header.name} IS {literal(header.description + ' ' + header.grain)}"
    )
    for column in header.columns:
        unit = f" [{column.unit}]" if column.unit else ""
        con.execute(
            f'COMMENT ON COLUMN {header.name}."{column.name}" IS '
            f"{literal(column.description + unit)}"
        )


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def literal(text: str) -> str:
    """Return a text as a constant of SQL."""
    return "'" + text.replace("'", "''") + "'"
