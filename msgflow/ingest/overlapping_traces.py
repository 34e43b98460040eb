"""Overlapping traces: corrections of events that two traces of a host hold.

Two sessions may record one process at the same time. Which events are there twice shows only when
all have been read. The traces are then read again, without the copies, so that the predecessor of
an event on its thread is what really happened before it. The same is done where only some traces of
a host know the PID namespace of a process.
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

# Temporary tables, each made from those before it.
_TABLES = ("session_trace", "process_namespace")
_OVERLAP_TABLES = ("coverage", "overlap_window")


@dataclass(frozen=True)
class Corrections:
    """Corrections of the events of a reader.

    Attributes:
        duplicates: ids of events that another trace holds as well, in order.
        processes: (host, pid) of the processes whose PID namespace is filled in where it is
            missing, as one number each, in order.
        namespaces: the PID namespace of each.
        hosts: trace index -> a number that traces of the same host share.
    """

    duplicates: NDArray[np.int64]
    processes: NDArray[np.int64]
    namespaces: NDArray[np.int64]
    hosts: NDArray[np.int64]

    def __bool__(self) -> bool:
        return bool(self.duplicates.size or self.processes.size)

    def applied(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        """Return the corrected events of a batch, perhaps none."""
        if self.duplicates.size:
            batch = self._without_copies(batch)
        if self.processes.size and batch["pid_ns"].null_count:
            batch = self._with_namespaces(batch)
        return batch

    def _without_copies(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        is_copy = _are_among(to_numpy(batch["event_id"]), self.duplicates)[0]
        return batch.filter(to_arrow(~is_copy)) if is_copy.any() else batch

    def _with_namespaces(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        processes = _process(self.hosts[to_numpy(batch["trace_index"])], to_numpy(batch["vpid"]))
        is_known, places = _are_among(processes, self.processes)
        is_given = is_valid(batch["pid_ns"])
        values = np.where(is_given, to_numpy(batch["pid_ns"]), self.namespaces[places])
        column = to_arrow(values, ~(is_given | is_known))
        return batch.set_column(batch.schema.get_field_index("pid_ns"), "pid_ns", column)


def corrections_of(con: duckdb.DuckDBPyConnection) -> Corrections:
    """Return how the events in `raw` have to be corrected, and fill `staging.left_out`.

    Args:
        con: connection with `raw` and `staging` attached and filled.
    """
    for table in _TABLES:
        _make(con, table)
    known = con.execute("SELECT host, vpid, pid_ns FROM process_namespace").fetchnumpy()
    traces = con.execute(
        "SELECT host, session FROM session_trace ORDER BY trace_index"
    ).fetchnumpy()
    # One session records no event twice.
    has_sessions = distinct(traces["session"]).size > 1
    duplicates = _duplicates(con) if has_sessions else np.empty(0, np.int64)
    for table in _TABLES:
        con.execute(f"DROP TABLE {table}")
    processes = _process(known["host"], known["vpid"])
    order = np.argsort(processes)
    return Corrections(
        duplicates,
        processes[order],
        np.asarray(known["pid_ns"], np.int64)[order],
        np.asarray(traces["host"], np.int64),
    )


def _duplicates(con: duckdb.DuckDBPyConnection) -> NDArray[np.int64]:
    """Return the ids of events that another trace holds as well, in order.

    Their counts go to `staging.left_out`.
    """
    event_ids = np.empty(0, np.int64)
    for table in _OVERLAP_TABLES:
        _make(con, table)
    if con.execute("SELECT 1 FROM overlap_window LIMIT 1").fetchall():
        con.execute(f"CREATE OR REPLACE TEMP VIEW thread_event AS {_events()}")
        _make(con, "duplicate_event")
        con.execute("DROP VIEW thread_event")
        con.execute("INSERT INTO staging.left_out\n" + statements().header("duplicate_count").body)
        found = con.execute("SELECT event_id FROM duplicate_event ORDER BY ALL").fetchnumpy()
        event_ids = np.asarray(found["event_id"], np.int64)
        con.execute("DROP TABLE duplicate_event")
    for table in _OVERLAP_TABLES:
        con.execute(f"DROP TABLE {table}")
    return event_ids


def _make(con: duckdb.DuckDBPyConnection, table: str) -> None:
    """Make a temporary table as `schema/overlap` has it."""
    header = statements().header(table)
    values = {"slack_ns": _SLACK_NS} if header.params else {}
    con.execute(f"CREATE OR REPLACE TEMP TABLE {table} AS\n{header.body}", values)


@cache
def statements() -> Statements:
    """Return the statements about overlapping traces."""
    return Statements(resource_directory("schema") / "overlap")


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
    """Return which values are among the sorted `known` ones, and their places there."""
    places = np.minimum(np.searchsorted(known, values), known.size - 1)
    return known[places] == values, places
