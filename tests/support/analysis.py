"""The rest of an ingest on staged events: as much of it as a test asks for."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import duckdb
from staged_events import StagedEvents

from msgflow.db import objects
from msgflow.db.connection import attach
from msgflow.db.derivation import derive, derive_table, derived_tables, learn_topics
from msgflow.db.sandbox import open_memory
from msgflow.db.store import store
from msgflow.db.store_table import store_tables
from msgflow.ingest import model, staging
from msgflow.ingest.caret_initialisation import restore
from msgflow.ingest.model import translate

_NAME = re.compile(r"(?:\b(staging|store|derive|main)\.)?\b([a-z_0-9]+)\b")
# What is stored of links and of what is missing comes of whole derivations.
_DERIVED = frozenset(f"store.{name}" for name in derived_tables())


class Analysis:
    """What an ingest makes of staged events: run 1 of a database with nothing else.

    One connection serves many tests, as opening and attaching takes as long as the rest: `build`
    replaces what was built before. A test mostly reads one view; only what that view needs, by the
    headers of the SQL files, is built: every statement of the model takes as long to plan as to run
    on a few rows. A test that takes `connection` gets all of it.
    """

    def __init__(self, empty_database: Path, directory: Path) -> None:
        path = directory / "analysis.duckdb"
        shutil.copyfile(empty_database, path)
        self._connection = open_memory()
        # Of a few rows, every order of joins is as good as the best: looking for it took a quarter.
        self._connection.execute("SET threads = 1")
        self._connection.execute("SET disabled_optimizers = 'join_order'")
        attach(self._connection, path)
        staging.attach(self._connection, None)
        self._tables = self._tables_of("raw"), self._tables_of("staging")
        self._views = self._views_of_staging()
        self._built: set[str] | None = None
        self._empty: set[str] | None = None
        self._derived: frozenset[str] = frozenset()
        # What is stored is never committed, unless somebody takes the database: to take it back
        # costs one statement, to delete it one for each table.
        self._is_stored = self._is_kept = False

    @property
    def connection(self) -> duckdb.DuckDBPyConnection:
        """The database with the whole model of the events, and its links."""
        self._provide(_everything())
        self._keep()
        return self._connection

    def build(self, events: StagedEvents) -> Analysis:
        """Take these events in place of those before."""
        self._clear()
        events.write(self._connection)
        for step in (restore, translate):
            step(self._connection, staging.empty_tables(self._connection))
        self._built, self._empty = set(), None
        self._derived = frozenset()
        return self

    def rows(self, sql: str) -> list[tuple[Any, ...]]:
        """Return the rows of a query."""
        self._provide(_needed(sql))
        return self._read(sql)

    def value(self, sql: str) -> Any:
        """Return the only value of a query that gives one row of one column."""
        ((value,),) = self.rows(sql)
        return value

    def column(self, sql: str) -> list[Any]:
        """Return the values of a query that gives one column."""
        return [value for (value,) in self.rows(sql)]

    def close(self) -> None:
        self._provide(_everything())
        self._keep()
        self._connection.close()

    def _provide(self, needed: frozenset[str]) -> None:
        """Build what is needed and not there yet."""
        if self._built is None:
            return
        self._model(needed)
        tables = needed & _DERIVED
        if "main.finding" in needed:
            tables = _DERIVED  # those of a recording come of all that is derived
        if self._has_topics_to_learn():
            self._model(_closure(["derive.topic_learned"]))
            learn_topics(self._connection, 1)
        if tables <= self._derived:
            return
        self._model(_closure(tables))
        if tables == _DERIVED:
            derive(self._connection, 1)
        else:
            for name in derived_tables():
                if f"store.{name}" in tables:
                    derive_table(self._connection, name, 1)
        self._derived |= tables

    def _model(self, needed: frozenset[str]) -> None:
        """Build the objects of the model among these, and store all that there are."""
        assert self._built is not None
        missing = [
            header
            for header in objects.model()
            if header.name in needed and header.name not in self._built
        ]
        if not missing:
            return
        self._empty_store()
        if self._empty is None:
            self._empty = staging.empty_tables(self._connection)
            staging.narrow(self._connection, self._empty)
        for header in missing:
            model.create(self._connection, header, self._empty)
            self._built.add(header.name)
        self._connection.begin()
        self._is_stored = True
        store(self._connection, 1)
        self._connection.execute(
            "INSERT INTO store.run (run_id, name, created_at, msgflow_version, derivation_hash) "
            "VALUES (1, 'case', TIMESTAMP '1970-01-01', '', '')"
        )
        self._derived = frozenset()

    def _has_topics_to_learn(self) -> bool:
        (row,) = self._read(
            "SELECT EXISTS (FROM store.publisher WHERE topic_name IS NULL) "
            "OR EXISTS (FROM store.subscription WHERE topic_name IS NULL)"
        )
        return bool(row[0])

    def _read(self, sql: str) -> list[tuple[Any, ...]]:
        return self._connection.execute(sql).fetchall()

    def _tables_of(self, database: str, condition: str = "true") -> set[str]:
        return {
            name
            for (name,) in self._read(
                "SELECT table_name FROM duckdb_tables() "
                f"WHERE database_name = '{database}' AND schema_name = 'main' AND {condition}"
            )
        }

    def _views_of_staging(self) -> set[str]:
        return {
            name
            for (name,) in self._read(
                "SELECT view_name FROM duckdb_views() "
                "WHERE database_name = 'staging' AND schema_name = 'main'"
            )
        }

    def _clear(self) -> None:
        self._empty_store()
        con = self._connection
        raw, given = self._tables
        for table in self._tables_of("staging") - given:
            con.execute(f"DROP TABLE staging.{table}")
        for view in self._views_of_staging() - self._views:
            con.execute(f"DROP VIEW staging.{view}")
        for database, tables in (("raw", raw), ("staging", given)):
            con.begin()
            for table in tables & self._tables_of(database, "estimated_size > 0"):
                con.execute(f"DELETE FROM {database}.{table}")
            con.commit()
            # Until then, rows that are gone still count, and nothing is known to be empty.
            con.execute(f"CHECKPOINT {database}")

    def _keep(self) -> None:
        """Let what is stored outlast the transaction, for users of the database."""
        if self._is_stored:
            self._connection.commit()
            self._is_stored, self._is_kept = False, True

    def _empty_store(self) -> None:
        if self._is_stored:
            self._connection.rollback()
            self._is_stored = False
        if not self._is_kept:
            return
        filled = {
            name
            for (name,) in self._read(
                "SELECT table_name FROM duckdb_tables() "
                "WHERE schema_name = 'store' AND estimated_size > 0"
            )
        }
        for name, table in store_tables().items():
            if "run_id" in table.columns and name in filled:
                self._connection.execute(f"DELETE FROM store.{name}")
        self._is_kept = False


Analyse = Callable[[StagedEvents], Analysis]


@cache
def _needs() -> dict[str, frozenset[str]]:
    """Return what every object of the model and of the database needs, tables of it included."""
    needs = {header.name: frozenset(header.needs) for header in objects.model()}
    needs |= {name.replace("staging.", "store."): frozenset({name}) for name in needs}
    needs |= {name: frozenset({name.replace("store.", "derive.")}) for name in _DERIVED}
    return needs | {header.name: frozenset(header.needs) for header in objects.views()}


@cache
def _needed(sql: str) -> frozenset[str]:
    """Return all that a query needs; a name without its schema is that of a public view."""
    return _closure(f"{schema or 'main'}.{name}" for schema, name in _NAME.findall(sql))


@cache
def _everything() -> frozenset[str]:
    return _closure([*(header.name for header in objects.model()), *_DERIVED])


def _closure(names: Iterable[str]) -> frozenset[str]:
    waiting, found = list(names), set()
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += _needs().get(name, ())
    return frozenset(found)
