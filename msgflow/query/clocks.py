"""Says how far times of several clocks can be compared, and when they cannot."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb

    from msgflow.run.choice import Run

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


# The bound of two clocks is the sum of theirs, and that of the reference is 0.
_GROUPS = """
WITH named AS (
    SELECT clock_id, string_agg(hostname, ', ' ORDER BY host_id) AS hosts
    FROM main.host
    GROUP BY clock_id
),
known AS (
    SELECT clock_id, max(uncertainty_ns) AS greatest_ns
    FROM main.clock_uncertainty
    GROUP BY clock_id
),
bound AS (
    SELECT
        c.run_id, c.clock_id, n.hosts,
        coalesce(c.reference_clock_id, -c.clock_id) AS together,
        coalesce(k.greatest_ns, c.uncertainty_ns) AS bound_ns
    FROM main.clock AS c
    JOIN named AS n ON c.clock_id = n.clock_id
    LEFT JOIN known AS k ON c.clock_id = k.clock_id
    WHERE list_contains($runs, c.run_id)
)
SELECT
    run_id,
    string_agg(hosts, ', ' ORDER BY clock_id),
    count(*),
    CASE WHEN bool_and(bound_ns IS NOT NULL) THEN list_sum(max(bound_ns, 2)) / 1e6 END,
    run_id IN (SELECT run_id FROM main.diagnostic WHERE name = 'clock_not_synchronised')
FROM bound
GROUP BY run_id, together
ORDER BY run_id, min(clock_id)
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


def clock_verdicts(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], *, only_several: bool = False
) -> list[str]:
    """Return for each run whether the times of its hosts can be compared, a sentence each.

    Args:
        connection: to a database with the public views.
        runs: the runs.
        only_several: leave out runs with one clock, of which nothing can be wrong.
    """
    rows = connection.execute(_GROUPS, {"runs": [run.run_id for run in runs]}).fetchall()
    verdicts = []
    for run in runs:
        groups = [tuple(row[1:]) for row in rows if row[0] == run.run_id]
        if not groups or (only_several and len(groups) == 1 and groups[0][1] == 1):
            continue
        label = "" if len(runs) == 1 else f"run {run.name} ({run.run_id}): "
        verdicts.append(label + _verdict(groups))
    return verdicts


def _verdict(groups: Sequence[tuple[str, int, float | None, bool]]) -> str:
    if len(groups) > 1:
        cure = "FILE" if groups[0][3] else "messages"
        return (
            f"the clocks of {' | '.join(hosts for hosts, *_ in groups)} are not synchronised: times"
            f" between them cannot be compared; cure: msgflow clocks apply {cure}"
        )
    ((hosts, clocks, greatest_ms, _),) = groups
    if clocks == 1:
        return f"one clock ({hosts}): all times can be compared"
    if greatest_ms is None:
        return f"the clocks of {hosts} are together, as far as the file with their offsets is right"
    return f"the clocks of {hosts} are together within ±{greatest_ms:.3f} ms"


def _wrong_by(least_ms: float | None, greatest_ms: float | None) -> str:
    if least_ms is None or greatest_ms is None:
        return "are off by as much as the file with their offsets is"
    return f"are known to ±{least_ms:.3f} ms at best and ±{greatest_ms:.3f} ms at worst"
