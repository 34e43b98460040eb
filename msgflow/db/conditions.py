"""When the objects of `schema/` have no row for certain: by the tables that they are made of."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import duckdb

from msgflow.db import cache as cache_of_user
from msgflow.db import objects
from msgflow.db.diagnostic import diagnostics, text
from msgflow.sql import emptiness
from msgflow.sql.emptiness import NEVER, Condition, condition, condition_of_macro, holds, macro

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from msgflow.sql.header import Header

_KIND = "conditions"


@cache
def conditions_of_views() -> Mapping[str, Condition]:
    """Return the conditions of the views and table macros of a database."""
    return _kept(objects.views())


@cache
def conditions_of_model() -> Mapping[str, Condition]:
    """Return the conditions of the objects of `schema/model`."""
    return _kept(objects.load("model"))


@cache
def conditions_of_diagnostics() -> Mapping[str, Condition]:
    """Return the conditions of all diagnostics."""
    macros = [h for h in (*objects.views(), *objects.load("model")) if h.kind == "macro"]
    found = _kept((*macros, *(replace(each, body=text(each)) for each in diagnostics())))
    return {name: condition for name, condition in found.items() if name.startswith("diagnostic.")}


def has_no_row(con: duckdb.DuckDBPyConnection, name: str, run_id: int) -> bool:
    """Tell whether a view or macro of a database has no row of a run for certain.

    What is made of a run is made of rows of that run alone.
    """
    return is_empty(name, conditions_of_views(), presence(con, run_id))


def presence(con: duckdb.DuckDBPyConnection, run_id: int) -> Callable[[str], bool]:
    """Return what tells whether a table has no row of a run, or a gate none."""
    gates = _gates()

    @cache
    def is_empty(name: str) -> bool:
        if name.startswith("store."):
            query = f"SELECT 1 FROM {name} WHERE run_id = ? LIMIT 1"
        elif name in gates:
            query = f"SELECT 1 FROM {name}(?) LIMIT 1"
        else:
            return False
        return not con.execute(query, [run_id]).fetchall()

    return is_empty


@cache
def _gates() -> frozenset[str]:
    return frozenset(header.name for header in objects.views() if header.note == "gate")


def is_empty(
    name: str, known: Mapping[str, Condition], is_table_empty: Callable[[str], bool]
) -> bool:
    """Tell whether an object has no row for certain, be it made of others among `known` or not."""
    told: dict[str, bool] = {}

    def tell(part: str) -> bool:
        if part not in told:
            told[part] = is_table_empty(part) or (part in known and holds(known[part], tell))
        return told[part]

    return tell(name)


def _kept(headers: tuple[Header, ...]) -> dict[str, Condition]:
    """Return the conditions from the user's cache, none where there cannot be one.

    To parse all statements takes as long as a small ingest.
    """
    made_by = objects.hash_of(
        [Path(emptiness.__file__).read_text(encoding="utf-8"), *(header.body for header in headers)]
    )
    found: dict[str, Condition] = cache_of_user.made_once(
        _KIND, made_by, lambda: _conditions(headers) if cache_of_user.is_usable() else {}
    )
    return found


def _conditions(headers: tuple[Header, ...]) -> dict[str, Condition]:
    found: dict[str, Condition] = {}
    with duckdb.connect() as con:
        macros = dict(macro(con, header.body) for header in headers if header.kind == "macro")
        for header in headers:
            if header.kind != "macro":
                found[header.name] = condition(con, header.body, macros)
            elif not macros[header.name].is_scalar:
                found[header.name] = condition_of_macro(con, header.name, macros)
    return {name: each for name, each in found.items() if each != NEVER}
