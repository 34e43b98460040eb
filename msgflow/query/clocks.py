"""Says how far times of several clocks can be compared, and when they cannot."""

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


_UNCERTAINTIES = """
WITH named AS (
    SELECT clock_id, string_agg(hostname, ', ' ORDER BY host_id) AS hosts
    FROM main.host
    GROUP BY clock_id
),
known AS (
    SELECT clock_id, min(uncertainty_ns) AS least_ns, max(uncertainty_ns) AS greatest_ns
    FROM main.clock_uncertainty
    GROUP BY clock_id
)
SELECT
    c.run_id, r.hosts, n.hosts, coalesce(k.least_ns, c.uncertainty_ns) / 1e6,
    coalesce(k.greatest_ns, c.uncertainty_ns) / 1e6
FROM main.clock AS c
JOIN named AS n ON c.clock_id = n.clock_id
JOIN named AS r ON c.reference_clock_id = r.clock_id
LEFT JOIN known AS k ON c.clock_id = k.clock_id
WHERE list_contains($runs, c.run_id) AND c.reference_clock_id <> c.clock_id
ORDER BY c.clock_id
"""


def clock_notes(connection: duckdb.DuckDBPyConnection, runs: Sequence[Run]) -> list[str]:
    """Return what limits times between hosts, a sentence each.

    For each run with several clocks that are as recorded: how many, where clocks that are corrected
    to the same one count as one. For each clock that is corrected: how far it can be wrong.
    """
    rows = connection.execute(_CLOCKS, {"runs": [run.run_id for run in runs]}).fetchall()
    clocks = {
        run_id: (number, "FILE" if in_vain else "messages") for run_id, number, in_vain in rows
    }
    uncertainties = connection.execute(
        _UNCERTAINTIES, {"runs": [run.run_id for run in runs]}
    ).fetchall()
    return [
        f"{'the run' if len(runs) == 1 else f'run {run.name} ({run.run_id})'} has"
        f" {clocks[run.run_id][0]} clocks that are not synchronised: times between their hosts are"
        f" not comparable; msgflow clocks apply {clocks[run.run_id][1]}"
        for run in runs
        if run.run_id in clocks
    ] + [
        f"{'' if len(runs) == 1 else f'run {run.name} ({run.run_id}): '}times between {reference}"
        f" and {hosts} {_wrong_by(least, greatest)}; msgflow clocks show"
        for run in runs
        for run_id, reference, hosts, least, greatest in uncertainties
        if run_id == run.run_id
    ]


def _wrong_by(least_ms: float | None, greatest_ms: float | None) -> str:
    if least_ms is None or greatest_ms is None:
        return "are off by as much as the file with their offsets is"
    return f"are known to ±{least_ms:.3f} ms at best and ±{greatest_ms:.3f} ms at worst"
