"""Opens database files, and refuses what is not a current msgflow database."""

from __future__ import annotations

import contextlib
import os
import shlex
from typing import TYPE_CHECKING

import duckdb

from msgflow.db.objects import definition_hash, head_revision
from msgflow.errors import DatabaseError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

# Older clients (DBeaver, Grafana, notebooks) read files of this storage version.
STORAGE_VERSION = "v1.4.0"


def connect(
    path: Path, *, read_only: bool, memory_limit: str | None = None
) -> duckdb.DuckDBPyConnection:
    """Open an existing, current msgflow database.

    Args:
        path: the database file.
        read_only: open it for reading only; several processes can do so at once.
        memory_limit: most memory that DuckDB takes, such as '2GB'; DuckDB's default when None.

    Raises:
        DatabaseError: the file is missing, locked, foreign, or of another schema revision.
    """
    if not path.exists():
        raise DatabaseError(f"no database — {path}", "msgflow ingest TRACE")
    con = open_file(path, read_only=read_only, memory_limit=memory_limit)
    try:
        require_current(con, path)
    except BaseException:
        con.close()
        raise
    return con


def attach(con: duckdb.DuckDBPyConnection, path: Path) -> None:
    """Attach an existing, current msgflow database for writing, and make it the current one.

    Raises:
        DatabaseError: the file is missing, locked, foreign, or of another schema revision.
    """
    if not path.exists():
        raise DatabaseError(f"no database — {path}", "msgflow ingest TRACE")
    quoted = str(path).replace("'", "''")
    with _opening(path):
        con.execute(f"ATTACH '{quoted}' AS target")
    con.execute("USE target")
    require_current(con, path)


def open_file(
    path: Path, *, read_only: bool, memory_limit: str | None = None
) -> duckdb.DuckDBPyConnection:
    """Open a DuckDB file, or create it, whatever is in it.

    Raises:
        DatabaseError: it is locked by another process, or no DuckDB file.
    """
    config: dict[str, str | bool | int | float | list[str]] = {}
    if memory_limit is not None:
        config["memory_limit"] = memory_limit
    if not read_only:
        config["storage_compatibility_version"] = STORAGE_VERSION
    with _opening(path):
        con = duckdb.connect(str(path), read_only=read_only, config=config)
        _prepare(con)
        return con


def open_memory() -> duckdb.DuckDBPyConnection:
    """Open a new database in memory."""
    con = duckdb.connect(":memory:")
    _prepare(con)
    return con


def _prepare(con: duckdb.DuckDBPyConnection) -> None:
    # stdout is for data: DuckDB would draw its bar there when a statement takes long.
    con.execute("SET enable_progress_bar = false")
    # Where it expects few rows on the left of an ASOF join, DuckDB compares each of them with
    # all on the right. Behind filters it expects few where there are thousands.
    con.execute("SET asof_loop_join_threshold = 0")


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
        if os.path.isdir(path):
            raise DatabaseError(
                f"not a database file but a directory — {path}", "give a file with --db"
            ) from error
        raise DatabaseError(
            f"cannot open as a DuckDB database — {path}",
            "give another file with --db, or check its permissions",
        ) from error
    except duckdb.Error as error:
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
    revision = con.execute("SELECT version_num FROM store.alembic_version").fetchone()
    return None if revision is None else str(revision[0])


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

    Raises:
        DatabaseError: it is foreign, newer, or has to be upgraded.
    """
    revision = require_known(con, path)
    hint = f"msgflow db upgrade --db {shlex.quote(str(path))}"
    if revision != head_revision():
        raise DatabaseError(
            f"database has schema revision {revision}, this msgflow needs {head_revision()} "
            f"— {path}",
            hint,
        )
    row = con.execute("SELECT hash FROM store.definition WHERE name = 'views'").fetchone()
    if row is None or row[0] != definition_hash():
        raise DatabaseError(f"database has the views of another msgflow version — {path}", hint)


def require_known(con: duckdb.DuckDBPyConnection, path: Path) -> str:
    """Return the revision of a database that this msgflow can read or upgrade.

    Raises:
        DatabaseError: it is foreign or newer.
    """
    revision = recorded_revision(con)
    if revision is None:
        raise DatabaseError(
            f"a DuckDB database, but not one of msgflow — {path}", "give another file with --db"
        )
    if revision > head_revision():
        raise DatabaseError(
            f"database has schema revision {revision}, newer than this msgflow knows "
            f"({head_revision()}) — {path}",
            "upgrade msgflow, or give another file with --db",
        )
    return revision
