"""What a recording cost the robot, in words: events times what one costs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from msgflow.text.values import ARROW, format_duration

if TYPE_CHECKING:
    from msgflow.database import Database
    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run

# What a message makes from one callback to the next: ten in the layers of ROS, two of the executor.
_EVENTS_OF_HOP = 12
_MOST_PATHS = 3
_TRACED = """
SELECT
    run.run_id, coalesce(list(trace.path) FILTER (trace.path IS NOT NULL), []) AS paths,
    sum(trace.event_count)::BIGINT AS events, max(trace.end_ns) - min(trace.start_ns) AS took_ns
FROM main.run
LEFT JOIN main.trace ON trace.run_id = run.run_id AND trace.domain = 'ust'
GROUP BY run.run_id
"""


def share_of_cpu(database: Database, runs: Sequence[Run]) -> Iterator[str]:
    """Yield a sentence for each run: what share of a CPU its events took."""
    traced = _traced(database)
    for run in runs:
        row = traced[run.run_id]
        if row["events"] and row["took_ns"]:
            where = "there, before the recording" if row["is_measured"] else "elsewhere"
            label = f"run {run.title}: " if len(runs) > 1 else ""
            share = 100 * row["events"] * row["cost_ns"] / row["took_ns"]
            yield (
                f"{label}tracing took about {share:.2g} % of a CPU:"
                f" {row['events']:,} events, {row['cost_ns']:.0f} ns each (measured {where})"
            )


def part_of_latencies(database: Database, latencies: QueryResult) -> Iterator[str]:
    """Yield a sentence about the paths with the longest latencies, of rows of e2e-latency."""
    traced = _traced(database)
    columns = ["run_id", "path", "median_ns"]
    rows = [row for row in latencies.to_arrow().select(columns).to_pylist() if row["median_ns"]]
    parts = []
    for row in sorted(rows, key=lambda row: -row["median_ns"])[:_MOST_PATHS]:
        steps = row["path"].split(ARROW)
        cost_ns = traced[row["run_id"]]["cost_ns"]
        tracing = format_duration((len(steps) - 1) // 2 * _EVENTS_OF_HOP * cost_ns)
        parts.append(f"{tracing} of {steps[-2]}'s {format_duration(row['median_ns'])}")
    if parts:
        yield f"of the latencies, tracing is about {', '.join(parts)}"


def _traced(database: Database) -> dict[int, dict[str, Any]]:
    """Return, by run, its events, how long it took, and what an event cost."""
    from msgflow.record.event_cost import USUAL_NS, event_cost_ns

    found = {}
    for row in database.sql(_TRACED, limit=None).table.to_pylist():
        measured = event_cost_ns(row["paths"])
        cost = USUAL_NS if measured is None else measured
        found[row["run_id"]] = row | {"cost_ns": cost, "is_measured": measured is not None}
    return found
