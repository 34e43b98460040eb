"""The lake: its runs, its files, and commits to them.

A row of the table `run` makes a run visible; the row with the highest generation counts. Its files
are complete before the row is written, and no file of a visible run ever changes. One file of the
table may hold many rows, which become visible together.
"""

from __future__ import annotations

import json
import secrets
import shlex
import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from msgflow.db.sandbox import open_memory
from msgflow.errors import DatabaseError, UsageError
from msgflow.files.text_file import MOST_BYTES
from msgflow.fleet.file_store import Store
from msgflow.fleet.layout import (
    ABOUT,
    LAKE_REVISION,
    RUN,
    about,
    metadata,
    part_path,
    require_readable,
    run_schema,
)
from msgflow.fleet.parquet import read_parquet

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    import duckdb
    import pyarrow as pa

COVERED = "msgflow.covered"
_TOGETHER = "together-"
# Fewer files are read as fast as one; a file with more rows is not written again.
_WORTH_IT = 8
_MANY = 10_000
_READ_AT_ONCE = 16
_MOST = 2**63 - 1
_PARTS = ("part", "view_part", "database_part")
_VISIBLE = """
FROM known
WINDOW latest AS (PARTITION BY run ORDER BY generation DESC, committed_ns DESC, part DESC)
QUALIFY row_number() OVER latest = 1 AND NOT is_removed
ORDER BY run
"""


class Lake:
    """A lake at one address, open for reading and writing.

    Attributes:
        store: the files.
    """

    def __init__(self, store: Store) -> None:
        self.store = store
        # Files of the table `run` never change.
        self._known: dict[str, tuple[pa.Table, list[str]]] = {}

    @classmethod
    def open(cls, url: str | Path) -> Lake:
        """Return the lake at an address."""
        store = Store(url, follows_links=False)
        content = store.read(ABOUT, MOST_BYTES)
        if content is None:
            raise DatabaseError(
                f"no lake — {store.url}", "msgflow fleet ingest SOURCE --lake makes one"
            )
        require_readable(content, store.url)
        return cls(store)

    @classmethod
    def open_or_create(cls, url: str | Path) -> Lake:
        """Return the lake at an address, which is created if there is nothing."""
        store = Store(url, follows_links=False)
        content = store.read(ABOUT, MOST_BYTES)
        if content is None:
            if store.entries(recursive=False) or store.folders():
                raise DatabaseError(
                    f"it holds something else than a lake — {store.url}",
                    "give an empty or a new place with --lake",
                )
            store.put(ABOUT, about())
        else:
            require_readable(content, store.url)
            # Find out now, not after the first recording, whether it can be written.
            probe = f".probe-{secrets.token_hex(4)}"
            store.put(probe, b"")
            store.delete(probe)
        return cls(store)

    def rows(self) -> pa.Table:
        """Return all rows of the table `run`, also those that no longer count."""
        import pyarrow as pa

        tables = list(self.rows_by_file().values())
        # Only if needed: making an empty table imports pandas if that is installed.
        return pa.concat_tables(tables) if tables else run_schema().empty_table()

    def rows_by_file(self) -> dict[str, pa.Table]:
        """Return the rows of the table `run` by file, without files that another one replaces."""
        import pyarrow as pa

        files = self.run_files()
        try:
            together = [file for file in files if _is_together(file)]
            found = self._read_runs(together)
            covered = {path for _, paths in found.values() for path in paths}
            alone = [file for file in files if not _is_together(file) and file not in covered]
            found |= self._read_runs(alone)
            return {path: rows for path, (rows, _) in found.items() if path not in covered}
        except FileNotFoundError:
            # Compaction has deleted files since they were listed: another one replaces them.
            return self.rows_by_file()
        except (pa.ArrowException, OSError) as error:
            raise DatabaseError(
                f"cannot read the runs of the lake: {_line(error)} — {self.store.url}",
                "check that nobody else than msgflow has written there",
            ) from error

    def _read_runs(self, files: Sequence[str]) -> dict[str, tuple[pa.Table, list[str]]]:
        """Return the rows of files of the table `run`, and the files that each replaces."""
        schema = run_schema()
        unknown = [path for path in files if path not in self._known]
        with ThreadPoolExecutor(_READ_AT_ONCE) as pool:
            contents = list(pool.map(self.store.read, unknown))
        for path, content in zip(unknown, contents, strict=True):
            if content is None:
                raise FileNotFoundError(path)
            covered = _covered(content) if _is_together(path) else []
            rows = read_parquet(content, schema)
            _require_sound(rows, self.store.url_of(path))
            self._known[path] = (rows, covered)
        return {path: self._known[path] for path in files}

    def put_together(self) -> int:
        """Write the rows of many small files of the table `run` into one that replaces them.

        It has the same rows, so that nothing changes for readers and writers. The small files stay
        for current readers until `compact` deletes them.

        Returns:
            Number of files that the new one replaces; 0 if there are few.
        """
        import pyarrow as pa

        rows = {path: table for path, table in self.rows_by_file().items() if len(table) < _MANY}
        if len(rows) < _WORTH_IT:
            return 0
        revisions = {
            each for table in rows.values() for each in table["schema_revision"].to_pylist()
        }
        self.put_table(
            f"{RUN}/{_TOGETHER}{secrets.token_hex(8)}.parquet",
            RUN,
            pa.concat_tables(rows.values()),
            max((each for each in revisions if each), default=""),
            {COVERED: json.dumps(sorted(self._covered_by(rows)))},
        )
        return len(rows)

    def _covered_by(self, files: Iterable[str]) -> set[str]:
        """Return files of the table `run`, and the existing files that they replace."""
        covered = set(files)
        there = set(self.run_files())
        for path in files:
            content = self.store.read(path) if _is_together(path) else None
            covered |= there.intersection(_covered(content)) if content else set()
        return covered

    def covered(self) -> dict[str, str]:
        """Return the replaced files of the table `run`, each with a file that replaces it."""
        found: dict[str, str] = {}
        files = self.run_files()
        for path in files:
            content = self.store.read(path) if _is_together(path) else None
            if content is not None:
                found |= dict.fromkeys(set(files).intersection(_covered(content)), path)
        return found

    def run_files(self) -> list[str]:
        """Return the files of the table `run`."""
        return [
            entry.path
            for entry in self.store.entries(RUN, recursive=False)
            if entry.path.endswith(".parquet")
        ]

    def runs(self) -> pa.Table:
        """Return the runs that the lake holds: one row each, by key, columns of `run_schema`."""
        return visible(self.rows())

    def commit(self, rows: Iterable[Mapping[str, Any]]) -> str:
        """Add, replace or remove runs, all of them at once.

        The files that the rows name have to be in the lake already.

        Returns:
            The file with the rows; '' without rows.
        """
        import pyarrow as pa

        now = time.time_ns()
        whole = [
            dict.fromkeys(run_schema().names)
            | dict(row)
            # Later than the row that it replaces, even if the clocks of machines differ.
            | {"committed_ns": min(max(now, (row.get("committed_ns") or 0) + 1), _MOST)}
            | {"lake_revision": LAKE_REVISION}
            for row in rows
        ]
        if not whole:
            return ""
        table = pa.Table.from_pylist(whole, schema=run_schema())
        first = whole[0]["run"] if len(whole) == 1 else "several"
        revision = next((row["schema_revision"] for row in whole if row["schema_revision"]), "")
        path = f"{RUN}/{first}-{secrets.token_hex(6)}.parquet"
        self.put_table(path, RUN, table, revision)
        return path

    def remove(self, keys: Sequence[str]) -> int:
        """Remove runs from the lake; `msgflow fleet compact` deletes their files.

        Returns:
            Their number, without keys that are given twice.
        """
        known = {row["run"]: row for row in self.runs().to_pylist()}
        keys = tuple(dict.fromkeys(keys))
        for key in keys:
            if key not in known:
                raise UsageError(
                    f"the lake has no such run — {key}",
                    f"msgflow fleet runs --lake {shlex.quote(self.store.url)}",
                )
        self.commit(
            known[key]
            | {"is_removed": True, "generation": min(known[key]["generation"] + 1, _MOST)}
            for key in keys
        )
        return len(keys)

    def put_table(
        self,
        path: str,
        table_name: str,
        table: pa.Table,
        revision: str,
        more: Mapping[str, str] | None = None,
    ) -> None:
        """Write a small table as one file."""
        import pyarrow as pa
        import pyarrow.parquet

        # The schema has the descriptions of columns, which the table may lack.
        schema = table.schema.with_metadata(metadata(table_name, revision) | dict(more or {}))
        sink = pa.BufferOutputStream()
        pyarrow.parquet.write_table(table.cast(schema), sink, compression="zstd")
        self.store.put(path, sink.getvalue().to_pybytes())

    def files(self, table: str, runs: pa.Table) -> list[str]:
        """Return the files with the answers of some runs, from the root of the lake, sorted.

        They may also hold rows of other runs: select by (run, part).
        """
        parts = {part for part in runs["part"].to_pylist() if part is not None}
        return [part_path(table, part) for part in sorted(parts)]


def visible(rows: pa.Table, con: duckdb.DuckDBPyConnection | None = None) -> pa.Table:
    """Return the rows of the table `run` that count, by key."""
    import pyarrow as pa

    if con is None:
        with open_memory() as con:
            return visible(rows, con)
    # SQL, as importing pyarrow.compute takes longer.
    con.register("known", rows)
    found = con.sql(_VISIBLE).to_arrow_table()
    con.unregister("known")
    return pa.Table.from_arrays(found.columns, schema=rows.schema)


def _require_sound(rows: pa.Table, url: str) -> None:
    """Raise unless rows of the table `run` have what their order and their files depend on."""
    lacking = [
        name
        for name in ("run", "generation", "is_removed", "committed_ns")
        if rows[name].null_count
    ]
    parts = (name for key in _PARTS for name in rows[key].to_pylist() if name is not None)
    if lacking or any("/" in name for name in parts):
        what = f"a row without {lacking[0]}" if lacking else "a part that is no name"
        raise DatabaseError(
            f"cannot read the runs of the lake: {what} — {url}",
            "delete this file; the recordings of its runs have to be ingested again",
        )


def _is_together(path: str) -> bool:
    return path.startswith(f"{RUN}/{_TOGETHER}")


def _covered(content: bytes) -> list[str]:
    """Return the files that a file of the table `run` replaces."""
    import pyarrow as pa
    import pyarrow.parquet

    metadata = pyarrow.parquet.read_schema(pa.BufferReader(content)).metadata or {}
    try:
        return [str(path) for path in json.loads(metadata.get(COVERED.encode(), b"[]"))]
    except (ValueError, TypeError) as error:
        raise pa.ArrowInvalid(f"its metadata {COVERED} are no list") from error


def _line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
