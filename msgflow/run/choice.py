"""Runs of a database, and the choice of those that a command reads."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from msgflow.errors import UsageError

if TYPE_CHECKING:
    import duckdb

_INTEGER = re.compile(r"-?\d+")
# No id or time has more digits. Python refuses to read numbers with thousands of them.
_MOST_DIGITS = 40


@dataclass(frozen=True)
class Run:
    """A run: one ingest.

    Attributes:
        run_id: its key.
        name: its name.
        start_ns: time of its first event, epoch ns; None for a run without events.
        labels: KEY=VALUE each.
        end_ns: time of its last event, epoch ns; None for a run without events.
        simulated: time of a simulation at known moments, in order: (epoch ns, simulated ns).
    """

    run_id: int
    name: str
    start_ns: int | None
    labels: tuple[str, ...] = ()
    end_ns: int | None = None
    simulated: tuple[tuple[int, int], ...] = field(default=(), repr=False, compare=False)

    @property
    def title(self) -> str:
        """Its name and id, for messages."""
        return f"{self.name} ({self.run_id})"


def read_runs(connection: duckdb.DuckDBPyConnection) -> tuple[Run, ...]:
    """Return all runs of the database, oldest first."""
    rows = connection.execute(
        "SELECT run_id, name, start_ns, coalesce(labels, []), end_ns, "
        "EXISTS (FROM store.simulated_time) FROM main.run ORDER BY run_id"
    ).fetchall()
    simulated: dict[int, dict[int, int]] = defaultdict(dict)
    # Few databases have any.
    if rows and rows[0][-1]:
        for run_id, at_ns, simulated_ns in connection.execute(
            "SELECT run_id, at_ns, simulated_ns FROM main.simulated_time ORDER BY run_id, at_ns"
        ).fetchall():
            simulated[run_id][at_ns] = simulated_ns
    return tuple(
        Run(run_id, name, start_ns, tuple(labels), end_ns, tuple(simulated[run_id].items()))
        for run_id, name, start_ns, labels, end_ns, _ in rows
    )


def choose_runs(runs: Sequence[Run], wanted: str | int | None) -> tuple[Run, ...]:
    """Return the runs that a user wants.

    `wanted` is 'all', a name, a label KEY=VALUE (all runs that have it), or an id. A name wins over
    a label, and a label over an id. None means the latest run.
    """
    if not runs:
        return ()
    ordered = sorted(runs, key=lambda run: run.run_id)
    if wanted is None:
        return (ordered[-1],)
    text = str(wanted)
    if text == "all":
        return tuple(ordered)
    found = [run for run in ordered if run.name == text]
    if not found and (labelled := tuple(run for run in ordered if text in run.labels)):
        return labelled
    if not found and (run_id := integer(text)) is not None:
        found = [run for run in ordered if run.run_id == run_id]
    if len(found) > 1:
        ids = " or ".join(f"--run {run.run_id}" for run in found)
        raise UsageError(f"several runs have this name — {text}", f"choose by id: {ids}")
    if not found:
        known = ", ".join(run.title for run in ordered[-10:])
        raise UsageError(f"there is no such run — {text}", f"the runs are {known}")
    return tuple(found)


def choose_one(runs: Sequence[Run], wanted: str | int | None, what: str) -> Run:
    """Return the run that a user wants, for something that reads one run."""
    chosen = choose_runs(runs, wanted)
    if not chosen:
        raise UsageError("the database holds no run yet", "msgflow ingest TRACE")
    if len(chosen) > 1:
        raise UsageError(f"{what} is of one run — {wanted}", "give a name or an id")
    return chosen[0]


def integer(text: str) -> int | None:
    """Return the integer in a text, None if the text is something else."""
    return int(text) if len(text) <= _MOST_DIGITS and _INTEGER.fullmatch(text) else None


def is_run_name(text: str) -> bool:
    """Tell whether a run may have this name: `choose_runs` reads it as a name only."""
    return text not in ("", "all") and not _INTEGER.fullmatch(text)


def require_run_name(name: str) -> None:
    """Raise unless a run may have this name."""
    if not is_run_name(name):
        raise UsageError(
            f"a run cannot have a name that --run takes for something else — {name!r}",
            "give a name that is neither empty, nor 'all', nor a number",
        )
