"""The SQL objects of `schema/`: loaded, ordered by what they need, and applied to a database.

A public view that shows a table unchanged has no file: `store.sql` says of the table what it is.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.db.finding import composed
from msgflow.db.store_table import store_file, store_tables, table_views
from msgflow.files.resources import resource_directory
from msgflow.sql.header import Header, completed, read
from msgflow.sql.quoting import identifier, literal
from msgflow.version import __version__

if TYPE_CHECKING:
    import duckdb

    from msgflow.sql.header import Column

# Folders whose objects are in the database; each may need only itself and those to its left.
PUBLIC = "public"
# Findings, of whose headers a view is made.
HEALTH = "health"
# Folders whose objects are made of staged events, each a pass over what those before it made: which
# clock a kernel trace is of, all that any recording tells, what kernel traces tell besides, and
# what follows from all of these.
MODEL_LAYERS = ("alignment", "model", "kernel", "arrival")
# Passes for recordings with a kernel trace. Elsewhere their tables are empty.
KERNEL_LAYERS = ("alignment", "kernel")
VIEW_LAYERS = ("link", "clock", "delivery", "flow", "stat", PUBLIC)

# Modules that make tables and views besides `schema/`; the hash reads them as text.
_MODULES = ("store_table.py", "empty_database.py", "finding.py")


@cache
def load(layer: str) -> tuple[Header, ...]:
    """Return the objects of a folder of `schema/` and its subfolders, each after those it needs.

    `public` includes the views that show a table, and takes from the tables the columns that a
    header only names. Other folders include the objects that are made of all findings.
    """
    directory = resource_directory("schema") / layer
    if not directory.is_dir():
        raise FileNotFoundError(directory)
    headers = [read(path) for path in directory.rglob("*.sql")]
    if layer == PUBLIC:
        headers = [*map(_completed, headers), *table_views()]
    return sort([*headers, *composed(layer)])


def _completed(header: Header) -> Header:
    """Fill in the columns that a header only names: of the table of its name, or the vocabulary."""
    table = store_tables().get(header.name.partition(".")[2])
    return completed(header, table.columns if table else None)


def sort(headers: Iterable[Header]) -> tuple[Header, ...]:
    """Order objects so that each comes after those that it needs; ties by name."""
    by_name = {header.name: header for header in headers}
    sorter = TopologicalSorter({name: sources(by_name, name) for name in sorted(by_name)})
    return tuple(by_name[name] for name in sorter.static_order())


def sources(by_name: Mapping[str, Header], name: str) -> list[str]:
    """Return the objects among these that one reads, directly or through a stored table.

    The rows of a table `store.x` come from `derive.x`, if there is such an object.
    """
    needs = dict.fromkeys(by_name[name].needs)
    needs |= dict.fromkeys(need.replace("store.", "derive.", 1) for need in needs)
    return [need for need in needs if need in by_name and need != name]


@cache
def model() -> tuple[Header, ...]:
    """Return all that an ingest makes of staged events, in the order of creation."""
    return tuple(header for layer in MODEL_LAYERS for header in load(layer))


@cache
def views() -> tuple[Header, ...]:
    """Return every view and macro of a database, in the order of creation."""
    return sort(header for layer in VIEW_LAYERS for header in load(layer))


def public_names() -> tuple[str, ...]:
    """Return the names of all public views and table macros, without their schema."""
    return tuple(header.name.partition(".")[2] for header in load(PUBLIC))


def hash_of(texts: Iterable[str]) -> str:
    """Return the SHA-256 of some texts, in this order."""
    digest = hashlib.sha256()
    for text in texts:
        digest.update(text.encode())
        digest.update(b"\0")
    return digest.hexdigest()


@cache
def definition_hash() -> str:
    """Return the SHA-256 of all definitions that `apply` would create.

    This reads the files without parsing them, so that a database opens quickly.
    """
    root = resource_directory("schema")
    layers = (*VIEW_LAYERS, HEALTH)
    in_layers = (path for layer in layers for path in sorted((root / layer).rglob("*.sql")))
    modules = (Path(__file__).with_name(name) for name in _MODULES)
    paths = (store_file(), root / "vocabulary.sql", *in_layers, *modules)
    return hash_of(text for path in paths for text in (path.name, path.read_text(encoding="utf-8")))


def sources_of(names: Iterable[str]) -> frozenset[str]:
    """Return these objects and tables, and all that they read, directly or not."""
    known = {header.name: header for header in views()}

    def needs_of(name: str) -> Iterable[str]:
        return (*known[name].needs, *sources(known, name)) if name in known else ()

    return frozenset(reached(names, needs_of))


def reached(names: Iterable[str], needs_of: Callable[[str], Iterable[str]]) -> set[str]:
    """Return these names, and all that they need, directly or not."""
    found: set[str] = set()
    waiting = list(names)
    while waiting:
        if (name := waiting.pop()) not in found:
            found.add(name)
            waiting += needs_of(name)
    return found


@cache
def head_revision() -> str:
    """Return the newest schema revision: the name of the last migration."""
    return max(known_revisions())


@cache
def known_revisions() -> frozenset[str]:
    """Return the current schema revision, and all that can be upgraded to it."""
    versions = resource_directory("migrations") / "versions"
    return frozenset(path.stem for path in versions.glob("[0-9]*_*.py"))


def apply(con: duckdb.DuckDBPyConnection) -> None:
    """Create or replace all views and macros and all comments, inside the open transaction.

    This drops objects that are no longer in `schema/`.
    """
    drop(con)
    for table in store_tables().values():
        _comment(con, "TABLE", f"store.{table.name}", table.grain, table.columns.values())
    for header in views():
        con.execute(create_statement(header))
        if header.kind == "view":
            text = f"{header.description} {header.grain}"
            _comment(con, "VIEW", header.name, text, header.columns)
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
    found = con.execute(
        "SELECT 'VIEW', schema_name, view_name FROM duckdb_views() WHERE NOT internal "
        "AND database_name = current_database() AND schema_name IN ('main', 'derive', 'store') "
        "UNION ALL SELECT DISTINCT if(function_type = 'macro', 'MACRO', 'MACRO TABLE'), "
        "schema_name, function_name FROM duckdb_functions() WHERE NOT internal "
        "AND database_name = current_database() AND function_type IN ('macro', 'table_macro')"
    ).fetchall()
    for kind, schema, name in found:
        con.execute(f"DROP {kind} {identifier(schema)}.{identifier(name)}")


def _comment(
    con: duckdb.DuckDBPyConnection, kind: str, name: str, text: str, columns: Iterable[Column]
) -> None:
    con.execute(f"COMMENT ON {kind} {name} IS {literal(text)}")
    for column in columns:
        unit = f" [{column.unit}]" if column.unit else ""
        con.execute(
            f'COMMENT ON COLUMN {name}."{column.name}" IS {literal(column.description + unit)}'
        )
