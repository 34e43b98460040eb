"""Connections to chosen runs of a lake, for SQL.

A DuckDB connection has a table `run` with the chosen runs, and a view per table of the lake with
their rows; public views are in the schema `view`. It can read the files of the chosen runs and
nothing else. DuckDB reads a folder itself. It reads a bucket through pyarrow, which alone has the
credentials.
"""

from __future__ import annotations

import re
import shlex
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pyarrow.parquet as pq

from msgflow.db.sandbox import open_memory, shut_in
from msgflow.db.sql_guard import require_condition
from msgflow.errors import DatabaseError, UsageError
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import RUN, VIEWS, part_path, view_path
from msgflow.fleet.part import ANSWERS, KEY, PART, public_views, view_rows, write_rows
from msgflow.fleet.run_database import run_database
from msgflow.sql.failure import first_line
from msgflow.sql.quoting import identifier, literal
from msgflow.text.name_suggestions import meant_or, nearest
from msgflow.version import __version__

_COLUMN = re.compile(r'Referenced column "((?:[^"]|"")*)"')
# DuckDB says this when pyarrow failed to read a bucket.
_STREAM = "reading the stream registered as"
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
        self, choice: Choice, tables: Sequence[str] | None = None, *, listed: bool = False
    ) -> None:
        """Open runs for reading.

        `tables` are those to read, and public views as `view/NAME`; all when None. `listed` says
        that names and columns of all others are wanted, too.
        """
        super().__init__()
        self.choice = choice
        self.tables: set[str] = set()  # those asked for that these runs have
        self._local_files: list[str] = []
        # It has the table `run`, and a view of each table that was asked for, without the column
        # `part`.
        self.connection = self.enter_context(open_memory())
        try:
            with lake_errors(choice.lake):
                self._fill(tables, listed)
            shut_in(self.connection, files=self._local_files)
        except BaseException:
            self.close()
            raise

    def _fill(self, tables: Sequence[str] | None, listed: bool) -> None:
        con = self.connection
        # A query that needs more than the memory fails: there is no good place for spilled files.
        con.execute("SET temp_directory = ''")
        # DuckDB looks at the files of a view when it makes the view, and when it reads the view.
        con.execute("SET parquet_metadata_cache = true")
        con.register("chosen_run", self.choice.runs)
        con.execute(f"CREATE TABLE {RUN} AS FROM chosen_run")
        con.unregister("chosen_run")
        con.execute(f"CREATE SCHEMA {identifier(VIEWS)}")
        made = self._made(tables, listed)
        if tables is None or listed:
            views = {f"{VIEWS}/{name}" for name in self.choice.lake.store.folders(VIEWS)}
            tables = [*ANSWERS, *sorted(views | made.keys())]
        for table in tables:
            is_view = table.startswith(f"{VIEWS}/")
            found = self._files(table, "view_part" if is_view else "part")
            scans = [self._scan(table, found)] if found else []
            if table in made:
                scans.append(self._local_scan(f"made of {table}", made[table]))
            if not scans:
                continue
            self.tables.add(table)
            name = ".".join(map(identifier, table.split("/")))
            part = "coalesce(r.view_part, r.database_part)" if is_view else "r.part"
            con.execute(
                f"CREATE VIEW {name} AS SELECT t.* EXCLUDE (part) "
                f"FROM (FROM {' UNION ALL BY NAME FROM '.join(scans)}) AS t "
                f"SEMI JOIN main.{RUN} AS r ON t.run = r.run AND t.part = {part}"
            )

    def _made(self, tables: Sequence[str] | None, listed: bool) -> dict[str, list[str]]:
        """Write views that runs have in their databases only, and return the files of each.

        `listed` also writes all views of the first run, so that their names and columns are known.
        """
        wanted = (
            None if tables is None else {each for each in tables if each.startswith(f"{VIEWS}/")}
        )
        runs = [
            run
            for run in self.choice.runs.to_pylist()
            if run["view_part"] is None and run["database_part"] is not None
        ]
        if not runs or not (wanted is None or wanted or listed):
            return {}
        folder = Path(self.enter_context(tempfile.TemporaryDirectory(prefix="msgflow-")))
        made: dict[str, list[str]] = {}
        for run in runs:
            # The part of such views is that of the database, which is in the folder for a moment.
            part = run["database_part"]
            with run_database(self.choice.lake, run, folder) as connection:
                for name in public_views(connection):
                    view = f"{VIEWS}/{name}"
                    if wanted is None or view in wanted or listed:
                        file = folder / view_path(name, part)
                        file.parent.mkdir(parents=True, exist_ok=True)
                        rows = view_rows(connection, name)
                        write_rows(file, name, rows, {KEY: run["run"], PART: part}, "")
                        made.setdefault(view, []).append(str(file))
            listed = False
        return made

    def _files(self, table: str, key: str) -> dict[str, str]:
        """Return the files of a table, each with the version that wrote it; earlier may lack it."""
        runs = self.choice.runs
        written_by = zip(runs[key].to_pylist(), runs["msgflow_version"].to_pylist(), strict=True)
        wanted = {
            part_path(table, part): version for part, version in written_by if part is not None
        }
        there = {entry.path for entry in self.choice.lake.store.entries(table, recursive=False)}
        have_it = {version for path, version in wanted.items() if path in there}
        if table in ANSWERS:
            have_it.add(__version__)
        for path, version in sorted(wanted.items()):
            if path not in there and version in have_it:
                raise FileNotFoundError(f"a file is gone: {path}")
        return {path: version for path, version in sorted(wanted.items()) if path in there}

    def _local_scan(self, name: str, paths: list[str]) -> str:
        self._local_files += paths
        self.connection.execute(f"SET VARIABLE {identifier(name)} = $paths", {"paths": paths})
        return f"read_parquet(getvariable({literal(name)}), union_by_name = true)"

    def _scan(self, table: str, files: dict[str, str]) -> str:
        store = self.choice.lake.store
        name = f"files of {table}"
        paths = [store.full(path) for path in files]
        if store.is_local:
            return self._local_scan(name, paths)
        # Only here: it imports pandas, if that is installed.
        import pyarrow.dataset as ds

        system = store.filesystem
        # Files of one version have the same columns.
        one = {version: store.full(path) for path, version in files.items()}
        schemas = [pq.read_schema(path, filesystem=system) for path in one.values()]
        schema = pa.unify_schemas(
            [each.remove_metadata() for each in schemas], promote_options="permissive"
        )
        dataset: Any = ds.FileSystemDataset.from_paths(
            paths, schema=schema, format=ds.ParquetFileFormat(), filesystem=system
        )
        if len(self.choice.runs) < self.choice.total:
            # Large files: read only the groups of rows with one of the runs.
            keys = self.choice.runs["run"].combine_chunks()
            dataset = dataset.filter(ds.field("run").isin(keys))
        self.connection.register(name, dataset)
        return identifier(name)


@contextmanager
def lake_errors(lake: Lake, *, is_query: bool = False) -> Iterator[None]:
    """Turn errors that the files of a lake cause into a DatabaseError."""
    try:
        yield
    except (duckdb.Error, OSError) as error:
        is_of_files = isinstance(error, duckdb.IOException | OSError) or _STREAM in str(error)
        if is_query and not is_of_files:
            raise
        raise DatabaseError(
            f"cannot read the lake: {first_line(error)} — {lake.store.url}",
            "check that it can be reached, and that only msgflow writes there",
        ) from error
