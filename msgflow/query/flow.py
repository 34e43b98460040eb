"""Flow of one message: its start, and its steps from `main.flow_step`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from msgflow.errors import UsageError
from msgflow.query.names import require_names
from msgflow.query.runner import bind
from msgflow.run.choice import Run, read_runs
from msgflow.run.slice import Slice
from msgflow.run.window import MINIMUM_NS, format_epoch, time_point
from msgflow.sql.failure import query_errors
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Mapping

    import duckdb
    import pyarrow as pa

    from msgflow.sql.value import Value

KINDS = ("publication", "take", "callback_instance", "request", "response")
STEPS_PER_MESSAGE = 3
MOST_VERTICES = 10_000

_FIRST = """
SELECT b.publication_id
FROM main.publication AS b
JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
WHERE b.run_id = $run_id AND p.topic_name = $topic AND b.start_ns >= $at_ns
ORDER BY b.start_ns, b.publication_id
LIMIT 1
"""
_LAST = """
SELECT max(b.start_ns)
FROM main.publication AS b
JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
WHERE b.run_id = $run_id AND p.topic_name = $topic
"""


@dataclass(frozen=True)
class Start:
    """The start of a flow.

    Attributes:
        kind: one of `KINDS`.
        id: its id.
        notes: notes on the choice, a sentence each.
    """

    kind: str
    id: int
    notes: tuple[str, ...] = ()


def find_start(
    connection: duckdb.DuckDBPyConnection,
    topic: str,
    at: str | int | None = None,
    run: str | int | None = None,
) -> Start:
    """Return the first publication of a topic at or after a time.

    Args:
        connection: to a database with the public views.
        topic: its name.
        at: epoch ns, an offset from the run's start, or ISO time; the begin of the run when None.
        run: a name or an id; the latest run when None.

    Raises:
        UsageError: no such run or topic, a time that cannot be read, or no message then.
    """
    one = Slice(run).one_run(connection, "a message")
    require_names(connection, (one,), "topic", [topic])
    at_ns = MINIMUM_NS if at is None else time_point(at, (one,), "--at")
    bindings = {"run_id": one.run_id, "topic": topic}
    found = connection.execute(_FIRST, bindings | {"at_ns": at_ns}).fetchall()
    if not found:
        ((last_ns,),) = connection.execute(_LAST, bindings).fetchall()
        if last_ns is None:
            raise UsageError(
                f"the trace shows no message that was published on the topic — {topic}",
                f"msgflow query topics --run {one.run_id}",
            )
        raise UsageError(
            f"no message was published on {topic} at or after that time — {at}",
            f"the last one was at {_place(last_ns, one)}",
        )
    start_ns = one.start_ns
    is_early = at is not None and start_ns is not None and at_ns < start_ns
    note = "the time of --at is before the run: this is the first message on the topic"
    return Start("publication", found[0][0], (note,) if is_early else ())


def require_start(connection: duckdb.DuckDBPyConnection, start: Start) -> Run:
    """Return the run that `start` belongs to.

    Raises:
        UsageError: there is no such thing in the database.
    """
    # The kind is one of KINDS, never text of a user.
    found = connection.execute(
        f"SELECT run_id FROM main.{start.kind} WHERE {start.kind}_id = ?", [start.id]
    ).fetchall()
    if not found:
        raise UsageError(
            f"there is no such {start.kind} — {start.id}",
            f'msgflow sql "SELECT * FROM {start.kind}"',
        )
    return next(run for run in read_runs(connection) if run.run_id == found[0][0])


def flow_parameters(start: Start, run: Run, given: Mapping[str, Value]) -> dict[str, Any]:
    """Return the value of every parameter of `internal.flow_steps`.

    Args:
        start: where to begin.
        run: its run.
        given: direction, depth, limit and internal; those left out get their defaults.

    Raises:
        UsageError: a direction, depth or limit that is out of range.
    """
    place: dict[str, Value] = {"kind": start.kind, "id": start.id, "run_id": run.run_id}
    asked: dict[str, Any] = bind(
        internal_sql().header("flow_steps"), {**given, **place}, "msgflow flow"
    )
    if asked["limit"] > MOST_VERTICES:
        raise UsageError(f"--limit is at most {MOST_VERTICES} — {asked['limit']}", "1000 is usual")
    return asked


def read_steps(connection: duckdb.DuckDBPyConnection, asked: Mapping[str, Value]) -> pa.Table:
    """Return the steps of a flow, the nearest first, and how long executors were busy.

    Args:
        connection: to a database with the public views.
        asked: the result of `flow_parameters`.

    Raises:
        QueryError: the database could not run it.
    """
    with query_errors("the flow", "the flow cannot be read: {}"):
        return internal_sql().run(connection, "flow_steps", asked).to_arrow_table()


def _place(time_ns: int, run: Run) -> str:
    if run.start_ns is None:
        return f"--at {time_ns}"
    seconds, nanoseconds = divmod(time_ns - run.start_ns, 1_000_000_000)
    return f"--at +{seconds}.{nanoseconds:09d} ({format_epoch(time_ns)})"
