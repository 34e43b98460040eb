"""Measured values side by side: a row per moment, a column per path, callback or topic.

Programs that plot columns over a time column read that: PlotJuggler, spreadsheets.
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.query.clocks import clock_notes
from msgflow.query.result import QueryResult
from msgflow.sql.header import Column, Header

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.run.choice import Run

# More columns than that no program shows.
MOST_COLUMNS = 1_000


class What(StrEnum):
    """What is measured."""

    PATHS = "paths"
    CALLBACKS = "callbacks"
    TOPICS = "topics"


_MEANINGS = {
    What.PATHS: "Latency of the first arrival of each flow, by the start of the flow",
    What.CALLBACKS: "Duration, by the start of the callback",
    What.TOPICS: "Latency from publication to take, by the take",
}
# One row per value; what has no name of its own twice in a run gets its identity.
_VALUES = {
    What.PATHS: """
SELECT e.root_ns AS at_ns, p.path || CASE WHEN count(*) OVER (PARTITION BY p.path)
    > count(*) OVER (PARTITION BY p.path_id) THEN ' #' || p.path_id ELSE '' END AS subject,
    e.latency_ns AS value_ns
FROM main.end_to_end(
    $runs, NULL, NULL, 'callback_start', 'callback_end', $start_ns, $end_ns
) AS e
JOIN main.flow_path($runs, NULL, NULL) AS p ON e.path_id = p.path_id
WHERE e.status = 'reached' AND e.is_first
ORDER BY at_ns, subject, value_ns
""",
    What.CALLBACKS: """
SELECT i.start_ns AS at_ns, l.node || ' ' || l.label || CASE
    WHEN min(i.callback_id) OVER (PARTITION BY l.node, l.label)
        <> max(i.callback_id) OVER (PARTITION BY l.node, l.label)
    THEN ' #' || i.callback_id ELSE '' END AS subject,
    i.end_ns - i.start_ns AS value_ns
FROM main.callback_instance AS i
JOIN main.callback_label AS l ON i.callback_id = l.callback_id
WHERE list_contains($runs, i.run_id) AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
    AND i.end_ns IS NOT NULL AND NOT l.is_internal
ORDER BY at_ns, subject, value_ns
""",
    What.TOPICS: """
SELECT t.taken_ns AS at_ns, coalesce(s.topic_name, '?') || ' → ' || coalesce(n.full_name, '?')
    || CASE WHEN min(t.subscription_id) OVER (PARTITION BY s.topic_name, n.full_name)
        <> max(t.subscription_id) OVER (PARTITION BY s.topic_name, n.full_name)
    THEN ' #' || t.subscription_id ELSE '' END AS subject,
    l.latency_ns AS value_ns
FROM main.take AS t
JOIN main.link_transport AS l ON t.take_id = l.take_id
JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
WHERE list_contains($runs, t.run_id) AND t.taken_ns >= $start_ns AND t.taken_ns < $end_ns
    AND NOT coalesce(s.is_internal, false)
ORDER BY at_ns, subject, value_ns
""",
}


def read_series(
    connection: duckdb.DuckDBPyConnection, run: Run, what: What, window: tuple[int, int]
) -> QueryResult:
    """Return a row per moment (`at_ns`) with a column per thing that was measured [ns].

    Args:
        connection: to a database with the public views.
        run: the run.
        what: latency of paths by the start of the flow, duration of callbacks by their start, or
            latency from publication to take of topics by the take.
        window: (begin, end) in epoch ns.

    Raises:
        UsageError: more things than columns that any program reads.
    """
    bindings = {"runs": [run.run_id], "start_ns": window[0], "end_ns": window[1]}
    table = connection.sql(_VALUES[what], params=bindings).to_arrow_table()
    subjects = sorted(table["subject"].unique().to_pylist())
    if len(subjects) > MOST_COLUMNS:
        raise UsageError(
            f"there are {len(subjects):,} {what}: more than the {MOST_COLUMNS:,} columns of a file",
            "msgflow query has a row for each",
        )
    columns = [
        Column("at_ns", "BIGINT", "epoch ns", "Moment"),
        *(Column(subject, "BIGINT", "ns", subject) for subject in subjects),
    ]
    header = Header(
        name=f"series-{what}",
        title=f"{what} over time",
        description=_MEANINGS[what],
        grain="one row per value",
        kind="view",
        params=(),
        columns=tuple(columns),
        needs=(),
        severity=None,
        cause=None,
        cure=None,
        note=None,
        body=_VALUES[what],
        path=Path(__file__),
    )
    notes = clock_notes(connection, [run]) if what is not What.CALLBACKS else []
    return QueryResult(_side_by_side(table, subjects), header, (run,), notes)


def _side_by_side(table: pa.Table, subjects: list[str]) -> pa.Table:
    import pyarrow
    from pyarrow import compute

    times = table["at_ns"].combine_chunks()
    values = table["value_ns"].combine_chunks()
    of = table["subject"].combine_chunks()
    nothing = pyarrow.scalar(None, values.type)
    columns = [compute.if_else(compute.equal(of, one), values, nothing) for one in subjects]
    return pyarrow.table([times, *columns], names=["at_ns", *subjects])
