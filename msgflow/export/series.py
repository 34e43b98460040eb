"""Series of measured values: a row per moment, a column per path, callback or topic.

Programs that plot columns over a time column read them: PlotJuggler, spreadsheets.
"""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.query.clock_notes import clock_notes
from msgflow.result.query_result import QueryResult
from msgflow.sql.header import Column
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.run.slice import Slice

# No program shows more columns.
MOST_COLUMNS = 1_000


class What(StrEnum):
    """What is measured."""

    PATHS = "paths"
    CALLBACKS = "callbacks"
    TOPICS = "topics"


_STATEMENTS = {
    What.PATHS: "series_path",
    What.CALLBACKS: "series_callback",
    What.TOPICS: "series_topic",
}


def read_series(connection: duckdb.DuckDBPyConnection, what: What, part: Slice) -> QueryResult:
    """Return a row per moment (`at_ns`) with a column per thing that was measured [ns].

    Args:
        connection: to a database with the public views.
        what: latency of paths by the start of the flow, duration of callbacks by their start, or
            latency from publication to take of topics by the take.
        part: one run, and the times to read.

    Raises:
        UsageError: not exactly one run, a time that cannot be read, or more things than any program
            has columns for.
    """
    run = part.one_run(connection, "a file of series")
    bindings = {"runs": [run.run_id], **part.window([run]).bindings}
    table = internal_sql().run(connection, _STATEMENTS[what], bindings).to_arrow_table()
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
    values = internal_sql().header(_STATEMENTS[what])
    header = replace(
        values,
        name=f"series-{what}",
        title=f"{what} over time",
        params=(),
        columns=tuple(columns),
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
