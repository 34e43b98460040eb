"""A lake: which runs it holds, and in which files.

A row of the table `run` makes a run visible, and the one of the highest generation counts. What it
names is complete before the row is written, no file of a visible run is ever changed, and one file
may hold many rows, which count all at once.
"""

from __future__ import annotations

import secrets
import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from msgflow.errors import DatabaseError, UsageError
from msgflow.fleet.layout import (
    ABOUT,
    LAKE_REVISION,
    RUN,
    about,
    metadata,
    part_path,
    require_readable,
    run_schema,
    view_path,
)
from msgflow.fleet.parquet import read_parquet
from msgflow.fleet.store import Store

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    import pyarrow as pa

_READ_AT_ONCE = 16
_LATEST = (("generation", "descending"), ("committed_ns", "descending"), ("part", "descending"))


class Lake:
    """A lake at one address, open for reading and writing.

    Attributes:
        store: the files.
    """

    def __init__(self, store: Store) -> None:
        self.store = store

    @classmethod
    def open(cls, url: str | Path) -> Lake:
        """Return the lake at an address.

        Raises:
            DatabaseError: there is none, it is newer than this msgflow, or cannot be read.
            UsageError: no such kind of address.
        """
        store = Store(url)
        content = store.read(ABOUT)
        if content is None:
            raise DatabaseError(
                f"no lake — {store.url}", "msgflow fleet ingest SOURCE --lake makes one"
            )
        require_readable(content, store.url)
        return cls(store)

    @classmethod
    def open_or_create(cls, url: str | Path) -> Lake:
        """Return the lake at an address; a new one where there is nothing yet.

        Raises:
            DatabaseError: something else is there, it is newer than this msgflow, or cannot be
                read and written.
            UsageError: no such kind of address.
        """
        store = Store(url)
        content = store.read(ABOUT)
        if content is None:
            if store.entries(recursive=False) or store.folders():
                raise DatabaseError(
                    f"it holds something else than a lake — {store.url}",
                    "give an empty or a new place with --lake",
                )
            store.put(ABOUT, about())
        else:
            require_readable(content, store.url)
            # Now, instead of after the first recording: may this be written?
            probe = f".probe-{secrets.token_hex(4)}"
            store.put(probe, b"")
            store.delete(probe)
        return cls(store)

    def rows(self, files: Sequence[str] | None = None) -> pa.Table:
        """Return all rows of the table `run`, also those that no longer count.

        Args:
            files: those to read; all when None.
        """
        import pyarrow as pa

        schema = run_schema()
        if files is None:
            files = self.run_files()
        if not files:
            return schema.empty_table()
        try:
            with ThreadPoolExecutor(_READ_AT_ONCE) as pool:
                found = list(pool.map(self.store.read, files))
            contents = [content for content in found if content is not None]
            if len(contents) < len(files):
                raise FileNotFoundError
            return pa.concat_tables([read_parquet(content, schema) for content in contents])
        except FileNotFoundError:
            # Compaction has put them into another file since they were listed.
            return self.rows()
        except (pa.ArrowInvalid, OSError) as error:
            raise DatabaseError(
                f"cannot read the runs of the lake: {_line(error)} — {self.store.url}",
                "check that nobody else than msgflow has written there",
            ) from error

    def run_files(self) -> list[str]:
        """Return the files of the table `run`."""
        return [
            entry.path
            for entry in self.store.entries(RUN, recursive=False)
            if entry.path.endswith(".parquet")
        ]

    def runs(self) -> pa.Table:
        """Return the runs that the lake holds: one row each, by key, columns of `run_schema`.

        Raises:
            DatabaseError: the lake cannot be read.
        """
        return visible(self.rows())

    def commit(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Make runs visible, or those that are replaced or removed: all of them at once.

        What the rows name has to be in the lake already.

        Args:
            rows: values of columns of `run_schema`. A higher `generation` takes the place of what
                counts so far, whatever else is written at the same time; an equal one only where
                nothing else is.

        Raises:
            DatabaseError: the lake cannot be written.
        """
        import pyarrow as pa

        now = time.time_ns()
        whole = [
            dict.fromkeys(run_schema().names)
            | dict(row)
            # Later than the row that it comes from, whatever the clocks of machines say.
            | {"committed_ns": max(now, (row.get("committed_ns") or 0) + 1)}
            | {"lake_revision": LAKE_REVISION}
            for row in rows
        ]
        if not whole:
            return
        table = pa.Table.from_pylist(whole, schema=run_schema())
        first = whole[0]["run"] if len(whole) == 1 else "several"
        revision = next((row["schema_revision"] for row in whole if row["schema_revision"]), "")
        self.put_table(f"{RUN}/{first}-{secrets.token_hex(6)}.parquet", RUN, table, revision)

    def remove(self, keys: Sequence[str]) -> None:
        """Take runs out of the lake; `msgflow fleet compact` deletes their files.

        Raises:
            UsageError: there is no such run.
            DatabaseError: the lake cannot be read or written.
        """
        known = {row["run"]: row for row in self.runs().to_pylist()}
        for key in keys:
            if key not in known:
                raise UsageError(f"the lake has no such run — {key}", "msgflow fleet runs")
        self.commit(
            known[key] | {"is_removed": True, "generation": known[key]["generation"] + 1}
            for key in keys
        )

    def put_table(self, path: str, table_name: str, table: pa.Table, revision: str) -> None:
        """Write a small table as one file.

        Raises:
            DatabaseError: the lake cannot be written.
        """
        import pyarrow as pa
        import pyarrow.parquet

        # With the meanings of the columns, which a table that was read may lack.
        schema = table.schema.with_metadata(metadata(table_name, revision))
        sink = pa.BufferOutputStream()
        pyarrow.parquet.write_table(table.cast(schema), sink, compression="zstd")
        self.store.put(path, sink.getvalue().to_pybytes())

    def files(self, table: str, runs: pa.Table) -> list[str]:
        """Return the files with the answers of some runs, from the root of the lake, sorted.

        They may hold rows of other runs, too, and of these: take those of (run, part).

        Args:
            table: such as 'flow'.
            runs: of `runs`, all or some of its rows.
        """
        parts = {part for part in runs["part"].to_pylist() if part is not None}
        return [part_path(table, part) for part in sorted(parts)]

    def view_files(self, view: str, runs: pa.Table) -> list[str]:
        """Return the files with a public view of some runs, from the root of the lake, sorted."""
        parts = {part for part in runs["view_part"].to_pylist() if part is not None}
        return [view_path(view, part) for part in sorted(parts)]


def visible(rows: pa.Table) -> pa.Table:
    """Return the rows of the table `run` that count, by key."""
    import pyarrow as pa
    import pyarrow.compute as pc

    ordered = rows.sort_by([("run", "ascending"), *_LATEST])
    if not len(ordered):
        return ordered
    keys = ordered["run"].combine_chunks()
    is_first = pc.not_equal(keys[1:], keys[:-1])
    is_first = pa.concat_arrays([pa.array([True]), is_first])
    return ordered.filter(pc.and_(is_first, pc.invert(ordered["is_removed"])))


def _line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
