"""Connections to chosen runs of a lake, for SQL.

A DuckDB connection has a table `run` with the chosen runs, and a view per table of the lake with
their rows; public views are in the schema `view`. It can read the files of the chosen runs and
nothing else. DuckDB reads files of this machine: those of a bucket are copied first.
"""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import duckdb
import pyarrow as pa

from msgflow.db.sandbox import open_memory, shut_in
from msgflow.db.sql_guard import require_condition
from msgflow.errors import DatabaseError, UsageError
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import RUN, part_path
from msgflow.fleet.part import KEY, PART, ROWS_AT_ONCE, write_rows
from msgflow.fleet.run_database import run_database
from msgflow.sql.failure import first_line
from msgflow.sql.quoting import identifier, literal
from msgflow.sql.statement import registered
from msgflow.text.name_suggestions import meant_or, nearest

VIEWS = "view"
"""Schema of the public views."""

_VIEWS_AMONG = """
SELECT view_name
FROM duckdb_views()
WHERE database_name = current_database() AND schema_name = 'main' AND NOT internal
    AND list_contains($names, view_name)
"""
_COLUMN = re.compile(r'Referenced column "((?:[^"]|"")*)"')
_EXAMPLE = "such as --where \"robot LIKE 'r%' AND software_version = '2.4'\""
_NONE_YET = "msgflow fleet ingest SOURCE --lake adds some"


@dataclass(frozen=True)
class Choice:
    """Runs of a lake, some or all."""

    lake: Lake
    runs: pa.Table  # the chosen ones, one row each, ordered by key; columns of `RUN_SCHEMA`
    labels: tuple[str, ...]  # keys of the labels of all runs of the lake, sorted
    total: int  # number of runs of the lake


def choose(lake: Lake, where: str | None = None) -> Choice:
    """Return the runs of a lake that fit a condition."""
    runs = lake.runs()
    if not len(runs):
        raise UsageError(f"the lake holds no run yet — {lake.store.url}", _NONE_YET)
    labels = tuple(sorted({key for pairs in runs["labels"].to_pylist() for key, _ in pairs or ()}))
    chosen = runs
    if where is not None:
        with open_memory() as con:
            shut_in(con)
            require_condition(con, where, _EXAMPLE)
            chosen = _fitting(con, runs, labels, where)
    if not len(chosen):
        raise UsageError(
            f"none of the {len(runs):,} runs of the lake fits — --where {where}",
            f"msgflow fleet runs --lake {shlex.quote(lake.store.url)}",
        )
    return Choice(lake, chosen, labels, len(runs))


def _fitting(
    con: duckdb.DuckDBPyConnection, runs: pa.Table, labels: Sequence[str], where: str
) -> pa.Table:
    con.register("known_run", runs)
    # SQL can call those labels by their keys that are not names of columns.
    names = Counter(name.lower() for name in (*labels, *runs.column_names))
    named = [label for label in labels if names[label.lower()] == 1]
    columns = [f"labels[$label_{n}] AS {identifier(key)}" for n, key in enumerate(named)]
    # A comment at the end of the condition ends with the line.
    table = f"SELECT {', '.join(['*', *columns])} FROM known_run"
    own = ", ".join(map(identifier, runs.column_names))
    text = f"SELECT {own} FROM ({table}) WHERE (\n{where}\n) ORDER BY run"
    try:
        found = con.sql(text, params={f"label_{n}": key for n, key in enumerate(named)})
        return pa.Table.from_arrays(found.to_arrow_table().columns, schema=runs.schema)
    except duckdb.Error as error:
        match = _COLUMN.search(str(error))
        if match is None:
            raise UsageError(
                f"--where cannot be evaluated: {first_line(error)}", _EXAMPLE
            ) from error
        like = [f"labels['{label}']" for label in labels if label.lower() == match[1].lower()]
        if like:
            raise UsageError(
                f"labels of several names are meant — {match[1]}", f"write {' or '.join(like)}"
            ) from error
        raise UsageError(
            f"no run of the lake has such a label — {match[1]}",
            what_there_is(match[1], labels, runs.column_names),
        ) from error


def what_there_is(name: str, labels: Sequence[str], columns: Sequence[str]) -> str:
    """Return a hint: the labels and columns of runs, similar names first."""
    have = f"its labels are {', '.join(labels)}" if labels else "its runs have no labels"
    near = nearest(name, [*labels, *columns])
    return meant_or(near, f"{have}; columns of run are {', '.join(columns)}", "?")


class Reading(ExitStack):
    """A connection to chosen runs of a lake. Use it as a context manager, or call `close`."""

    def __init__(
        self,
        choice: Choice,
        tables: Iterable[str],
        views: Iterable[str] = (),
        *,
        groups: pa.Table | None = None,
    ) -> None:
        """Open some tables of runs for reading, and public views that their databases have.

        Where `groups` says a label_group of each run, tables have that as well.
        """
        super().__init__()
        self.choice = choice
        self._folder = Path(self.enter_context(TemporaryDirectory(prefix="msgflow-")))
        self._files: list[str] = []
        # It has the table `run`, and a view of each table, without the column `part`.
        self.connection = self.enter_context(open_memory())
        try:
            if groups is not None:
                self.connection.register("run_group", groups)
            self._join = "" if groups is None else "JOIN run_group USING (run)"
            with lake_errors(choice.lake):
                self._fill(tables, views)
            shut_in(self.connection, files=self._files)
        except BaseException:
            self.close()
            raise

    def _fill(self, tables: Iterable[str], views: Iterable[str]) -> None:
        con, runs = self.connection, self.choice.runs
        # A query that needs more than the memory fails: there is no good place for spilled files.
        con.execute("SET temp_directory = ''")
        # DuckDB looks at the files of a view when it makes the view, and when it reads the view.
        con.execute("SET parquet_metadata_cache = true")
        with registered(con, chosen_run=runs):
            con.execute(f"CREATE TABLE {RUN} AS FROM chosen_run")
        parts = [part for part in runs["part"].to_pylist() if part is not None]
        for table in tables:
            paths = [part_path(table, part) for part in parts]
            self._add(table, self.choice.lake.store.local_files(paths, self._folder))
        con.execute(f"CREATE SCHEMA {VIEWS}")
        for view, files in self._of_databases(list(views)).items():
            self._add(f"{VIEWS}.{view}", files)

    def _add(self, name: str, files: list[str]) -> None:
        """Make a view of the rows in some files."""
        if not files:
            return
        self._files += files
        self.connection.execute(f"SET VARIABLE {identifier(name)} = $files", {"files": files})
        self.connection.execute(
            f"CREATE VIEW {name} AS SELECT * EXCLUDE (part) "
            f"FROM read_parquet(getvariable({literal(name)}), union_by_name = true) {self._join}"
        )

    def _of_databases(self, views: Sequence[str]) -> dict[str, list[str]]:
        """Write the rows that databases of the runs have in some views, and return the files."""
        files: dict[str, list[str]] = {}
        for run in self.choice.runs.to_pylist() if views else ():
            if run["database_part"] is None:
                continue
            with run_database(self.choice.lake, run, self._folder) as connection:
                there = connection.execute(_VIEWS_AMONG, {"names": views}).fetchall()
                for (view,) in there:
                    file = self._folder / f"{run['run']}.{view}.parquet"
                    rows = connection.sql(f'FROM main."{view}"').to_arrow_reader(ROWS_AT_ONCE)
                    write_rows(file, view, rows, {KEY: run["run"], PART: run["part"]}, "")
                    files.setdefault(view, []).append(str(file))
        return files


@contextmanager
def lake_errors(lake: Lake, *, is_query: bool = False) -> Iterator[None]:
    """Turn errors that the files of a lake cause into a DatabaseError."""
    try:
        yield
    except (duckdb.Error, OSError) as error:
        if is_query and not isinstance(error, duckdb.IOException | OSError):
            raise
        raise DatabaseError(
            f"cannot read the lake: {first_line(error)} — {lake.store.url}",
            "check that it can be reached, and that only msgflow writes there",
        ) from error
