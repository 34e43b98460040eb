"""Things that a user names by their id: those that no run has are refused."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import duckdb

    from msgflow.run.choice import Run
    from msgflow.sql.value import Value

# Parameters that take an id, in every query that has them: what it is of, and what lists them.
_IDENTITIES = {
    "flow": ("take", "take_id", "msgflow query flows"),
    "callback_id": ("callback", "callback_id", "msgflow query executor-wait"),
}


def require_identities(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], bound: Mapping[str, Value]
) -> None:
    """Raise unless every id among the parameters of a query is one of the chosen runs.

    Args:
        connection: to a database with the public views.
        runs: the chosen runs; where there are none, every id will do.
        bound: all parameters of the query.

    Raises:
        UsageError: the runs have no such thing.
    """
    for key, (view, column, hint) in _IDENTITIES.items():
        number = bound.get(key)
        if number is None or not runs:
            continue
        known = connection.execute(
            f"SELECT 1 FROM main.{view} WHERE {column} = $number AND list_contains($runs, run_id)",
            {"number": number, "runs": [run.run_id for run in runs]},
        ).fetchall()
        if not known:
            where = "the run" if len(runs) == 1 else "these runs"
            raise UsageError(f"there is no such {view} in {where} — {number}", f"see {hint}")
