"""Says when rows compare times of clocks that nobody brought together."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb

    from msgflow.query.window import Run

_CLOCKS = """
SELECT
    run_id,
    count(DISTINCT coalesce(reference_clock_id, -clock_id)),
    run_id IN (SELECT run_id FROM main.diagnostic WHERE name = 'clock_not_synchronised')
FROM main.clock
WHERE list_contains($runs, run_id)
GROUP BY run_id
HAVING count(DISTINCT coalesce(reference_clock_id, -clock_id)) > 1
"""


def clock_notes(connection: duckdb.DuckDBPyConnection, runs: Sequence[Run]) -> list[str]:
    """Return one sentence for each run with several clocks that are as recorded.

    Clocks that are corrected to the same one count as one.
    """
    rows = connection.execute(_CLOCKS, {"runs": [run.run_id for run in runs]}).fetchall()
    clocks = {
        run_id: (number, "FILE" if in_vain else "messages") for run_id, number, in_vain in rows
    }
    return [
        f"{'the run' if len(runs) == 1 else f'run {run.name} ({run.run_id})'} has"
        f" {clocks[run.run_id][0]} clocks that are not synchronised: times between their hosts are"
        f" not comparable; msgflow clocks apply {clocks[run.run_id][1]}"
        for run in runs
        if run.run_id in clocks
    ]
