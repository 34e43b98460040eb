"""Answers: the tables that a lake holds of every run, each with the rows of a query."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

# Those of statements of the program; buckets of a distribution can be added up.
_OWN = ("flow", "distribution")
_FINDING = "finding"
ANSWERS = (
    *_OWN, _FINDING, "e2e_latency", "callbacks", "waits", "executor_usage", "topics_latency",
    "topics_delivery", "topics_rate", "timers", "service_latency", "action_latency", "info_quality",
)  # fmt: skip
"""The tables, as they are computed; others have the rows of the named query of that name."""


def answer(con: duckdb.DuckDBPyConnection, run_id: int, table: str) -> pa.Table:
    """Return the rows of a run, with `run_id`, in a fixed order."""
    if table in _OWN:
        return internal_sql().run(con, f"fleet_{table}", {"runs": [run_id]}).to_arrow_table()
    if table == _FINDING:
        statement = "FROM main.finding WHERE run_id = $run_id ORDER BY ALL"
        return con.sql(statement, params={"run_id": run_id}).to_arrow_table()
    query = load_query(table.replace("_", "-"))
    return run_query(con, query, {}, Slice(run_id), internal=True).to_arrow()
