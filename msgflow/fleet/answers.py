"""Answers: the tables that a lake holds of every run, each with the rows of a query."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Callable

    import duckdb
    import pyarrow as pa

FLOW = "flow"
DISTRIBUTION = "distribution"
FINDING = "finding"
# Named queries, run with their defaults and with internal rows; each gives a table of its name.
QUERIES = (
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


@dataclass(frozen=True)
class Answer:
    """A table of the lake."""

    table: str
    # Returns the rows of a run, in a fixed order and with a column `run_id`.
    read: Callable[[duckdb.DuckDBPyConnection, int], pa.Table]


def answers() -> tuple[Answer, ...]:
    """Return the answers of a lake in the order of their computation."""
    return (
        Answer(FLOW, _statement("fleet_flow")),
        # Durations, periods, waits and latencies of transport in buckets that can be added up.
        Answer(DISTRIBUTION, _statement("fleet_distribution")),
        Answer(FINDING, _findings),
        *(Answer(name.replace("-", "_"), _query(name)) for name in QUERIES),
    )


def _statement(name: str) -> Callable[[duckdb.DuckDBPyConnection, int], pa.Table]:
    def read(con: duckdb.DuckDBPyConnection, run_id: int) -> pa.Table:
        return internal_sql().run(con, name, {"runs": [run_id]}).to_arrow_table()

    return read


def _query(name: str) -> Callable[[duckdb.DuckDBPyConnection, int], pa.Table]:
    def read(con: duckdb.DuckDBPyConnection, run_id: int) -> pa.Table:
        return run_query(con, load_query(name), {}, Slice(run_id), internal=True).to_arrow()

    return read


def _findings(con: duckdb.DuckDBPyConnection, run_id: int) -> pa.Table:
    statement = "FROM main.finding WHERE run_id = $run_id ORDER BY ALL"
    return con.sql(statement, params={"run_id": run_id}).to_arrow_table()
