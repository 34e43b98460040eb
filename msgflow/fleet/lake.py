"""The lake: its runs, its failed recordings, its files, and commits to them.

The file `run/KEY.parquet` makes a run visible, and takes the place of an earlier one at once. The
part that it names is complete before, and no file of a part ever changes. So there are no locks: of
two writers of a run, the last counts.
"""

from __future__ import annotations

import shlex
import time
from collections.abc import Collection, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet

from msgflow.db.sandbox import open_memory
from msgflow.errors import DatabaseError, UsageError
from msgflow.files.text_file import MOST_BYTES
from msgflow.fleet import layout
from msgflow.fleet.file_store import READ_AT_ONCE, Store
from msgflow.fleet.layout import read_parquet
from msgflow.result.query_result import QueryResult
from msgflow.sql.failure import first_line
from msgflow.sql.statement import registered
from msgflow.version import __version__

# How long a writer may take from its first file to its commit, at most.
_DAY_NS = 86_400 * 10**9

# Labels as KEY=VALUE, for people.
_LABELS = """
nullif(list_transform(map_entries(labels), lambda each: each.key || '=' || each.value), [])
"""
_RUNS = f"""
SELECT run, name, {_LABELS} AS labels, start_ns, end_ns, event_count, source, msgflow_version,
    seconds, tries, worker, part
FROM listed
"""
_FAILURES = f"SELECT * REPLACE ({_LABELS} AS labels) FROM listed"


class Lake:
    """A lake at one address, open for reading and writing."""

    def __init__(self, store: Store) -> None:
        self.store = store

    @classmethod
    def open(cls, url: str | Path, *, create: bool = False) -> Lake:
        """Return the lake at an address, which may be created if there is nothing."""
        store = Store(url, follows_links=False)
        # First: what another process writes meanwhile, it writes behind the file that is read next.
        # It may just be making a lake there.
        is_free = create and all(name.startswith(f".{layout.ABOUT}.") for name in store.names())
        content = store.read(layout.ABOUT, MOST_BYTES)
        if content is not None:
            layout.require_readable(content, store.url)
        elif not create:
            raise DatabaseError(
                f"no lake — {store.url}", "msgflow fleet ingest SOURCE --lake makes one"
            )
        elif not is_free:
            raise DatabaseError(
                f"it holds something else than a lake — {store.url}",
                "give an empty or a new place with --lake",
            )
        if create:
            # Also where it exists: so it fails now if nothing can be written, not later.
            store.put(layout.ABOUT, layout.about())
        return cls(store)

    def runs(self) -> pa.Table:
        """Return the runs that the lake holds: one row each, by key, columns of `RUN_SCHEMA`."""
        # Only a bucket makes one wait.
        with ThreadPoolExecutor(1 if self.store.is_local else READ_AT_ONCE) as pool:
            # One that is gone by now was removed meanwhile.
            tables = [rows for rows in pool.map(self._rows, self.keys()) if rows is not None]
        if not tables:
            return layout.RUN_SCHEMA.empty_table()
        return pa.concat_tables(tables).combine_chunks()

    def keys(self) -> list[str]:
        """Return the keys of all runs."""
        names = self.store.names(layout.RUN)
        return [name.removesuffix(".parquet") for name in names if _is_parquet(name)]

    def run(self, key: str) -> dict[str, Any] | None:
        """Return the row of a run as it is now, None if there is no such run."""
        rows = self._rows(key)
        return None if rows is None else dict(rows.to_pylist()[0])

    def _rows(self, key: str) -> pa.Table | None:
        path = layout.run_path(key)
        hint = "check that only msgflow writes there"
        rows = self._read(path, layout.RUN_SCHEMA, "the runs", hint)
        if rows is not None and (wrong := _unsound(rows, key)) is not None:
            raise DatabaseError(
                f"cannot read the runs of the lake: {wrong} — {self.store.url_of(path)}",
                "delete this file; the recording of its run has to be ingested again",
            )
        return rows

    def _read(self, path: str, schema: pa.Schema, what: str, hint: str) -> pa.Table | None:
        content = self.store.read(path)
        try:
            return None if content is None else read_parquet(content, schema)
        except (pa.ArrowException, OSError) as error:
            url = self.store.url_of(path)
            words = f"cannot read {what} of the lake: {first_line(error)} — {url}"
            raise DatabaseError(words, hint) from error

    def commit(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Add or replace runs, one after the other.

        The files that the rows name have to be in the lake already.
        """
        for row in rows:
            whole = {**row, "committed_ns": time.time_ns(), "lake_revision": layout.LAKE_REVISION}
            table = pa.Table.from_pylist([whole], schema=layout.RUN_SCHEMA)
            path = layout.run_path(row["run"])
            self.put_table(path, layout.RUN, table, row.get("schema_revision") or "")

    def remove(self, keys: Iterable[str]) -> set[str | None]:
        """Remove runs, and return the parts with their files, which `clean_up` deletes."""
        wanted = sorted(set(keys))
        if missing := sorted(set(wanted).difference(self.keys())):
            raise UsageError(
                f"the lake has no such run — {missing[0]}",
                f"msgflow fleet runs --lake {shlex.quote(self.store.url)}",
            )
        rows = [self.run(key) or {} for key in wanted]
        for key in wanted:
            self.store.delete(layout.run_path(key))
        return {row.get(name) for row in rows for name in ("part", "database_part")}

    def clean_up(self, parts: Collection[str | None] = ()) -> tuple[int, int]:
        """Delete the files of removed parts, and those of a day ago or older that no run names.

        Such files are of runs that were replaced, and of killed writers.

        Returns:
            The number of deleted files, and of their bytes.
        """
        runs = self.runs()
        if not parts and not len(runs):
            raise DatabaseError(
                f"the lake has no run — {self.store.url_of(layout.RUN)}",
                "is its file system mounted? A lake of no use is a folder that you can delete",
            )
        needed = {*runs["part"].to_pylist(), *runs["database_part"].to_pylist()}
        latest = time.time_ns() - _DAY_NS
        unneeded = [
            entry
            for entry in self.store.entries()
            if (part := layout.part_of(entry.path)) is not None
            and part not in needed
            and (part in parts or entry.changed_ns < latest)
        ]
        for entry in unneeded:
            self.store.delete(entry.path)
        return len(unneeded), sum(entry.size for entry in unneeded)

    def failures(self) -> pa.Table:
        """Return the failed recordings: one row each, by source, columns of `FAILURE_SCHEMA`."""
        tables = [layout.FAILURE_SCHEMA.empty_table()]
        hint = "delete this file; its recording will be tried again"
        for name in filter(_is_parquet, self.store.names(layout.FAILURE)):
            path = f"{layout.FAILURE}/{name}"
            rows = self._read(path, layout.FAILURE_SCHEMA, "a failure", hint)
            # Another process may have ingested the recording and deleted this file meanwhile.
            tables += [] if rows is None else [rows]
        return pa.concat_tables(tables).sort_by("source")

    def write_failure(self, values: Mapping[str, Any]) -> None:
        """Write the failure of a recording, in place of an earlier one."""
        row = {**values, "msgflow_version": __version__, "failed_ns": time.time_ns()}
        table = pa.Table.from_pylist([row], schema=layout.FAILURE_SCHEMA)
        self.put_table(layout.failure_path(row["source"]), layout.FAILURE, table, "")

    def forget_failure(self, source: str) -> None:
        """Delete the failure of a recording, which is in the lake now."""
        self.store.delete(layout.failure_path(source))

    def put_table(self, path: str, table_name: str, table: pa.Table, revision: str) -> None:
        """Write a small table as one file."""
        # The schema has the descriptions of columns, which the table may lack.
        schema = table.schema.with_metadata(layout.metadata(table_name, revision))
        sink = pa.BufferOutputStream()
        # Thousands of files have one row: to unpack it would take longer than to read it.
        pyarrow.parquet.write_table(
            table.cast(schema), sink, compression="none", use_dictionary=False
        )
        self.store.put(path, sink.getvalue().to_pybytes())


def list_runs(lake: Lake) -> QueryResult:
    """Return the runs of a lake: the table `run`, with labels as KEY=VALUE."""
    return _listed(lake.runs(), _RUNS)


def list_failures(lake: Lake) -> QueryResult:
    """Return the failed recordings: the table `fleet_failure`, with labels as KEY=VALUE."""
    return _listed(lake.failures(), _FAILURES)


def _listed(rows: pa.Table, sql: str) -> QueryResult:
    with open_memory() as con, registered(con, listed=rows):
        return QueryResult(con.sql(sql).to_arrow_table())


def _is_parquet(name: str) -> bool:
    # A file that is being written begins with a dot.
    return name.endswith(".parquet")


def _unsound(rows: pa.Table, key: str) -> str | None:
    """Say what a row of the table `run` lacks on which its files depend, None if nothing."""
    if rows["run"].to_pylist() != [key]:
        return "a file with another name than its run"
    parts = (rows["part"][0].as_py(), rows["database_part"][0].as_py())
    return "a part that is no name" if any("/" in (part or "") for part in parts) else None
