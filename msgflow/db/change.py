"""Changes to runs of a database: all of them, or nothing."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, TypeVar

import duckdb

from msgflow.db.connection import connect
from msgflow.errors import UsageError
from msgflow.query.run import read_runs
from msgflow.run.choice import choose_runs
from msgflow.sql.failure import database_errors
from msgflow.sql.interrupt import interruptible

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from msgflow.run.choice import Run

_T = TypeVar("_T")


def change_runs(
    path: Path,
    run: str | int | None,
    change: Callable[[duckdb.DuckDBPyConnection, tuple[Run, ...]], _T],
    *,
    memory_limit: str | None = None,
) -> _T:
    """Change runs of a database in one transaction, which Ctrl-C undoes.

    Args:
        path: the database.
        run: 'all', a name or an id; the latest run when None.
        change: does it, inside the open transaction; what it returns is returned.
        memory_limit: most memory that the database takes, such as '2GB'.

    Raises:
        UsageError: no such run, or of `change`.
        DatabaseError: the database is missing, locked, foreign, or of another schema revision.
    """
    with (
        database_errors(path),
        contextlib.closing(connect(path, read_only=False, memory_limit=memory_limit)) as con,
    ):
        runs = choose_runs(read_runs(con), run)
        if not runs:
            raise UsageError(f"the database holds no run — {path}", "msgflow ingest TRACE")
        return interruptible(con, lambda: _in_transaction(con, lambda: change(con, runs)))


def _in_transaction(con: duckdb.DuckDBPyConnection, work: Callable[[], _T]) -> _T:
    con.begin()
    try:
        result = work()
        con.commit()
    except BaseException:
        with contextlib.suppress(duckdb.Error):  # the transaction may have ended by itself
            con.rollback()
        raise
    return result
