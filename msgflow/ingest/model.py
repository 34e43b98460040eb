"""Runs `schema/model`: from staged events to the rows of one run, with ids counted from 1."""

from __future__ import annotations

import contextlib
import functools
import itertools
import re
from typing import TYPE_CHECKING

import duckdb

from msgflow.db import objects
from msgflow.db.conditions import conditions_of_diagnostics, conditions_of_model, is_empty
from msgflow.db.diagnostic import STAGED, of_model, staged
from msgflow.db.tables import STORE
from msgflow.ingest import calls, side_by_side, staging
from msgflow.ingest.outline import creating, empty_tables
from msgflow.ingest.reported import restore
from msgflow.sql.emptiness import NEVER
from msgflow.sql.parsed import parsed

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from msgflow.sql.header import Header


def build(
    con: duckdb.DuckDBPyConnection,
    *,
    keep: bool = False,
    is_small: bool = False,
) -> None:
    """Create every object of `schema/model`, each from those before it.

    Args:
        con: connection with `raw` and `staging` attached and filled.
        keep: keep what was read and what only other objects of the model need; else it goes once
            they are built.
        is_small: of so few events that most of the time DuckDB plans, in one thread: two
            objects are created at the same time, and nothing goes before all are built.
    """
    restore(con)
    headers = objects.load("model")
    growing = Growing(con)
    staging.narrow(con, growing.empty)
    created = _create_side_by_side(con, headers, growing) if is_small else set()
    dropped: set[str] = set()
    for position, header in enumerate(headers):
        if header.name not in created:
            growing.add(header)
        if not keep and (not is_small or position == len(headers) - 1):
            # A table without rows is no burden.
            for name in _finished(headers, position) - dropped - growing.empty:
                con.execute(f"DROP TABLE {name}")
                dropped.add(name)


# One changes what was read, the other is of all that is known by then.
_ALONE = (calls.TAKEN_APART, STAGED)


def _create_side_by_side(
    con: duckdb.DuckDBPyConnection, headers: tuple[Header, ...], growing: Growing
) -> set[str]:
    """Create objects of the model, two at the same time, as long as that needs no more memory.

    Returns:
        The names of those created: all, or fewer where the memory was too little for two. One by
        one each of the others can have all of it.
    """
    created: set[str] = set()

    def create(by: duckdb.DuckDBPyConnection, among: tuple[Header, ...], position: int) -> None:
        growing.create(among[position], by)
        created.add(among[position].name)

    empty_tables()  # not by both
    with contextlib.closing(con.cursor()) as other:
        for is_alone, stretch in itertools.groupby(headers, lambda each: each.name in _ALONE):
            if is_alone:
                for header in stretch:
                    growing.add(header)
                    created.add(header.name)
                continue
            together = tuple(stretch)
            try:
                side_by_side.run(
                    _positions_needed(together),
                    [functools.partial(create, by, together) for by in (con, other)],
                )
            except duckdb.OutOfMemoryException:
                return created
    return created


def _positions_needed(headers: tuple[Header, ...]) -> list[set[int]]:
    """Return for each object which of those before it have to be there."""
    positions = {header.name: position for position, header in enumerate(headers)}
    return [
        {positions[name] for name in header.needs if name in positions and name != header.name}
        for header in headers
    ]


class Growing:
    """The model while it is built.

    Attributes:
        empty: the tables of `raw` and `staging` without a row, as far as they are built.
    """

    def __init__(
        self,
        con: duckdb.DuckDBPyConnection,
        run: Callable[[Callable[[], None]], None] = lambda work: work(),
    ) -> None:
        """Start with what was read.

        Args:
            con: connection with `raw` and `staging` attached and filled.
            run: runs work that leaves nothing behind when it fails, again where memory was short.
        """
        self._con = con
        self._run = run
        of_diagnostics = conditions_of_diagnostics()
        self._conditions = {**conditions_of_model(), **of_diagnostics}
        self._conditions[STAGED] = ["all", *(of_diagnostics.get(d.name, NEVER) for d in of_model())]
        self.empty = {
            name
            for (name,) in con.execute(
                "SELECT database_name || '.' || table_name FROM duckdb_tables() "
                "WHERE database_name IN ('raw', 'staging') AND estimated_size = 0"
            ).fetchall()
        }
        self.empty |= {
            f"raw.{view}"
            for view, tables in calls.parts().items()
            if all(f"raw.{table}" in self.empty for table in tables)
        }

    def add(self, header: Header) -> None:
        """Create an object of the model, after all that it needs."""
        self._run(functools.partial(self.create, header, self._con))
        if header.name == calls.TAKEN_APART and header.name not in self.empty:
            for call in calls.CALLS:
                self._run(functools.partial(calls.take_apart, self._con, call))
            self.empty -= {f"raw.{calls.apart(layer)}" for layer in calls.layers()}

    def create(self, header: Header, con: duckdb.DuckDBPyConnection) -> None:
        """Create an object that changes nothing else, once, by any connection.

        Raises:
            duckdb.OutOfMemoryException: the memory is too little; the object is not there.
        """
        if header.kind != "view":
            con.execute(parsed(con, creating(header)))
            return
        if header.name == STAGED and not self.is_empty(STAGED):
            header = staged([each for each in of_model() if not self.is_empty(each.name)])
        if self.is_empty(header.name):
            con.execute(f"CREATE TABLE {header.name} AS {empty_tables()[header.name]}")
            self.empty.add(header.name)
            return
        ((count,),) = con.execute(parsed(con, creating(header))).fetchall()
        if not count:
            self.empty.add(header.name)

    def is_empty(self, name: str) -> bool:
        """Tell whether an object has no row for certain, by what is built."""
        return is_empty(name, self._conditions, self.empty.__contains__)


def _finished(headers: tuple[Header, ...], position: int) -> set[str]:
    """Return the tables, built or read, that nothing after the object at `position` needs."""
    stored = {f"staging.{table.name}" for table in STORE.tables.values()}
    unfolded = {header.name: header for header in headers if header.kind != "view"}
    later = {name for name in stored if name in unfolded}  # evaluated when they are stored
    for header in headers[position + 1 :]:
        if header.kind == "view":
            later |= {header.name} | _needs(header)
    _unfold(later, unfolded)
    built = {header.name for header in headers[: position + 1] if header.kind == "view"}
    return (built | _raw_tables()) - later - stored


def _unfold(names: set[str], unfolded: Mapping[str, Header]) -> None:
    """Add what the objects among `names` that are not tables need themselves."""
    waiting = [name for name in names if name in unfolded]
    while waiting:
        needs = _needs(unfolded[waiting.pop()]) - names
        names |= needs
        waiting += [name for name in needs if name in unfolded]


@functools.cache
def _needs(header: Header) -> frozenset[str]:
    """Return what an object needs, with the tables of `raw` one by one."""
    if staging.OF_ALL_EVENTS & set(header.needs):
        return frozenset(header.needs) | _raw_tables()
    words = set(re.findall(r"\w+", header.body))
    tables = {table for word in words for table in calls.parts().get(word, (word,))}
    return frozenset(header.needs) | {f"raw.{table}" for table in tables} & _raw_tables()


@functools.cache
def _raw_tables() -> frozenset[str]:
    return frozenset(f"raw.{table}" for table in staging.read_tables())
