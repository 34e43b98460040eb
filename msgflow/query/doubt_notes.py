"""Notes on links that may be other ones: at which node flows pass them, and the cure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.sql.statement import registered

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb
    import pyarrow as pa

    from msgflow.run.choice import Run

# How many values of a row pass such a link, or whether its flow does.
AMBIGUOUS = "ambiguous"
_MARKS = (AMBIGUOUS, "is_ambiguous")
# What has the nodes: a path, or in a verification what was measured.
_WAYS = ("path", "subject")
_FOUND = """
SELECT subject, detail, cure
FROM main.finding
WHERE list_contains($runs, run_id) AND name IN ('ambiguous_cause', 'ambiguous_link')
ORDER BY name, run_id, subject
"""


def doubt_notes(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], table: pa.Table
) -> list[str]:
    """Return a sentence for each node at which flows of these rows pass a link that is in doubt."""
    mark, way = (
        next((name for name in names if name in table.column_names), None)
        for names in (_MARKS, _WAYS)
    )
    if mark is None or way is None:
        return []
    with registered(connection, doubtful=table):
        doubted = connection.execute(
            f"SELECT DISTINCT {way} FROM doubtful WHERE {mark}::BOOLEAN"
        ).fetchall()
    if not doubted:
        return []
    places = {step for (steps,) in doubted if steps is not None for step in steps.split(" → ")}
    found = connection.execute(_FOUND, {"runs": [run.run_id for run in runs]}).fetchall()
    return [
        f"{subject}: {detail}, and flows through it with them. {cure.rstrip('.')}"
        for subject, detail, cure in found
        if subject in places
    ] or ["some flows pass a link that may be another one: candidate_count of the links"]
