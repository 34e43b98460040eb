"""The lake: its runs, its failed recordings, its files, and commits to them.

The file `run/KEY.parquet` makes a run visible, and takes the place of an earlier one at once. The
part that it names is complete before, and no file of a part ever changes. `pack` puts the rows of
all runs into one file; a run that is replaced afterwards has its own file again, which counts.
"""

from __future__ import annotations

import fcntl
import os
import shlex
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet

from msgflow.db.sandbox import open_memory
from msgflow.errors import DatabaseError, UsageError
from msgflow.files.text_file import MOST_BYTES
from msgflow.fleet import layout
from msgflow.fleet.file_store import Store
from msgflow.fleet.layout import read_parquet
from msgflow.result.query_result import QueryResult
from msgflow.sql.failure import first_line
from msgflow.sql.statement import registered
from msgflow.version import __version__

_READ_AT_ONCE = 16
# Small groups of rows, run after run: a query of few runs reads few groups of a pack.
_ROW_GROUP = 20_000
_MOST = 2**63 - 1
_NAMES = ("run", "part", "view_part", "database_part")
_LAST = """
FROM known
QUALIFY row_number() OVER (PARTITION BY run ORDER BY committed_ns DESC) = 1
ORDER BY run
"""

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
        is_free = create and _is_free(store)
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
        with ThreadPoolExecutor(1 if self.store.is_local else _READ_AT_ONCE) as pool:
            # One that is gone by now was removed meanwhile.
            tables = [rows for rows in pool.map(self._rows, self.names()) if rows is not None]
        if not tables:
            return layout.RUN_SCHEMA.empty_table()
        rows = pa.concat_tables(tables).combine_chunks()
        # SQL, as importing pyarrow.compute takes longer.
        with open_memory() as con, registered(con, known=rows):
            return pa.Table.from_arrays(con.sql(_LAST).to_arrow_table().columns, schema=rows.schema)

    def names(self) -> list[str]:
        """Return the names of the files of the table `run`: keys of runs, and `PACKED`."""
        # `pack` would delete the files of runs that are not listed.
        self.store.require_files(layout.RUN, ".parquet")
        return [
            entry.path.removeprefix(f"{layout.RUN}/").removesuffix(".parquet")
            for entry in self.store.entries(layout.RUN, recursive=False)
            if entry.path.endswith(".parquet")
        ]

    def run(self, key: str) -> dict[str, Any] | None:
        """Return the row in a run's own file as it is now, None if there is no such file."""
        rows = self._rows(key)
        return None if rows is None else dict(rows.to_pylist()[0])

    def _rows(self, name: str) -> pa.Table | None:
        """Return the rows of a file of the table `run`, None if there is no such file."""
        hint = "check that only msgflow writes there"
        rows = self._read(layout.run_path(name), layout.RUN_SCHEMA, "the runs", hint)
        if rows is not None:
            _require_sound(rows, name, self.store.url_of(layout.run_path(name)))
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

        The files that the rows name have to be in the lake already. `committed_ns` may be that of
        the row before.
        """
        for row in rows:
            # Later than the row before, even if the clocks of machines differ.
            moment = max(time.time_ns(), (row.get("committed_ns") or 0) + 1)
            self._put_runs(row["run"], [{**row, "committed_ns": min(moment, _MOST)}])

    def pack_runs(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Write all rows of the table `run` into one file, in place of all others."""
        self._put_runs(layout.PACKED, rows)

    def _put_runs(self, name: str, rows: Sequence[Mapping[str, Any]]) -> None:
        whole = [{**row, "lake_revision": layout.LAKE_REVISION} for row in rows]
        table = pa.Table.from_pylist(whole, schema=layout.RUN_SCHEMA)
        revision = max((row.get("schema_revision") or "" for row in whole), default="")
        self.put_table(layout.run_path(name), layout.RUN, table, revision)

    def remove(self, keys: Iterable[str], *, of: str | None = None) -> int:
        """Remove runs from the lake; `msgflow fleet pack` deletes their files.

        `of` leaves runs that are not of this source, or no longer there.

        Returns:
            Their number, without keys that are given twice.
        """
        wanted = set(keys)
        # Of two at the same time, the second would write again what the first one took out.
        with self.changing():
            own = set(self.names()) - {layout.PACKED}
            rows = self._rows(layout.PACKED)
            packed = {row["run"]: row for row in (() if rows is None else rows.to_pylist())}
            if of is not None:
                now = {key: self.run(key) or packed.get(key) for key in wanted}
                wanted = {key for key, row in now.items() if row and row["source"] == of}
            if missing := sorted(wanted - own - packed.keys()):
                raise UsageError(
                    f"the lake has no such run — {missing[0]}",
                    f"msgflow fleet runs --lake {shlex.quote(self.store.url)}",
                )
            kept = [row for key, row in packed.items() if key not in wanted]
            # This first: else the earlier row would count, once the own file of the run is gone.
            # Where no run is left, the file without a row says so to `pack`.
            if len(kept) < len(packed) or (wanted and not kept and own <= wanted):
                self.pack_runs(kept)
            for key in wanted:
                self.store.delete(layout.run_path(key))
        return len(wanted)

    def failures(self) -> pa.Table:
        """Return the failed recordings: one row each, by source, columns of `FAILURE_SCHEMA`."""
        tables = [layout.FAILURE_SCHEMA.empty_table()]
        hint = "delete this file; its recording will be tried again"
        for entry in self.store.entries(layout.FAILURE, recursive=False):
            if entry.path.endswith(".parquet"):
                rows = self._read(entry.path, layout.FAILURE_SCHEMA, "a failure", hint)
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
        """Write a table as one file."""
        # The schema has the descriptions of columns, which the table may lack.
        schema = table.schema.with_metadata(layout.metadata(table_name, revision))
        sink = pa.BufferOutputStream()
        # Thousands of files have one row: to unpack it would take longer than to read it.
        is_small = len(table) <= 1
        pyarrow.parquet.write_table(
            table.cast(schema),
            sink,
            compression="none" if is_small else "zstd",
            use_dictionary=not is_small,
            row_group_size=_ROW_GROUP,
        )
        self.store.put(path, sink.getvalue().to_pybytes())

    def writing(self, *, alone: bool = False) -> AbstractContextManager[None]:
        """Raise an error if another process packs the lake; alone: if one writes to it at all.

        A bucket has no locks.
        """
        return self._locked("", fcntl.LOCK_NB | (fcntl.LOCK_EX if alone else fcntl.LOCK_SH))

    def changing(self) -> AbstractContextManager[None]:
        """Keep others from changing the table `run` meanwhile, where there are locks."""
        if self.store.is_local:
            with suppress(OSError):  # writing there will tell
                os.makedirs(self.store.full(layout.RUN), exist_ok=True)
        return self._locked(layout.RUN, fcntl.LOCK_EX)

    @contextmanager
    def _locked(self, path: str, kind: int) -> Iterator[None]:
        folder = self.store.full(path)
        if not self.store.is_local or not os.path.isdir(folder):
            yield
            return
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            with suppress(OSError):  # a network file system may have no locks
                try:
                    fcntl.flock(descriptor, kind)
                except BlockingIOError as error:
                    raise DatabaseError(
                        f"another msgflow writes to the lake — {self.store.url}",
                        "wait until it has ended: msgflow fleet pack works alone",
                    ) from error
            yield
        finally:
            os.close(descriptor)


def list_runs(lake: Lake) -> QueryResult:
    """Return the runs of a lake: the table `run`, with labels as KEY=VALUE."""
    return _listed(lake.runs(), _RUNS)


def list_failures(lake: Lake) -> QueryResult:
    """Return the failed recordings: the table `fleet_failure`, with labels as KEY=VALUE."""
    return _listed(lake.failures(), _FAILURES)


def _listed(rows: pa.Table, sql: str) -> QueryResult:
    with open_memory() as con, registered(con, listed=rows):
        return QueryResult(con.sql(sql).to_arrow_table())


def _is_free(store: Store) -> bool:
    """Tell whether there is nothing, or no more than another process that makes a lake there."""
    found = [each.path for each in store.entries(recursive=False)] + store.folders()
    return all(name.startswith(f".{layout.ABOUT}.") for name in found)


def _require_sound(rows: pa.Table, name: str, url: str) -> None:
    """Raise unless rows of the table `run` have what their order and their files depend on."""
    wrong = [f"a row without {each}" for each in ("run", "committed_ns") if rows[each].null_count]
    for key in _NAMES:
        if any("/" in each for each in rows[key].to_pylist() if each is not None):
            wrong.append(f"a {key} that is no name")
    if name != layout.PACKED and rows["run"].to_pylist() != [name]:
        wrong.append("a file with another name than its run")
    if wrong:
        raise DatabaseError(
            f"cannot read the runs of the lake: {wrong[0]} — {url}",
            "delete this file; the recordings of its runs have to be ingested again",
        )
