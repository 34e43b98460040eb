"""Flow of one message: its start, and its steps from `main.flow_step`."""

from __future__ import annotations

from collections.abc import Mapping
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
    import duckdb
    import pyarrow as pa

    from msgflow.sql.value import Value

KINDS = ("publication", "take", "callback_instance", "request", "response")
STEPS_PER_MESSAGE = 3
MOST_VERTICES = 10_000


@dataclass(frozen=True)
class Start:
    """The start of a flow."""

    kind: str  # one of `KINDS`
    id: int
    notes: tuple[str, ...] = ()  # notes on the choice, a sentence each


def find_start(
    connection: duckdb.DuckDBPyConnection,
    place: str,
    at: str | int | None = None,
    run: str | int | None = None,
) -> Start:
    """Return the first publication of a topic, or what a node did first, at or after a time."""
    one = Slice(run).one_run(connection, "a message")
    require_names(connection, (one,), "place", [place])
    at_ns = MINIMUM_NS if at is None else time_point(at, (one,), "--at")
    bindings = {"run_id": one.run_id, "place": place, "at_ns": at_ns}
    ((kind, number, last_ns),) = internal_sql().run(connection, "flow_begin", bindings).fetchall()
    if last_ns is None:
        raise UsageError(
            f"the trace shows no message that was published there — {place}",
            f"msgflow query topics --run {one.run_id}",
        )
    if kind is None:
        raise UsageError(
            f"nothing was published on {place} at or after that time — {at}",
            f"the last one was at {_place(last_ns, one)}",
        )
    start_ns = one.start_ns
    is_early = at is not None and start_ns is not None and at_ns < start_ns
    note = f"the time of --at is before the run: this is the first of {place}"
    return Start(kind, number, (note,) if is_early else ())


def find_take(connection: duckdb.DuckDBPyConnection, start: Start) -> tuple[int, str, int]:
    """Return the take of longest latency that a start means, its topic, and the id of its run."""
    thing = {"kind": start.kind, "id": start.id}
    found = internal_sql().run(connection, "longest_take", thing).fetchall()
    if not found:
        is_message = start.kind == "publication"
        said = "no subscription took this message" if is_message else "no message was taken for it"
        raise UsageError(
            f"{said} — {start.kind} {start.id}",
            "a later one: --at TIME; or a take that msgflow query flows lists: --take ID",
        )
    ((take_id, topic, run_id),) = found
    return take_id, topic, run_id


def require_start(connection: duckdb.DuckDBPyConnection, start: Start) -> Run:
    """Return the run that `start` belongs to."""
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


def read_steps(
    connection: duckdb.DuckDBPyConnection, start: Start, run: Run, given: Mapping[str, Value]
) -> tuple[dict[str, Any], pa.Table]:
    """Return the parameters of a flow, and its steps: the nearest to the start first."""
    place: dict[str, Value] = {"kind": start.kind, "id": start.id, "run_id": run.run_id}
    asked: dict[str, Any] = bind(
        internal_sql().header("flow_steps"), {**given, **place}, "msgflow flow"
    )
    if asked["limit"] > MOST_VERTICES:
        raise UsageError(f"--limit is at most {MOST_VERTICES} — {asked['limit']}", "1000 is usual")
    with query_errors("the flow", "the flow cannot be read: {}"):
        return asked, internal_sql().run(connection, "flow_steps", asked).to_arrow_table()


def _place(time_ns: int, run: Run) -> str:
    if run.start_ns is None:
        return f"--at {time_ns}"
    seconds, nanoseconds = divmod(time_ns - run.start_ns, 1_000_000_000)
    return f"--at +{seconds}.{nanoseconds:09d} ({format_epoch(time_ns)})"
