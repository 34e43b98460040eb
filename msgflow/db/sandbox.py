"""The sandbox: connections of DuckDB without other files, the network or changes to settings.

A connection spills into a directory beside its database. DuckDB makes it when it first needs it,
and removes it when the connection is closed. Processes that read one file have one directory each,
and a later command removes those of killed processes.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import duckdb

from msgflow.db.memory import limit_threads, set_memory_limit
from msgflow.db.workspace import lock_holder, remove_abandoned_workspaces
from msgflow.errors import DatabaseError, DatabaseInUseError, require_utf8
from msgflow.files.temporary_owner import left_behind, mark
from msgflow.sql.failure import in_words

# Older clients (DBeaver, Grafana, notebooks) read files of this storage version. One before it
# would lose which parts of stored statements are MATERIALIZED.
STORAGE_VERSION = "v1.5.0"
# DuckDB's own is four times as large: each small table takes a block, and columns of large ones
# leave room in many. With half of this, times are hardly compressed.
BLOCK_BYTES = 1 << 16
_SPILL = ".spill"
_LET_GO = (
    "try again: msgflow ui lets go of it a few seconds after its pages asked for something; "
    "or end it"
)


def open_file(
    path: Path, *, read_only: bool, memory_limit: str | None = None
) -> duckdb.DuckDBPyConnection:
    """Open any DuckDB file, or create it, in the sandbox."""
    require_file(path)
    config: dict[str, str | bool | int | float | list[str]] = {}
    if not read_only:
        config["storage_compatibility_version"] = STORAGE_VERSION
        config["default_block_size"] = str(BLOCK_BYTES)
    with opening(path):
        con = duckdb.connect(str(path), read_only=read_only, config=config)
        # A file that this process has open already is the same database, with its settings.
        setting = "SELECT current_setting('enable_external_access')"
        if con.execute(setting).fetchall() != [(False,)]:
            try:
                if memory_limit is not None:
                    set_memory_limit(con, memory_limit)
                limit_threads(con)
                _prepare(con)
                con.execute("SET temp_directory = ?", [str(spill_directory(path))])
                shut_in(con)
            except BaseException:
                con.close()  # a later call must not find it half prepared
                raise
    remove_abandoned_spills(path, is_ours_alone=not read_only)
    remove_abandoned_workspaces(path.absolute().parent)
    return con


def open_memory() -> duckdb.DuckDBPyConnection:
    """Open a new database in memory, outside of the sandbox until `shut_in`."""
    con = duckdb.connect(":memory:")
    _prepare(con)
    return con


def shut_in(
    con: duckdb.DuckDBPyConnection,
    *,
    directories: Sequence[Path] = (),
    files: Sequence[str] = (),
    lock: bool = True,
) -> None:
    """Put a connection into the sandbox, which it cannot leave.

    The databases that it has attached stay attached. It may still read and write the files `files`
    and those in `directories`. `lock` also forbids changes of its settings.
    """
    con.execute("SET allowed_directories = ?", [[str(path.absolute()) for path in directories]])
    con.execute("SET allowed_paths = ?", [list(files)])
    con.execute("SET enable_external_access = false")
    if lock:
        con.execute("SET lock_configuration = true")


def spill_directory(database: Path) -> Path:
    """Return the directory that connections of this process to `database` spill to."""
    return _place(database) / f".{database.name}.{mark()}{_SPILL}"


def remove_abandoned_spills(database: Path, *, is_ours_alone: bool) -> None:
    """Remove the spill directories of processes that have ended.

    `is_ours_alone` says that the database is open for writing. No other process can have it open
    then, so that every other spill directory is abandoned.
    """
    prefix = f".{database.name}."
    for directory in left_behind(_place(database), prefix, _SPILL, by_others=is_ours_alone):
        shutil.rmtree(directory, ignore_errors=True)


def _place(database: Path) -> Path:
    parent = database.absolute().parent
    return parent if os.access(parent, os.W_OK) else Path(tempfile.gettempdir())


def require_file(path: Path) -> None:
    """Raise unless a path is a file, or nothing yet."""
    require_utf8(path.absolute(), DatabaseError)
    # DuckDB would wait for a pipe, and read a device to its end.
    if path.exists() and not path.is_file():
        what = "a directory" if path.is_dir() else "a pipe, socket or device"
        raise DatabaseError(f"not a database file but {what} — {path}", "give a file with --db")


def _prepare(con: duckdb.DuckDBPyConnection) -> None:
    con.execute("SET autoinstall_known_extensions = false")
    con.execute("SET autoload_known_extensions = false")
    # DuckDB would draw its progress bar on stdout, which is for data. A notebook without
    # ipywidgets has no bar, and DuckDB refuses the setting there.
    if con.execute("SELECT current_setting('enable_progress_bar')").fetchall() == [(True,)]:
        con.execute("SET enable_progress_bar = false")
    # A cursor of the connection has its global settings only.
    for scope in ("", "GLOBAL"):
        # Names in SQL are tables, never variables of Python.
        con.execute(f"SET {scope} python_enable_replacements = false")
        # DuckDB compares each row on the left of an ASOF join with all on the right if it expects
        # few on the left. Behind filters it expects few where there are thousands.
        con.execute(f"SET {scope} asof_loop_join_threshold = 0")


@contextlib.contextmanager
def opening(path: Path) -> Iterator[None]:
    """Turn errors of opening a file into a DatabaseError."""
    try:
        yield
    except (duckdb.Error, UnicodeDecodeError) as error:
        is_of_file = isinstance(error, duckdb.IOException)
        if is_of_file and "lock" in str(error).lower():
            holder = lock_holder(path)
            raise DatabaseInUseError(
                f"database is in use by another process{holder} — {path}",
                _LET_GO
                if "msgflow ui" in holder
                else "close the program that has it open, or give another file with --db",
            ) from error
        if (words := in_words(error, path)) is not None:
            raise words from error
        permissions = ", or check its permissions" if is_of_file else ""
        raise DatabaseError(
            f"cannot open as a DuckDB database — {path}",
            f"give another file with --db{permissions}",
        ) from error
