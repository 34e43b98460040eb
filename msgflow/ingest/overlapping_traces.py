"""Overlapping traces: corrections of what several traces of a host, or containers, have in common.

Two sessions may record one process at the same time, or processes of two containers that have the
same ids. Which events are there twice, and which ids mean several processes, shows only when all
have been read. The traces are then read again, without the copies and with PID namespaces where
they were missing, so that the predecessor of an event on its thread is what really happened before
it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import duckdb
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from msgflow.files.resources import resource_directory
from msgflow.ingest.catalogue import USER_EVENT, load
from msgflow.sql.statement import Statements
from msgflow.trace.numpy_arrow import is_valid, to_arrow, to_numpy

# By how much the two records of one event may be apart [ns], at the ends of a recording.
_SLACK_NS = 100_000
# Two sessions record an event one after the other, in the same call: 0.1 us, of 1000 events one
# more than 3 us. Another process has to get the CPU, and to come as far, in between [ns].
_TWIN_NS = 10_000

_PARAMETERS = {"slack_ns": _SLACK_NS, "twin_ns": _TWIN_NS}
# The statements of `schema/overlap` that become tables, each after those that it reads: of the
# sessions, and of what they recorded at the same time.
_OF_SESSIONS = ("session_trace", "process_namespace", "coverage", "overlap_window")
_IN_COMMON = (
    "session_pair", "session_container", "duplicate_event", "duplicate_count",
    "alternating_name", "given_namespace",
)  # fmt: skip


@dataclass(frozen=True)
class Corrections:
    """Corrections of the events of a reader."""

    duplicates: NDArray[np.int64]  # ids of events that another trace holds as well, in order
    # (session, pid, name of the thread) whose PID namespace is filled in where it is missing, as
    # one number each, in order.
    processes: NDArray[np.int64]
    namespaces: NDArray[np.int64]  # the PID namespace of each
    sessions: NDArray[np.int64]  # trace index -> number of its session
    names: Mapping[str | None, int]  # name of a thread -> its number

    def __bool__(self) -> bool:
        return bool(self.duplicates.size or self.processes.size)

    def applied(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        """Return the corrected events of a batch, perhaps none."""
        if self.duplicates.size:
            is_copy = _are_among(to_numpy(batch["event_id"]), self.duplicates)[0]
            batch = batch.filter(to_arrow(~is_copy)) if is_copy.any() else batch
        if self.processes.size and batch["pid_ns"].null_count:
            batch = self._with_namespaces(batch)
        return batch

    def _with_namespaces(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        names = batch["procname"]
        # The last one stands for no name.
        texts = [*names.dictionary.to_pylist(), None]
        numbers = np.array([self.names.get(text, -1) for text in texts], np.int64)
        processes = _process(
            self.sessions[to_numpy(batch["trace_index"])],
            to_numpy(batch["vpid"]),
            numbers[np.where(is_valid(names.indices), to_numpy(names.indices), -1)],
            len(self.names),
        )
        is_known, places = _are_among(processes, self.processes)
        is_given = is_valid(batch["pid_ns"])
        values = np.where(is_given, to_numpy(batch["pid_ns"]), self.namespaces[places])
        column = to_arrow(values, ~(is_given | is_known))
        return batch.set_column(batch.schema.get_field_index("pid_ns"), "pid_ns", column)


def corrections_of(con: duckdb.DuckDBPyConnection) -> Corrections:
    """Return how the events in `raw` have to be corrected, and fill `staging.left_out`."""
    for table in _OF_SESSIONS:
        statements().keep(con, table, _PARAMETERS)
    if con.execute("FROM overlap_window LIMIT 1").fetchall():
        con.execute(f"CREATE OR REPLACE TEMP VIEW thread_event AS {_events()}")
    for table in _IN_COMMON:
        statements().keep(con, table, _PARAMETERS)
    con.execute("INSERT INTO staging.left_out BY NAME FROM duplicate_count")
    duplicates = con.execute("SELECT event_id FROM duplicate_event ORDER BY ALL").fetchnumpy()
    traces = con.execute("SELECT session FROM session_trace ORDER BY trace_index").fetchnumpy()
    known = con.execute("FROM given_namespace").fetchnumpy()
    for table in (*_OF_SESSIONS, *_IN_COMMON):
        con.execute(f"DROP TABLE temp.{table}")
    con.execute("DROP VIEW IF EXISTS temp.thread_event")
    given = known["procname"].tolist()
    names = {name: number for number, name in enumerate(dict.fromkeys(given))}
    numbers = np.array([names[name] for name in given], np.int64)
    processes = _process(known["session"], known["vpid"], numbers, len(names))
    order = np.argsort(processes)
    return Corrections(
        np.asarray(duplicates["event_id"], np.int64),
        processes[order],
        np.asarray(known["namespace"], np.int64)[order],
        np.asarray(traces["session"], np.int64),
        names,
    )


@cache
def statements() -> Statements:
    """Return the statements about overlapping traces."""
    return Statements(resource_directory("schema") / "overlap")


def _events() -> str:
    of_threads = load().of_threads
    columns = "event_id, ts_ns, trace_index, cpu_id, thread_index"
    known = [
        f"SELECT {columns}, {number} AS tracepoint FROM raw.{tracepoint.table}"
        for number, tracepoint in enumerate(of_threads)
        if tracepoint is not USER_EVENT
    ]
    # One table has the user's events of all names: each name is a tracepoint of its own.
    user = (
        f"SELECT {columns}, {len(of_threads)} + n.number FROM raw.{USER_EVENT.table} JOIN (SELECT "
        "name, row_number() OVER (ORDER BY name) AS number FROM (SELECT DISTINCT name FROM "
        f"raw.{USER_EVENT.table})) AS n USING (name)"
    )
    return " UNION ALL ".join([*known, user])


def _process(
    sessions: NDArray[np.int64], pids: NDArray[np.int32], names: NDArray[np.int64], name_count: int
) -> NDArray[np.int64]:
    """Number (session, pid, name); a negative one where the name is none of those with a number."""
    numbers = np.where(names < 0, names, np.asarray(sessions, np.int64) * name_count + names)
    return (numbers << 32) | np.asarray(pids, np.int64)


def _are_among(
    values: NDArray[np.int64], known: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Return which values are among the sorted `known` ones, and their places there."""
    places = np.minimum(np.searchsorted(known, values), known.size - 1)
    return known[places] == values, places
