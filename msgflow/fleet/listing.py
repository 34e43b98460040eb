"""Lists of the runs and failures of a lake, as tables for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pyarrow as pa

from msgflow.fleet.failure import read_failures
from msgflow.result.query_result import QueryResult

if TYPE_CHECKING:
    from msgflow.fleet.lake import Lake

_OF_RUNS = (
    "run",
    "name",
    "labels",
    "start_ns",
    "end_ns",
    "event_count",
    "source",
    "msgflow_version",
    "seconds",
    "tries",
    "worker",
    "part",
)


def list_runs(lake: Lake) -> QueryResult:
    """Return the runs of a lake: the table `run`, with labels as KEY=VALUE."""
    return QueryResult(_written_out(lake.runs().select(_OF_RUNS)))


def list_failures(lake: Lake) -> QueryResult:
    """Return the failed recordings: the table `fleet_failure`, with labels as KEY=VALUE."""
    return QueryResult(_written_out(read_failures(lake)))


def _written_out(table: pa.Table) -> pa.Table:
    place = table.column_names.index("labels")
    labels = [
        [f"{key}={value}" for key, value in pairs] if pairs else None
        for pairs in table["labels"].to_pylist()
    ]
    column = pa.array(labels, pa.list_(pa.string()))
    return table.set_column(place, "labels", column).replace_schema_metadata()
