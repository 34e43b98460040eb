"""What the traces of one host tell twice, or differently, and how that is put right.

Two sessions that record the same events at the same time each write every event, with time stamps
of their own. Which events are in the record twice shows only when all of them have been read: the
traces are read again then, without the copies, so that what precedes an event on its thread is
what happened before it. So it is where only some traces of a host say in which PID namespace a
process is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from msgflow.ingest.catalogue import load

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb
    from numpy.typing import NDArray

# By how much the two records of one event may be apart [ns], at the ends of a recording.
_SLACK_NS = 100_000

_SOURCES = """
CREATE OR REPLACE TEMP TABLE session_trace AS
SELECT
    trace_index,
    dense_rank() OVER (ORDER BY clock_key, hostname) AS host,
    dense_rank() OVER (ORDER BY clock_key, hostname, coalesce(uuid, '')) AS session
FROM staging.source
"""

# Processes whose PID namespace only some traces tell, and always the same one.
_NAMESPACES = """
CREATE OR REPLACE TEMP TABLE told_namespace AS
SELECT s.host, r.vpid, any_value(r.pid_ns) AS pid_ns
FROM raw.thread AS r
JOIN session_trace AS s ON r.trace_index = s.trace_index
WHERE r.vpid >= 0
GROUP BY s.host, r.vpid
HAVING count(DISTINCT r.pid_ns) = 1 AND count(*) > count(r.pid_ns)
"""

# From when to when a session recorded on each CPU.
_COVERAGE = """
CREATE OR REPLACE TEMP TABLE coverage AS
SELECT
    s.host,
    s.session,
    p.cpu_id,
    min(coalesce(p.begin_ns, o.begin_ns, p.last_event_ns)) AS begin_ns,
    max(greatest(p.end_ns, p.last_event_ns, p.begin_ns)) AS end_ns
FROM raw.packet AS p
JOIN session_trace AS s ON p.trace_index = s.trace_index
JOIN staging.source AS o ON p.trace_index = o.trace_index
WHERE o.domain IS DISTINCT FROM 'kernel'
GROUP BY s.host, s.session, p.cpu_id
"""

_OVERLAPS = """
CREATE OR REPLACE TEMP TABLE overlap AS
SELECT
    a.session AS left_session,
    b.session AS used_session,
    a.cpu_id,
    b.begin_ns - {slack} AS begin_ns,
    b.end_ns + {slack} AS end_ns
FROM coverage AS a
JOIN coverage AS b
    ON a.host = b.host
    AND a.session <> b.session
    AND a.cpu_id IS NOT DISTINCT FROM b.cpu_id
    AND a.begin_ns <= b.end_ns
    AND b.begin_ns <= a.end_ns
"""

# Of the sessions that recorded a tracepoint on a thread that with most events of the thread is
# used, and of the others what it does not have.
_LEFT_OUT = """
CREATE OR REPLACE TEMP TABLE left_out AS
WITH event AS (
    {events}
),
thread AS (
    SELECT
        r.thread_index,
        min(r.thread_index) OVER (
            PARTITION BY s.host, coalesce(r.pid_ns, n.pid_ns), r.vpid, r.vtid
        ) AS thread
    FROM raw.thread AS r
    JOIN session_trace AS s ON r.trace_index = s.trace_index
    LEFT JOIN told_namespace AS n ON s.host = n.host AND r.vpid = n.vpid
),
placed AS (
    SELECT e.event_id, e.tracepoint, e.ts_ns, e.cpu_id, e.trace_index, s.session, t.thread
    FROM event AS e
    JOIN session_trace AS s ON e.trace_index = s.trace_index
    JOIN thread AS t ON e.thread_index = t.thread_index
    WHERE s.session IN (SELECT left_session FROM overlap)
),
recorded AS (
    SELECT
        thread, tracepoint, session,
        sum(count(*)) OVER (PARTITION BY thread, session) AS event_count,
        min(min(trace_index)) OVER (PARTITION BY session) AS first_index
    FROM placed
    GROUP BY thread, tracepoint, session
),
preferred AS (
    SELECT
        l.thread, l.tracepoint, l.session AS left_session, u.session AS used_session,
        u.first_index AS used_index
    FROM recorded AS l
    JOIN recorded AS u
        ON l.thread = u.thread
        AND l.tracepoint = u.tracepoint
        AND (-u.event_count, u.first_index) < (-l.event_count, l.first_index)
)
SELECT
    p.event_id,
    any_value(p.trace_index) AS trace_index,
    min(f.used_index) AS used_index,
    any_value(p.thread) AS thread,
    any_value(p.ts_ns) AS ts_ns
FROM placed AS p
JOIN preferred AS f
    ON p.thread = f.thread AND p.tracepoint = f.tracepoint AND p.session = f.left_session
JOIN overlap AS o
    ON f.left_session = o.left_session
    AND f.used_session = o.used_session
    AND p.cpu_id IS NOT DISTINCT FROM o.cpu_id
    AND p.ts_ns >= o.begin_ns
    AND p.ts_ns <= o.end_ns
GROUP BY p.event_id
"""

_REPORT = """
INSERT INTO staging.left_out
SELECT
    trace_index, used_index, count(*), count(DISTINCT thread), max(ts_ns) - min(ts_ns)
FROM left_out
GROUP BY trace_index, used_index
"""


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
        is_copy = _are_among(np.asarray(batch["event_id"]), self.left_out)[0]
        return batch.filter(pa.array(~is_copy)) if is_copy.any() else batch

    def _with_namespaces(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        processes = _process(self.hosts[np.asarray(batch["trace_index"])], batch["vpid"])
        is_known, places = _are_among(processes, self.processes)
        is_given = np.asarray(batch["pid_ns"].is_valid())
        values = np.where(
            is_given, np.asarray(batch["pid_ns"].fill_null(0)), self.namespaces[places]
        )
        column = pa.array(values, pa.int64(), mask=~(is_given | is_known))
        return batch.set_column(batch.schema.get_field_index("pid_ns"), "pid_ns", column)


def find(con: duckdb.DuckDBPyConnection) -> Corrections:
    """Look for what has to be put right in what was read into `raw`.

    Args:
        con: connection with `raw` and `staging` attached and filled; `staging.left_out` is filled.
    """
    for statement in (_SOURCES, _NAMESPACES, _COVERAGE, _OVERLAPS.format(slack=_SLACK_NS)):
        con.execute(statement)
    left_out = np.empty(0, np.int64)
    if con.execute("SELECT 1 FROM overlap LIMIT 1").fetchall():
        con.execute(_LEFT_OUT.format(events=_events()))
        con.execute(_REPORT)
        left_out = con.execute("SELECT event_id FROM left_out ORDER BY ALL").fetchnumpy()[
            "event_id"
        ]
        con.execute("DROP TABLE left_out")
    told = con.execute("SELECT host, vpid, pid_ns FROM told_namespace").fetchnumpy()
    hosts = con.execute("SELECT host FROM session_trace ORDER BY trace_index").fetchnumpy()["host"]
    for table in ("session_trace", "told_namespace", "coverage", "overlap"):
        con.execute(f"DROP TABLE {table}")
    processes = _process(told["host"], told["vpid"])
    order = np.argsort(processes)
    return Corrections(
        np.asarray(left_out),
        processes[order],
        np.asarray(told["pid_ns"], np.int64)[order],
        np.asarray(hosts, np.int64),
    )


def _events() -> str:
    return "\n    UNION ALL\n    ".join(
        f"SELECT event_id, ts_ns, trace_index, cpu_id, thread_index, {number} AS tracepoint "
        f"FROM raw.{tracepoint.table}"
        for number, tracepoint in enumerate(load().of_threads)
    )


def _process(hosts: NDArray[np.int64], pids: Sequence[int] | pa.Array) -> NDArray[np.int64]:
    return (np.asarray(hosts, np.int64) << 32) | np.asarray(pids, np.int64)


def _are_among(
    values: NDArray[np.int64], known: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Return which values are among the known ones, which are in order, and where."""
    places = np.minimum(np.searchsorted(known, values), known.size - 1)
    return known[places] == values, places
