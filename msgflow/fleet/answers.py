"""Answers: the tables that a lake holds of every run, each with the rows of a query."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import duckdb
    import pyarrow as pa

    Read = Callable[[duckdb.DuckDBPyConnection, int], pa.Table]

# Named queries, run with their defaults and with internal rows; each gives a table of its name.
_QUERIES = (
    "e2e-latency",
    "callbacks",
    "waits",
    "executor-usage",
    "topics-latency",
    "topics-delivery",
    "topics-rate",
    "timers",
    "service-latency",
    "action-latency",
    "info-quality",
)


def _statement(name: str) -> Read:
    def read(con: duckdb.DuckDBPyConnection, run_id: int) -> pa.Table:
        return internal_sql().run(con, name, {"runs": [run_id]}).to_arrow_table()

    return read


def _query(name: str) -> Read:
    def read(con: duckdb.DuckDBPyConnection, run_id: int) -> pa.Table:
        return run_query(con, load_query(name), {}, Slice(run_id), internal=True).to_arrow()

    return read


def _findings(con: duckdb.DuckDBPyConnection, run_id: int) -> pa.Table:
    statement = "FROM main.finding WHERE run_id = $run_id ORDER BY ALL"
    return con.sql(statement, params={"run_id": run_id}).to_arrow_table()


ANSWERS: Mapping[str, Read] = {
    "flow": _statement("fleet_flow"),
    # Durations, periods, waits and latencies of transport in buckets that can be added up.
    "distribution": _statement("fleet_distribution"),
    "finding": _findings,
    **{name.replace("-", "_"): _query(name) for name in _QUERIES},
}
"""By table, as they are computed: returns the rows of a run, with `run_id`, in a fixed order."""
