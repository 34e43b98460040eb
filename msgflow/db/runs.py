"""Changes to runs of a database, each in one transaction: remove, rename, label, and others."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from msgflow.db.connection import connect
from msgflow.db.store import delete
from msgflow.db.transaction import transaction
from msgflow.errors import UsageError
from msgflow.run.choice import choose_runs, read_runs, require_run_name
from msgflow.sql.failure import database_errors
from msgflow.sql.interrupt import interruptible

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run

_T = TypeVar("_T")
_KEY = re.compile(r"[A-Za-z][A-Za-z0-9_.-]{0,63}")
_LONGEST_VALUE = 1_000
_NO_TEXT = re.compile(r"[\0\ud800-\udfff]")


def change_runs(
    path: Path,
    run: str | int | None,
    change: Callable[[duckdb.DuckDBPyConnection, tuple[Run, ...]], _T],
    *,
    memory_limit: str | None = None,
) -> _T:
    """Change runs of a database in one transaction, which Ctrl-C undoes."""
    with (
        database_errors(path),
        contextlib.closing(connect(path, read_only=False, memory_limit=memory_limit)) as con,
    ):
        runs = choose_runs(read_runs(con), run)
        if not runs:
            raise UsageError(f"the database holds no run — {path}", "msgflow ingest TRACE")

        def changed() -> _T:
            with transaction(con):
                return change(con, runs)

        return interruptible(con, changed)


def remove_runs(con: duckdb.DuckDBPyConnection, runs: tuple[Run, ...]) -> tuple[Run, ...]:
    """Delete runs with all their rows, and return them; see `Database.remove_runs`."""
    delete(con, [one.run_id for one in runs])
    return runs


def rename_run(
    con: duckdb.DuckDBPyConnection, runs: tuple[Run, ...], wanted: str | int, name: str
) -> Run:
    """Give the run that is wanted another name; see `Database.rename_run`."""
    require_run_name(name)
    if len(runs) > 1:
        raise UsageError(f"one run has one name — {wanted}", "give a name or an id")
    named = con.execute("SELECT run_id FROM store.run WHERE name = ?", [name]).fetchall()
    if any(run_id != runs[0].run_id for (run_id,) in named):
        raise UsageError(
            f"the database has a run of that name already — {name}",
            "give another name; msgflow runs list has those that are taken",
        )
    con.execute("UPDATE store.run SET name = ? WHERE run_id = ?", [name, runs[0].run_id])
    return runs[0]


def label_runs(
    con: duckdb.DuckDBPyConnection, runs: tuple[Run, ...], labels: Mapping[str, str | None]
) -> tuple[Run, ...]:
    """Give runs labels, or take them away (None), and return the runs as they were."""
    for key, value in labels.items():
        require_label(key, value)
    for one in runs:
        now = dict(label.partition("=")[::2] for label in one.labels)
        for key, value in labels.items():
            if value is not None:
                now[key] = value
            elif now.pop(key, None) is None:
                raise UsageError(
                    f"run {one.run_id} has no label of this key — {key}",
                    f"its labels are {', '.join(one.labels)}"
                    if one.labels
                    else f"msgflow runs label {one.run_id} {key}=VALUE",
                )
        con.execute(
            "UPDATE store.run SET labels = ? WHERE run_id = ?",
            [sorted(f"{key}={value}" for key, value in now.items()) or None, one.run_id],
        )
    return runs


def require_label(key: str, value: str | None) -> None:
    """Raise unless a label is valid."""
    if not _KEY.fullmatch(key):
        raise UsageError(
            f"no key of a label — {key!r}",
            "a letter, then letters, digits, _, - and . (64 at most), such as robot=r2d2",
        )
    # What the command line could not decode is no text.
    if value is not None and (len(value) > _LONGEST_VALUE or _NO_TEXT.search(value)):
        raise UsageError(
            f"no value of a label — {key}", f"give text of at most {_LONGEST_VALUE} characters"
        )
