"""Opens DuckDB files, whatever is in them, shut in: without other files, network or settings."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import duckdb

from msgflow.db.memory import limit_threads, set_memory_limit
from msgflow.db.spill import remove_abandoned, spill_directory
from msgflow.db.workspace import remove_abandoned_workspaces
from msgflow.errors import DatabaseError
from msgflow.sql.failure import in_words

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

# Older clients (DBeaver, Grafana, notebooks) read files of this storage version. One before it
# would lose which parts of stored statements are MATERIALIZED.
STORAGE_VERSION = "v1.5.0"


def open_file(
    path: Path, *, read_only: bool, memory_limit: str | None = None
) -> duckdb.DuckDBPyConnection:
    """Open a DuckDB file, or create it, whatever is in it.

    The connection reaches no other file and no network, and its settings cannot be changed.

    Raises:
        DatabaseError: it is locked by another process, or no DuckDB file; or `memory_limit` is no
            amount of memory.
    """
    require_file(path)
    config: dict[str, str | bool | int | float | list[str]] = {}
    if not read_only:
        config["storage_compatibility_version"] = STORAGE_VERSION
    with opening(path):
        con = duckdb.connect(str(path), read_only=read_only, config=config)
        # A file that this process has open already is the same database, with its settings.
        if not _is_shut_in(con):
            try:
                if memory_limit is not None:
                    set_memory_limit(con, memory_limit)
                limit_threads(con)
                _prepare(con)
                con.execute("SET temp_directory = ?", [str(spill_directory(path))])
                shut_in(con)
                con.execute("SET lock_configuration = true")
            except BaseException:
                con.close()  # nobody may meet it half prepared
                raise
    remove_abandoned(path, is_ours_alone=not read_only)
    remove_abandoned_workspaces(path.absolute().parent)
    return con


def open_memory() -> duckdb.DuckDBPyConnection:
    """Open a new database in memory, which may still attach files: see `shut_in`."""
    con = duckdb.connect(":memory:")
    _prepare(con)
    return con


def shut_in(con: duckdb.DuckDBPyConnection, *, beside: Sequence[Path] = ()) -> None:
    """Close the file system and the network to a connection, but for what it has open.

    Args:
        con: the connection; this cannot be taken back.
        beside: directories that it may write to all the same.
    """
    if beside:
        con.execute("SET allowed_directories = ?", [[str(path.absolute()) for path in beside]])
    con.execute("SET enable_external_access = false")


def _is_shut_in(con: duckdb.DuckDBPyConnection) -> bool:
    # This cannot be taken back, whether the configuration is locked or not.
    found = con.execute("SELECT current_setting('enable_external_access')").fetchall()
    return found == [(False,)]


def require_file(path: Path) -> None:
    """Raise where a path is something else than a file.

    Raises:
        DatabaseError: it is a directory, pipe, socket or device.
    """
    # DuckDB would wait for a pipe, and read a device to its end.
    if path.exists() and not path.is_file():
        what = "a directory" if path.is_dir() else "a pipe, socket or device"
        raise DatabaseError(f"not a database file but {what} — {path}", "give a file with --db")


def _prepare(con: duckdb.DuckDBPyConnection) -> None:
    con.execute("SET autoinstall_known_extensions = false")
    con.execute("SET autoload_known_extensions = false")
    # stdout is for data: DuckDB would draw its bar there when a statement takes long.
    # In a notebook without ipywidgets there is none, and the setting cannot be touched.
    if con.execute("SELECT current_setting('enable_progress_bar')").fetchall() == [(True,)]:
        con.execute("SET enable_progress_bar = false")
    # What is set for a connection is set for those made of it, too, only where it is global.
    for scope in ("", "GLOBAL"):
        # A name that is no table is no variable of Python either.
        con.execute(f"SET {scope} python_enable_replacements = false")
        # Where it expects few rows on the left of an ASOF join, DuckDB compares each of them with
        # all on the right. Behind filters it expects few where there are thousands.
        con.execute(f"SET {scope} asof_loop_join_threshold = 0")


@contextlib.contextmanager
def opening(path: Path) -> Iterator[None]:
    """Raise what opening a file raises as a DatabaseError."""
    try:
        yield
    except duckdb.IOException as error:
        text = str(error)
        if "lock" in text.lower():
            raise DatabaseError(
                f"database is in use by another process — {path}",
                "close the program that has it open, or give another file with --db",
            ) from error
        if (words := in_words(error, path)) is not None:
            raise words from error
        raise DatabaseError(
            f"cannot open as a DuckDB database — {path}",
            "give another file with --db, or check its permissions",
        ) from error
    except (duckdb.Error, UnicodeDecodeError) as error:
        if (words := in_words(error, path)) is not None:
            raise words from error
        raise DatabaseError(
            f"cannot open as a DuckDB database — {path}", "give another file with --db"
        ) from error
