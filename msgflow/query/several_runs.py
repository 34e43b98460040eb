"""Comparison of several runs on either side: a run is one value, however many flows it has."""

from __future__ import annotations

from dataclasses import replace
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

from msgflow.result.query_result import QueryResult
from msgflow.sql.statement import internal_sql, registered

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb

    from msgflow.run.choice import Run

# With fewer runs on one side and many on the other, intervals are too narrow: docs/fleet.md.
LEAST_RUNS = 6


def compared(
    connection: duckdb.DuckDBPyConnection,
    *,
    case: str = "first",
    confidence: float = 0.95,
    at_least: float = 0.05,
    name: str = "fleet compare",
) -> QueryResult:
    """Return the differences between two sides: it reads `flow`, `e2e_latency` and `sided`."""
    measured = internal_sql().run(connection, "fleet_run_value", {"case": case}).to_arrow_table()
    values = {
        "z": NormalDist().inv_cdf((1 + confidence) / 2),
        "least_units": LEAST_RUNS,
        "at_least": at_least,
    }
    with registered(connection, measured=measured):
        rows = internal_sql().run(connection, "fleet_comparison", values).to_arrow_table()
    return QueryResult(rows, replace(internal_sql().header("fleet_comparison"), name=name))


def compare_sides(
    connection: duckdb.DuckDBPyConnection, asked: dict[str, Any], sides: Sequence[Sequence[Run]]
) -> QueryResult:
    """Return how the paths of the runs of side B differ from those of side A."""
    import pyarrow as pa

    sided = [(str(run.run_id), side) for side, of in zip("ab", sides, strict=True) for run in of]
    runs, names = ([row[place] for row in sided] for place in (0, 1))
    asked = asked | {"runs": [int(run) for run in runs]}
    flow = internal_sql().run(connection, "compared_flow", asked).to_arrow_table()
    table = pa.table({"run": runs, "side": names, "unit": runs})
    with registered(connection, flow=flow, e2e_latency=flow, sided=table):
        return compared(
            connection,
            case=asked["case"],
            confidence=asked["confidence"],
            at_least=asked["at_least"],
            name="compare",
        )
