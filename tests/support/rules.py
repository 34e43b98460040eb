"""Rules of the schema by themselves, over tables that a test makes up."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import cache

import duckdb

from msgflow.db import objects

Rules = AbstractContextManager[duckdb.DuckDBPyConnection]


def derived(stage: str, names: Collection[str]) -> Rules:
    """A connection with what `stage` makes, and these views and macros of `derive` above it."""
    return _as_made(
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
