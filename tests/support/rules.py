"""Rules of the schema by themselves, over tables that a test makes up."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager

import duckdb

from msgflow.db import objects


@contextmanager
def derived(stage: str, names: Collection[str]) -> Iterator[duckdb.DuckDBPyConnection]:
    """A connection with what `stage` makes, and these views and macros of `derive` above it."""
    with duckdb.connect() as con:
        con.execute(stage)
        for header in objects.views():
            if header.name.removeprefix("derive.") in names:
                con.execute(objects.create_statement(header))
        yield con


@contextmanager
def modelled(stage: str, name: str, view: str) -> Iterator[duckdb.DuckDBPyConnection]:
    """A connection with what `stage` makes, and a relation of the model above it as `view`."""
    (rule,) = (each for each in objects.load("model") if each.name == f"staging.{name}")
    with duckdb.connect() as con:
        con.execute(stage)
        con.execute(f"CREATE VIEW {view} AS {rule.body}")
        yield con
