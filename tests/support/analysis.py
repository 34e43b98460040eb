"""The rest of an ingest on staged events: as much of it as a test asks for."""

from __future__ import annotations

import fnmatch
import re
import shutil
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import duckdb

from msgflow.db import objects
from msgflow.db.connection import attach
from msgflow.db.derivation import derive, derive_table, derived_tables, learn_topics
from msgflow.db.finding import kinds, kinds_of, short_name, statement, store_findings
from msgflow.db.sandbox import open_memory
from msgflow.db.store import store
from msgflow.db.store_table import store_tables
from msgflow.ingest import model, staging
from msgflow.ingest.caret_initialisation import restore
from msgflow.ingest.model import translate
from msgflow.sql.header import Header
from support.parsed_once import parsing_once
from support.staged_events import StagedEvents

_NAME = re.compile(r"(?:\b(staging|store|derive|main)\.)?\b([a-z_0-9]+)\b")
_TEXT = re.compile(r"'([\w%]+)'")
_FINDING = "staging.finding"
# What is stored of links and of what is missing comes of whole derivations.
_DERIVED = frozenset(f"store.{name}" for name in derived_tables())


class Analysis:
    """What an ingest makes of staged events: run 1 of a database with nothing else.

    One connection serves many tests, as opening and attaching takes as long as the rest: `build`
    replaces what was built before. A test mostly reads one view; only what that view needs, by the
    headers of the SQL files, is built: every statement of the model takes as long to plan as to run
    on a few rows. Where it names kinds of findings, only these are found. A test that takes
    `connection` gets all of it.
    """

    def __init__(self, empty_database: Path, directory: Path) -> None:
        path = directory / "analysis.duckdb"
        shutil.copyfile(empty_database, path)
        self._connection = parsing_once(open_memory())
        # Of a few rows, every order of joins is as good as the best: looking for it took a quarter.
        self._connection.execute("SET threads = 1")
        self._connection.execute("SET disabled_optimizers = 'join_order'")
        attach(self._connection, path)
        staging.attach(self._connection, None)
        self._tables = self._tables_of("raw"), self._tables_of("staging")
        self._views = self._views_of_staging()
        self._built: set[str] | None = None
        self._empty: set[str] = set()
        self._found: frozenset[str] = frozenset()
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
        con = self._connection
        events.write(con)
        empty = staging.empty_tables(con)
        if any([restore(con, empty), translate(con, empty)]):
            empty = staging.empty_tables(con)
        staging.narrow(con, empty)
        self._built, self._empty = set(), empty
        self._derived = self._found = frozenset()
        return self

    def rows(self, sql: str) -> list[tuple[Any, ...]]:
        """Return the rows of a query."""
        self._provide(_needed(sql), _named(sql))
        return self._read(sql)

    def value(self, sql: str) -> Any:
        """Return the only value of a query that gives one row of one column."""
        ((value,),) = self.rows(sql)
        return value

    def column(self, sql: str) -> list[Any]:
        """Return the values of a query that gives one column."""
        return [value for (value,) in self.rows(sql)]

    def close(self) -> None:
        """Close the database, with all that an ingest makes of the events."""
        self._provide(_everything())
        self._keep()
        self.discard()

    def discard(self) -> None:
        """Close the database, which nobody reads any more."""
        self._connection.close()

    def _provide(self, needed: frozenset[str], found: frozenset[str] = frozenset()) -> None:
        """Build what is needed and not there yet, and find these kinds of findings."""
        if self._built is None:
            return
        self._model(needed, found & _of("input"))
        # Findings of the recording come of all that is derived.
        is_all = "main.finding" in needed and not found
        wanted = (_DERIVED if is_all else needed & _DERIVED) | found & _of("recording")
        if self._has_topics_to_learn():
            self._model(_closure(["derive.topic_learned"]))
            learn_topics(self._connection, 1)
        if wanted <= self._derived:
            return
        self._model(_closure(wanted & _DERIVED))
        if wanted >= _DERIVED:
            derive(self._connection, 1)
            self._derived = _DERIVED | _of("recording")
            return
        for name in derived_tables():
            if f"store.{name}" in wanted:
                derive_table(self._connection, name, 1)
        self._derived |= wanted
        if recorded := self._derived & _of("recording"):
            store_findings(self._connection, 1, _headers(recorded))

    def _model(self, needed: frozenset[str], found: frozenset[str] = frozenset()) -> None:
        """Build the objects of the model among these, and store all that there are."""
        assert self._built is not None
        missing = [
            header
            for header in objects.model()
            if header.name in needed and header.name not in self._built
        ]
        is_found = found <= self._found or _FINDING in self._built
        if not missing and is_found:
            return
        self._empty_store()
        for header in missing:
            model.create(self._connection, header, self._empty)
            self._built.add(header.name)
        if not is_found:
            self._found |= found
            rows = statement(_headers(self._found))
            self._connection.execute(f"CREATE OR REPLACE TABLE {_FINDING} AS {rows}")
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
        # An empty table is as the next model makes it.
        for table in self._tables_of("staging", "estimated_size > 0") - given:
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
    names = [f"{schema or 'main'}.{name}" for schema, name in _NAME.findall(sql)]
    if not (found := _named(sql)):
        return _closure(names)
    words = _NAME.findall(statement(_headers(found)))
    sources = [f"{schema}.{name}" for schema, name in words if schema]
    return _closure([*names, *sources], without=_FINDING)


@cache
def _named(sql: str) -> frozenset[str]:
    """Return the kinds of findings that a query of findings names, and those that these name."""
    if not re.search(r"\bfinding\b", sql):
        return frozenset()
    every = _of("input") | _of("recording")
    texts = [text.replace("%", "*") for text in _TEXT.findall(sql)]
    found = frozenset(name for text in texts for name in fnmatch.filter(every, text))
    return found | every.intersection(_TEXT.findall(statement(_headers(found))))


@cache
def _of(phase: str) -> frozenset[str]:
    return frozenset(map(short_name, kinds_of(phase)))


def _headers(found: frozenset[str]) -> list[Header]:
    return [header for header in kinds() if short_name(header) in found]


@cache
def _everything() -> frozenset[str]:
    return _closure([*(header.name for header in objects.model()), *_DERIVED])


def _closure(names: Iterable[str], *, without: str | None = None) -> frozenset[str]:
    waiting, found = list(names), set()
    while waiting:
        name = waiting.pop()
        if name not in found and name != without:
            found.add(name)
            waiting += _needs().get(name, ())
    return frozenset(found)
