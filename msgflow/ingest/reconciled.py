"""What the traces of one host tell twice, or differently, and how that is put right.

Two sessions that record the same events at the same time each write every event, with time stamps
of their own. Which events are in the record twice shows only when all of them have been read: the
traces are read again then, without the copies, so that what precedes an event on its thread is
what happened before it. So it is where only some traces of a host say in which PID namespace a
process is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from msgflow.ingest.catalogue import load
from msgflow.resources import resource_directory
from msgflow.sql.statement import Statements
from msgflow.trace.numpy_arrow import distinct, is_valid, to_arrow, to_numpy

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb
    import pyarrow as pa
    from numpy.typing import NDArray

# By how much the two records of one event may be apart [ns], at the ends of a recording.
_SLACK_NS = 100_000

# Tables that are made of each other, in this order, and gone in the end.
_TABLES = ("session_trace", "told_namespace")
_TABLES_OF_OVERLAP = ("coverage", "overlap")


@dataclass(frozen=True)
class Corrections:
    """What to change of the events of a reader.

    Attributes:
        left_out: ids of events that another trace holds as well, in order.
        processes: (host, pid) of the processes whose PID namespace is filled in where it is
            missing, as one number each, in order.
        namespaces: the PID namespace of each.
        hosts: trace index -> a number that traces of the same host share.
    """

    left_out: NDArray[np.int64]
    processes: NDArray[np.int64]
    namespaces: NDArray[np.int64]
    hosts: NDArray[np.int64]

    def __bool__(self) -> bool:
        return bool(self.left_out.size or self.processes.size)

    def applied(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        """Return the events of a batch as they should be; there may be none left."""
        if self.left_out.size:
            batch = self._without_copies(batch)
        if self.processes.size and batch["pid_ns"].null_count:
            batch = self._with_namespaces(batch)
        return batch

    def _without_copies(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        is_copy = _are_among(to_numpy(batch["event_id"]), self.left_out)[0]
        return batch.filter(to_arrow(~is_copy)) if is_copy.any() else batch

    def _with_namespaces(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        processes = _process(self.hosts[to_numpy(batch["trace_index"])], to_numpy(batch["vpid"]))
        is_known, places = _are_among(processes, self.processes)
        is_given = is_valid(batch["pid_ns"])
        values = np.where(is_given, to_numpy(batch["pid_ns"]), self.namespaces[places])
        column = to_arrow(values, ~(is_given | is_known))
        return batch.set_column(batch.schema.get_field_index("pid_ns"), "pid_ns", column)


def find(con: duckdb.DuckDBPyConnection) -> Corrections:
    """Look for what has to be put right in what was read into `raw`.

    Args:
        con: connection with `raw` and `staging` attached and filled; `staging.left_out` is filled.
    """
    for table in _TABLES:
        _make(con, table)
    told = con.execute("SELECT host, vpid, pid_ns FROM told_namespace").fetchnumpy()
    traces = con.execute(
        "SELECT host, session FROM session_trace ORDER BY trace_index"
    ).fetchnumpy()
    # What is in the record twice, two sessions have recorded.
    left_out = _left_out(con) if distinct(traces["session"]).size > 1 else np.empty(0, np.int64)
    for table in _TABLES:
        con.execute(f"DROP TABLE {table}")
    processes = _process(told["host"], told["vpid"])
    order = np.argsort(processes)
    return Corrections(
        left_out,
        processes[order],
        np.asarray(told["pid_ns"], np.int64)[order],
        np.asarray(traces["host"], np.int64),
    )


def _left_out(con: duckdb.DuckDBPyConnection) -> NDArray[np.int64]:
    """Return the ids of events that another trace holds as well, in order, and say where."""
    event_ids = np.empty(0, np.int64)
    for table in _TABLES_OF_OVERLAP:
        _make(con, table)
    if con.execute("SELECT 1 FROM overlap LIMIT 1").fetchall():
        con.execute(f"CREATE OR REPLACE TEMP VIEW thread_event AS {_events()}")
        _make(con, "left_out")
        con.execute("DROP VIEW thread_event")
        con.execute("INSERT INTO staging.left_out\n" + statements().header("left_out_between").body)
        found = con.execute("SELECT event_id FROM left_out ORDER BY ALL").fetchnumpy()
        event_ids = np.asarray(found["event_id"], np.int64)
        con.execute("DROP TABLE left_out")
    for table in _TABLES_OF_OVERLAP:
        con.execute(f"DROP TABLE {table}")
    return event_ids


def _make(con: duckdb.DuckDBPyConnection, table: str) -> None:
    """Make a temporary table as `schema/reconcile` has it."""
    header = statements().header(table)
    values = {"slack_ns": _SLACK_NS} if header.params else {}
    con.execute(f"CREATE OR REPLACE TEMP TABLE {table} AS\n{header.body}", values)


@cache
def statements() -> Statements:
    """Return what is asked about what traces tell twice."""
    return Statements(resource_directory("schema") / "reconcile")


def _events() -> str:
    return " UNION ALL ".join(
        f"SELECT event_id, ts_ns, trace_index, cpu_id, thread_index, {number} AS tracepoint "
        f"FROM raw.{tracepoint.table}"
        for number, tracepoint in enumerate(load().of_threads)
    )


def _process(
    hosts: NDArray[np.int64], pids: Sequence[int] | NDArray[np.int32]
) -> NDArray[np.int64]:
    return (np.asarray(hosts, np.int64) << 32) | np.asarray(pids, np.int64)


def _are_among(
    values: NDArray[np.int64], known: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Return which values are among the known ones, which are in order, and where."""
    places = np.minimum(np.searchsorted(known, values), known.size - 1)
    return known[places] == values, places
