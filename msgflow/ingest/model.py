"""Runs `schema/model`: from staged events to the rows of one run, with ids counted from 1."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from msgflow.db import objects
from msgflow.db.tables import metadata

if TYPE_CHECKING:
    from collections.abc import Callable

    import duckdb

    from msgflow.ingest.memory import Memory
    from msgflow.query.header import Header


def build(
    con: duckdb.DuckDBPyConnection,
    memory: Memory,
    *,
    keep: bool = False,
    built: Callable[[str], None] | None = None,
) -> None:
    """Create every object of `schema/model`, each from those before it.

    Args:
        con: connection with `raw` and `staging` attached and filled.
        memory: the memory limit of `con`.
        keep: keep what only other objects of the model need; else it goes once they are built.
        built: called with the name of each object, after it was built.
    """
    headers = objects.load("model")
    for position, header in enumerate(headers):
        statement = (
            header.body
            if header.kind == "macro"
            else f"CREATE TABLE {header.name} AS\n{header.body}"
        )
        memory.run(functools.partial(con.execute, statement))
        if not keep:
            for name in _finished(headers, position):
                con.execute(f"DROP TABLE {name}")
        if built is not None:
            built(header.name)


def _finished(headers: tuple[Header, ...], position: int) -> list[str]:
    """Return the tables that the object at `position` was the last to need."""
    stored = {f"staging.{table.name}" for table in metadata.tables.values()}
    built = {header.name for header in headers[: position + 1] if header.kind == "view"}
    by_macro = {header.name: set(header.needs) for header in headers if header.kind == "macro"}
    later: set[str] = set()
    for header in headers[position + 1 :]:
        later |= set(header.needs)
    for macro in later & by_macro.keys():
        later |= by_macro[macro]
    used = {headers[position].name, *headers[position].needs}
    for macro in used & by_macro.keys():
        used |= by_macro[macro]
    return sorted((used & built) - later - stored)
