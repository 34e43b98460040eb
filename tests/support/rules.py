"""Rules of the schema by themselves, over tables that a test fills.

A test names the columns that its rules read, as `{"store.take": "run_id = 1, take_id"}`: their
types are those of the schema, so that a column which it no longer has fails the test. Behind `=`
stands what a row has that says nothing else. In place of a macro its rows are a table of the
macro's own name, in no schema; one that is given a table by name has to be made by hand.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from pathlib import Path

import duckdb

from msgflow.db import objects
from msgflow.db.empty_database import write_empty

Rules = AbstractContextManager[duckdb.DuckDBPyConnection]

_SIGNATURE = re.compile(r"MACRO [a-z_.]+\(([^()]*)\) AS TABLE")
_NEXT_COLUMN = re.compile(r", *(?=[a-z_]+(?:$|,| =))")


def derived(stage: str, names: Collection[str], tables: Mapping[str, str] | None = None) -> Rules:
    """A connection with these views and macros of `derive`, over tables and what `stage` makes."""
    return _as_made(
        "CREATE SCHEMA store; CREATE SCHEMA derive",
        *_tables(tables or {}),
        stage,
        *(
            objects.create_statement(header)
            for header in objects.views()
            if header.name.removeprefix("derive.") in names
        ),
    )


def modelled(stage: str, name: str, view: str) -> Rules:
    """A connection with what `stage` makes, and a relation of the model above it as `view`."""
    (rule,) = (each for each in objects.model() if each.name == f"staging.{name}")
    return _as_made(stage, f"CREATE TEMP VIEW {view} AS {rule.body}")


def insert(
    con: duckdb.DuckDBPyConnection,
    table: str,
    names: str,
    rows: Iterable[Sequence[int | str | None]],
) -> None:
    """Insert rows by one statement: one for each would take longer than most rules."""
    values = [", ".join("NULL" if value is None else repr(value) for value in row) for row in rows]
    if values:
        con.execute(f"INSERT INTO {table} ({names}) VALUES ({'), ('.join(values)})")


def _tables(tables: Mapping[str, str]) -> Iterator[str]:
    """Yield the statements that make tables of the schema with some of their columns."""
    headers = {header.name: header for header in objects.views()}
    for name, listed in tables.items():
        signature = _SIGNATURE.search(headers[name].body) if name in headers else None
        # What has no default is a run.
        given = [each for each in signature[1].split(",") if ":=" not in each] if signature else []
        rows = f"{name}({', '.join(['0::BIGINT'] * len(given))})" if signature else name
        made = name.partition(".")[2] if signature else name
        yield f"CREATE TABLE {made} ({', '.join(_columns(rows, listed))})"
        if signature:
            yield f"CREATE MACRO {name}({signature[1]}) AS TABLE FROM {made}"


def _columns(rows: str, listed: str) -> Iterator[str]:
    described = f"SELECT column_name, column_type FROM (DESCRIBE FROM {rows})"
    types = dict(_schema().execute(described).fetchall())
    for each in _NEXT_COLUMN.split(listed):
        column, _, default = each.partition(" = ")
        yield f"{column} {types[column]}" + (f" DEFAULT {default}" if default else "")


@cache
def _schema() -> duckdb.DuckDBPyConnection:
    """All tables, views and macros, without a row."""
    with tempfile.TemporaryDirectory() as directory:
        write_empty(path := Path(directory, "empty.duckdb"))
        # The file stays readable to whom it is open.
        return duckdb.connect(str(path), read_only=True, config={"threads": 1})


@contextmanager
def _as_made(*statements: str) -> Iterator[duckdb.DuckDBPyConnection]:
    """What these statements make, made once: what a test changes is taken back."""
    con = _made(statements)
    con.begin()
    try:
        yield con
    finally:
        con.rollback()


@cache
def _made(statements: tuple[str, ...]) -> duckdb.DuckDBPyConnection:
    # Of a few rows, there is nothing to share out.
    con = duckdb.connect(config={"threads": 1})
    for statement in statements:
        con.execute(statement)
    return con
