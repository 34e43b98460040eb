"""What a recording cost the robot, in words: events times what one costs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.text.values import ARROW, format_duration

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from msgflow.database import Database
    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run

# What a message makes from one callback to the next: ten in the layers of ROS, two of the executor.
_EVENTS_OF_HOP = 12
_MOST_PATHS = 3
_TRACED = """
SELECT
    run_id, list(path) AS paths, sum(event_count)::BIGINT AS events,
    max(end_ns) - min(start_ns) AS took_ns
FROM main.trace
WHERE domain = 'ust'
GROUP BY run_id
"""


def share_of_cpu(database: Database, runs: Sequence[Run]) -> Iterator[str]:
    """Yield a sentence for each run: what share of a CPU its events took."""
    from msgflow.record.event_cost import USUAL_NS

    for run in runs:
        events, took_ns, measured = _traced(database, run.run_id)
        if events and took_ns:
            each = USUAL_NS if measured is None else measured
            where = "elsewhere" if measured is None else "there, before the recording"
            label = f"run {run.title}: " if len(runs) > 1 else ""
            yield (
                f"{label}tracing took about {100 * events * each / took_ns:.2g} % of a CPU:"
                f" {events:,} events, {each:.0f} ns each (measured {where})"
            )


def part_of_latencies(database: Database, latencies: QueryResult) -> Iterator[str]:
    """Yield a sentence about the paths with the longest latencies, of rows of e2e-latency."""
    from msgflow.record.event_cost import USUAL_NS

    columns = ["run_id", "path", "median_ns"]
    rows = [row for row in latencies.to_arrow().select(columns).to_pylist() if row["median_ns"]]
    parts = []
    for row in sorted(rows, key=lambda row: -row["median_ns"])[:_MOST_PATHS]:
        *_, measured = _traced(database, row["run_id"])
        hops = row["path"].count(ARROW) // 2
        tracing = format_duration(
            hops * _EVENTS_OF_HOP * (USUAL_NS if measured is None else measured)
        )
        topic = row["path"].split(ARROW)[-2]
        parts.append(f"{tracing} of {topic}'s {format_duration(row['median_ns'])}")
    if parts:
        yield f"of the latencies, tracing is about {', '.join(parts)}"


def _traced(database: Database, run: int) -> tuple[int | None, int | None, float | None]:
    from msgflow.record.event_cost import event_cost_ns

    rows = database.sql(_TRACED, limit=None).table.to_pylist()
    row = next((row for row in rows if row["run_id"] == run), {"events": None, "took_ns": None})
    return row["events"], row["took_ns"], event_cost_ns(row.get("paths") or [])
