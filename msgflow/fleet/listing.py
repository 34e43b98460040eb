"""Lists of the runs and failures of a lake, as tables for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.db.sandbox import open_memory
from msgflow.result.query_result import QueryResult
from msgflow.sql.statement import registered

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.fleet.lake import Lake

_LABELS = """
nullif(list_transform(map_entries(labels), lambda each: each.key || '=' || each.value), [])
"""
_RUNS = f"""
SELECT run, name, {_LABELS} AS labels, start_ns, end_ns, event_count, source, msgflow_version,
    seconds, tries, worker, part
FROM listed
"""
_FAILURES = f"SELECT * REPLACE ({_LABELS} AS labels) FROM listed"


def list_runs(lake: Lake) -> QueryResult:
    """Return the runs of a lake: the table `run`, with labels as KEY=VALUE."""
    return _listed(lake.runs(), _RUNS)


def list_failures(lake: Lake) -> QueryResult:
    """Return the failed recordings: the table `fleet_failure`, with labels as KEY=VALUE."""
    return _listed(lake.failures(), _FAILURES)


def _listed(rows: pa.Table, sql: str) -> QueryResult:
    with open_memory() as con, registered(con, listed=rows):
        return QueryResult(con.sql(sql).to_arrow_table())
