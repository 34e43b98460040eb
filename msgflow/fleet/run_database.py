"""The database of one run of a lake, restored as an ordinary file."""

from __future__ import annotations

import contextlib
import os
import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa

from msgflow.db.connection import connect
from msgflow.db.migration import upgrade
from msgflow.errors import DatabaseError, MsgflowError, UsageError
from msgflow.files.temporary_owner import temporary_directory
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import database_path
from msgflow.fleet.part import run_key
from msgflow.trace.extraction import LIMIT_VARIABLE, limit_of

_CHUNK = 8 * 1024 * 1024
_SHORTEST = 4


@dataclass(frozen=True)
class OpenedRun:
    """A restored run."""

    run: str  # its key
    name: str
    path: Path  # the database
    size: int  # bytes of it
    before: str | None  # the schema revision before the upgrade; None if it had the current one


def open_run(lake: Lake, run: str, path: Path | None = None) -> OpenedRun:
    """Write the database of a run of a lake into a new file.

    It is the database of the ingest. Its packets are compared with the key of the run, and it is
    upgraded if an earlier msgflow made it.
    """
    row = _row(lake, run)
    target = Path(f"{row['run']}.duckdb") if path is None else path
    if os.path.lexists(target):
        raise UsageError(f"the file exists already — {target}", "give another one with -o")
    if not target.parent.is_dir():
        raise UsageError(f"there is no such folder — {target.parent}", "make it, or give another")
    if row["database_part"] is None:
        raise UsageError(
            f"the lake has no database of this run, it was written with --no-database"
            f" — {row['run']}",
            f"msgflow ingest {shlex.quote(row['source'] or '')}",
        )
    try:
        with temporary_directory(f".{target.name}.", str(target.parent)) as folder:
            aside = folder / target.name
            before = _restore(lake, row, aside)
            try:
                # This fails if the file exists by now.
                os.link(aside, target)
            except FileExistsError:
                raise UsageError(
                    f"the file exists already — {target}", "give another one with -o"
                ) from None
            except OSError:  # a file system without links
                aside.replace(target)
    except OSError as error:
        raise UsageError(f"cannot write the file: {error.strerror} — {target}") from error
    return OpenedRun(row["run"], row["name"], target, target.stat().st_size, before)


@contextmanager
def run_database(
    lake: Lake, row: Mapping[str, Any], folder: Path
) -> Iterator[duckdb.DuckDBPyConnection]:
    """Open the database of a run for reading, in a file of this folder that is gone afterwards."""
    file = folder / f"{row['run']}.duckdb"
    try:
        _restore(lake, row, file)
        with contextlib.closing(connect(file, read_only=True)) as con:
            yield con
    finally:
        file.unlink(missing_ok=True)


def _row(lake: Lake, run: str) -> dict[str, Any]:
    rows: list[dict[str, Any]] = lake.runs().to_pylist()
    found = [row for row in rows if row["run"] == run] or [
        row
        for row in rows
        if row["name"] == run or (len(run) >= _SHORTEST and row["run"].startswith(run))
    ]
    if not found:
        raise UsageError(
            f"the lake has no such run — {run}",
            f"msgflow fleet runs --lake {shlex.quote(lake.store.url)}",
        )
    if len(found) > 1:
        keys = ", ".join(row["run"] for row in found[:3])
        raise UsageError(f"{len(found)} runs are called so — {run}", f"give a key: {keys}")
    return found[0]


def _restore(lake: Lake, row: Mapping[str, Any], target: Path) -> str | None:
    """Write the database of a run into a new file, upgraded.

    Returns:
        Its schema revision before, None if that was the current one.
    """
    path = database_path(row["database_part"])
    packed = target.with_name(f"{target.name}.zst")
    if lake.store.entry(path) is None:
        raise _unusable(lake, path, "it is gone")
    lake.store.fetch(path, packed)
    try:
        _unpack(packed, target, lake.store.url_of(path))
    except OSError as error:
        if error.errno is not None:
            raise
        # Arrow says so of what is not compressed, or not whole.
        raise _unusable(lake, path, str(error)) from error
    packed.unlink()
    before = None
    try:
        try:
            con = connect(target, read_only=True)
        except DatabaseError:  # an earlier msgflow made it
            done = upgrade(target)
            before = done.before if done.before != done.after else None
            con = connect(target, read_only=True)
        with contextlib.closing(con):
            ids = con.execute("SELECT run_id FROM main.run").fetchall()
            is_it = len(ids) == 1 and run_key(con, ids[0][0]) == row["run"]
    except MsgflowError as error:
        raise _unusable(lake, path, error.message.partition(" — ")[0]) from error
    if not is_it:
        raise _unusable(lake, path, "it is that of another run")
    return before


def _unpack(packed: Path, target: Path, url: str) -> None:
    most, size = limit_of(packed.stat().st_size), 0
    with pa.CompressedInputStream(str(packed), "zstd") as source, target.open("xb") as file:
        while chunk := source.read(_CHUNK):
            size += len(chunk)
            if size > most:
                raise DatabaseError(
                    f"the database has more than {most:,} bytes unpacked — {url}",
                    f"{LIMIT_VARIABLE}=100GB msgflow … reads it, if you know who made it",
                )
            file.write(chunk)


def _unusable(lake: Lake, path: str, words: str) -> DatabaseError:
    url = lake.store.url_of(path)
    return DatabaseError(
        f"the database in the lake cannot be used: {words} — {url}",
        "msgflow fleet ingest SOURCE --lake LAKE --replace writes it again",
    )
