"""The run that an ingest stores, and its name."""

from __future__ import annotations

import itertools
import os
from collections.abc import Sequence, Set
from pathlib import Path

import duckdb

from msgflow.db.derivation import derivation_hash
from msgflow.db.store import delete, store
from msgflow.errors import UsageError
from msgflow.ingest.recordings import session_folder
from msgflow.run.choice import is_run_name
from msgflow.trace import archive
from msgflow.version import __version__


def store_run(
    con: duckdb.DuckDBPyConnection,
    name: str | None,
    fallback: str,
    replaced: Set[int] = frozenset(),
) -> tuple[int, str]:
    """Store a run from staging, inside the open transaction, in place of those that it replaces.

    It replaces the run that has `name`, too. Without a name it gets `fallback`, with a number
    behind it if another run has that name. Its id and name are returned.
    """
    run_id = int(con.execute("SELECT coalesce(max(run_id), 0) + 1 FROM store.run").fetchall()[0][0])
    if name is not None:
        named = con.execute("SELECT run_id FROM store.run WHERE name = ?", [name]).fetchall()
        replaced = replaced | {number for (number,) in named}
    store(con, run_id)
    delete(con, sorted(replaced))
    run_name = name or free_name(con, fallback)
    con.execute(
        "INSERT INTO store.run (run_id, name, created_at, msgflow_version, derivation_hash, "
        "start_ns, end_ns, event_count) SELECT ?, ?, now() AT TIME ZONE 'UTC', ?, ?, "
        "min(start_ns) FILTER (domain IS DISTINCT FROM 'kernel'), "
        "max(end_ns) FILTER (domain IS DISTINCT FROM 'kernel'), sum(event_count) "
        "FROM store.trace WHERE run_id = ?",
        [run_id, run_name, __version__, derivation_hash(), run_id],
    )
    return run_id, run_name


def fallback_name(paths: Sequence[str | Path]) -> str:
    """Return the name of a run for which none is given: that of the first session's folder."""
    first = Path(os.path.realpath(paths[0]))
    name = session_folder(first.parent / archive.stem(first)).name
    return name if is_run_name(name) else f"run-{name}".rstrip("-")


def require_free_name(con: duckdb.DuckDBPyConnection, name: str) -> None:
    """Raise a `UsageError` if a run of the database has that name."""
    if name in _run_names(con):
        raise UsageError(
            f"the database has a run of that name already — {name}",
            "give another --name, or --replace",
        )


def free_name(con: duckdb.DuckDBPyConnection, name: str) -> str:
    """Return the name, with a number behind it if a run of the database has it."""
    taken = _run_names(con)
    candidates = itertools.chain([name], (f"{name}-{number}" for number in itertools.count(2)))
    return next(candidate for candidate in candidates if candidate not in taken)


def _run_names(con: duckdb.DuckDBPyConnection) -> set[str]:
    return {name for (name,) in con.execute("SELECT name FROM store.run").fetchall()}
