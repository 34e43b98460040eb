"""The model of a run: from staged events to rows with ids from 1, in four passes.

`schema/alignment` and `schema/kernel` run only where a kernel trace was read; elsewhere their
tables are empty. `schema/model` runs between them, on every recording, and `schema/arrival` after
all. What cannot have a row in this recording is not planned: `schema/model.sql` has its empty
table.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import duckdb

from msgflow.db import objects
from msgflow.db.finding import kinds_with_rows, statement
from msgflow.db.store_table import store_tables
from msgflow.files.resources import resource_directory
from msgflow.ingest import staging
from msgflow.ingest.caret_initialisation import restore
from msgflow.ingest.catalogue import load
from msgflow.sql.header import Header, Step
from msgflow.sql.statement import with_rows

_FINDING = "staging.finding"
_TABLE = re.compile(r"CREATE TABLE ([a-z_.]+) \([^;]*;")


def build(con: duckdb.DuckDBPyConnection, *, keep: bool = False, findings: bool = True) -> None:
    """Create every object of these folders, each from those before it."""
    empty = staging.empty_tables(con)
    if any([restore(con, empty), translate(con, empty)]):
        empty = staging.empty_tables(con)
    staging.narrow(con, empty)
    headers: list[Header] = []
    for layer in objects.MODEL_LAYERS:
        if layer in objects.KERNEL_LAYERS and not _has_kernel_trace(empty):
            for header in objects.load(layer):
                _create_empty(con, header, empty)
        else:
            headers += objects.load(layer)
    if not findings:
        headers = [header for header in headers if header.name != _FINDING]
    last_uses = {} if keep else _last_uses(headers)
    for position, header in enumerate(headers):
        create(con, header, empty)
        for name, last_use in last_uses.items():
            # A table without rows is no burden.
            if last_use == position and name not in empty:
                con.execute(f"DROP TABLE {name}")


def translate(con: duckdb.DuckDBPyConnection, empty: Collection[str]) -> bool:
    """Add what events of Agnocast say to the tables of ROS 2's; tell whether there were any."""
    tables = [f"raw.{each.table}" for each in load().staged.values() if each.is_translated]
    if all(table in empty for table in tables):
        return False
    con.execute((resource_directory("schema") / "agnocast.sql").read_text(encoding="utf-8"))
    return True


def create(
    con: duckdb.DuckDBPyConnection, header: Header, empty: set[str], *, keep: bool = False
) -> None:
    """Create an object of the model, after all that it needs.

    `empty` names the tables that exist and have no row. This function keeps it up to date. Tables
    of steps are dropped, unless a test wants to see them.
    """
    if header.name == _FINDING:
        found = kinds_with_rows(con, "input", {}, empty=empty)
        header = replace(header, body=statement(found))
    if header.kind == "macro":
        con.execute(header.body)
    elif header.kind == "inline":
        con.execute(f"CREATE OR REPLACE VIEW {header.name} AS\n{header.body}")
    elif not may_have_rows(con, header.sources, empty):
        _create_empty(con, header, empty)
    else:
        for step in header.steps:
            _create_step(con, step, empty)
        table = f"CREATE OR REPLACE TABLE {header.name} AS\n{header.body}"
        _note(con, header.name, table, empty)
        for step in () if keep else header.steps:
            con.execute(f"DROP TABLE temp.{step.table}")


def may_have_rows(
    con: duckdb.DuckDBPyConnection, sources: Sequence[tuple[str, str]], empty: Collection[str]
) -> bool:
    """Tell whether an object or a step may have a row, by what `when` of it says."""
    return not sources or any(
        name not in empty and (not condition or with_rows(con, [(name, condition)], {}))
        for name, condition in sources
    )


def _create_step(con: duckdb.DuckDBPyConnection, step: Step, empty: set[str]) -> None:
    """Create a table that only the statements below it read."""
    if may_have_rows(con, step.sources, empty):
        _note(con, step.table, step.sql, empty)
    else:
        con.execute(f"CREATE OR REPLACE TEMP TABLE {step.table} ({step.columns})")
        empty.add(step.table)


def _note(con: duckdb.DuckDBPyConnection, name: str, table: str, empty: set[str]) -> None:
    """Create a table with rows, and note whether it has any."""
    ((count,),) = con.execute(table).fetchall()
    if count:
        empty.discard(name)
    else:
        empty.add(name)


def _create_empty(con: duckdb.DuckDBPyConnection, header: Header, empty: set[str]) -> None:
    if header.kind == "view" and header.name not in empty:
        con.execute(_empty_tables()[header.name])
        empty.add(header.name)


def _has_kernel_trace(empty: Collection[str]) -> bool:
    tables = {f"raw.{each.table}" for each in load().staged.values() if each.is_kernel}
    return not tables <= set(empty)


@functools.cache
def _empty_tables() -> Mapping[str, str]:
    """Return the statement that makes each table of the model without a row."""
    text = (resource_directory("schema") / "model.sql").read_text(encoding="utf-8")
    return {match[1]: match[0] for match in _TABLE.finditer(text)}


def _last_uses(headers: Sequence[Header]) -> dict[str, int]:
    """Return the position of the last object that needs a table: of each, built or read.

    Tables that `store` copies, and what they need at that moment, are not in it.
    """
    stored = {f"staging.{name}" for name in store_tables()}
    unfolded = {header.name: header for header in headers if header.kind != "view"}

    def needs_of(name: str) -> frozenset[str]:
        return _needs(unfolded[name]) if name in unfolded else frozenset()

    last = dict.fromkeys(_raw_tables(), 0)
    for position, header in enumerate(headers):
        if header.kind == "view":
            last[header.name] = position
            needs = objects.reached(_needs(header), needs_of)
            last |= dict.fromkeys(needs & last.keys(), position)
    kept = objects.reached(stored, needs_of)
    return {name: position for name, position in last.items() if name not in kept}


@functools.cache
def _needs(header: Header) -> frozenset[str]:
    """Return what an object needs, with the tables of `raw` one by one."""
    if staging.OF_ALL_EVENTS & set(header.needs):
        return frozenset(header.needs) | _raw_tables()
    words = re.findall(r"\w+", "\n".join(header.statements))
    return frozenset(header.needs) | {f"raw.{word}" for word in words} & _raw_tables()


@functools.cache
def _raw_tables() -> frozenset[str]:
    return frozenset(f"raw.{tracepoint.table}" for tracepoint in load().staged.values())
