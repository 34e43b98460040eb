"""Opens database files, and refuses what is not a current msgflow database."""

from __future__ import annotations

import contextlib
import shlex
from typing import TYPE_CHECKING

import duckdb

from msgflow.db.definition import remember, require_ours
from msgflow.db.objects import definition_hash, head_revision, is_before_release, known_revisions
from msgflow.db.spill import most_spilled, remove_abandoned, spill_directory
from msgflow.db.workspace import remove_abandoned_workspaces
from msgflow.errors import DatabaseError
from msgflow.sql.failure import database_errors, in_words

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

# Older clients (DBeaver, Grafana, notebooks) read files of this storage version.
STORAGE_VERSION = "v1.4.0"


def connect(
    path: Path, *, read_only: bool, memory_limit: str | None = None, may_grow: bool = False
) -> duckdb.DuckDBPyConnection:
    """Open an existing, current msgflow database.

    Args:
        path: the database file.
        read_only: open it for reading only; several processes can do so at once.
        memory_limit: most memory that DuckDB takes, such as '2GB'; DuckDB's default when None.
        may_grow: the limit can be changed later: only where nobody else's SQL is run.

    Raises:
        DatabaseError: the file is missing, locked, foreign, or of another schema revision.
    """
    if not path.exists():
        raise DatabaseError(f"no database — {path}", "msgflow ingest TRACE")
    con = open_file(path, read_only=read_only, memory_limit=memory_limit, may_grow=may_grow)
    try:
        require_current(con, path)
    except BaseException:
        con.close()
        raise
    return con


def attach(con: duckdb.DuckDBPyConnection, path: Path, *, is_new: bool = False) -> None:
    """Attach an existing, current msgflow database for writing, and make it the current one.

    Args:
        con: a connection to another database.
        path: the file.
        is_new: this process has just created it: nobody else can have put anything into it.

    Raises:
        DatabaseError: the file is missing, locked, foreign, or of another schema revision.
    """
    if not path.exists():
        raise DatabaseError(f"no database — {path}", "msgflow ingest TRACE")
    quoted = str(path).replace("'", "''")
    _require_file(path)
    with _opening(path):
        con.execute(f"ATTACH '{quoted}' AS target")
    con.execute("USE target")
    if is_new:
        remember(con)
        return
    require_current(con, path)
    remove_abandoned(path, is_ours_alone=True)


def open_file(
    path: Path, *, read_only: bool, memory_limit: str | None = None, may_grow: bool = False
) -> duckdb.DuckDBPyConnection:
    """Open a DuckDB file, or create it, whatever is in it.

    The connection reaches no other file and no network, and its settings cannot be changed,
    but for the memory limit where that may grow.

    Raises:
        DatabaseError: it is locked by another process, or no DuckDB file.
    """
    _require_file(path)
    config: dict[str, str | bool | int | float | list[str]] = {}
    if memory_limit is not None:
        config["memory_limit"] = memory_limit
    if not read_only:
        config["storage_compatibility_version"] = STORAGE_VERSION
    with _opening(path):
        con = duckdb.connect(str(path), read_only=read_only, config=config)
        # A file that this process has open already is the same database, with its settings.
        if not _is_shut_in(con):
            _prepare(con)
            con.execute("SET temp_directory = ?", [str(spill_directory(path))])
            con.execute("SET max_temp_directory_size = ?", [f"{most_spilled(path)}B"])
            shut_in(con)
            if not may_grow:
                con.execute("SET lock_configuration = true")
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
    row = con.execute("SELECT NOT current_setting('enable_external_access')").fetchone()
    return row is not None and bool(row[0])


def _require_file(path: Path) -> None:
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
def _opening(path: Path) -> Iterator[None]:
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


def recorded_revision(con: duckdb.DuckDBPyConnection) -> str | None:
    """Return the schema revision of a database, or None where it is not msgflow's."""
    row = con.execute(
        "SELECT count(*) FROM duckdb_tables() WHERE database_name = current_database() "
        "AND schema_name = 'store' AND table_name IN ('alembic_version', 'definition', 'run')"
    ).fetchone()
    if row is None or row[0] != 3:
        return None
    try:
        revision = con.execute("SELECT version_num FROM store.alembic_version").fetchone()
    except duckdb.BinderException:  # another table of that name
        return None
    return None if revision is None or revision[0] is None else str(revision[0])


def is_empty(con: duckdb.DuckDBPyConnection) -> bool:
    """Tell whether a database has no tables and no views of its own."""
    row = con.execute(
        "SELECT (SELECT count(*) FROM duckdb_tables() WHERE database_name = current_database()) + "
        "(SELECT count(*) FROM duckdb_views() WHERE NOT internal "
        "AND database_name = current_database())"
    ).fetchone()
    return row is not None and row[0] == 0


def require_current(con: duckdb.DuckDBPyConnection, path: Path) -> None:
    """Raise unless the database has the schema revision and the views of this msgflow.

    Neither views nor macros are used for that: what is in a foreign file might do anything.

    Raises:
        DatabaseError: it is foreign, damaged, newer, or has to be upgraded.
    """
    revision = require_known(con, path)
    hint = f"msgflow db upgrade --db {shlex.quote(str(path))}"
    if revision != head_revision():
        raise DatabaseError(
            f"database has schema revision {revision}, this msgflow needs {head_revision()} "
            f"— {path}",
            hint,
        )
    with database_errors(path):
        row = con.execute("SELECT hash FROM store.definition WHERE name = 'views'").fetchone()
        if row is None or row[0] != definition_hash():
            raise DatabaseError(f"database has the views of another msgflow version — {path}", hint)
        require_ours(con, path)


def require_known(con: duckdb.DuckDBPyConnection, path: Path) -> str:
    """Return the revision of a database that this msgflow can read or upgrade.

    Raises:
        DatabaseError: it is foreign, newer, or of before the first release.
    """
    with database_errors(path):
        revision = recorded_revision(con)
    if revision is None:
        raise DatabaseError(
            f"a DuckDB database, but not one of msgflow — {path}", "give another file with --db"
        )
    if is_before_release(revision):
        raise DatabaseError(
            f"database has schema revision {revision}, from before the first release — {path}",
            "ingest the traces into a new file",
        )
    if revision not in known_revisions() and revision <= head_revision():
        raise DatabaseError(
            f"database has a schema revision that no msgflow had: {revision[:40]!r} — {path}",
            "give another file with --db",
        )
    if revision > head_revision():
        raise DatabaseError(
            f"database has schema revision {revision[:40]}, newer than this msgflow knows "
            f"({head_revision()}) — {path}",
            "upgrade msgflow, or give another file with --db",
        )
    return revision
