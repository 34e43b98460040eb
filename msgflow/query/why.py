"""Why a topic is late: a verdict, and the answers of the named queries that it stands on."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import partial
from typing import TYPE_CHECKING, Any

from msgflow.errors import NoFlowError
from msgflow.query.catalogue import load_query
from msgflow.query.compare import warm_up_seconds
from msgflow.query.names import with_path_numbers
from msgflow.query.runner import Steps, run_query
from msgflow.sql.statement import internal_sql, registered
from msgflow.text.values import format_duration

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice
    from msgflow.sql.value import Value

    Ask = Callable[..., QueryResult]

_PIECES = 5
_OF_VERDICT = ("open_end", "why_callback", "suspect")
_DEAD_ENDS = (
    "SELECT subject, detail FROM store.finding WHERE name = 'dead_end' AND list_contains(?, run_id)"
)
# Steps whose rows an earlier query of the explanation has in its tables: it costs less to read them
# there. The breakdown explains the waits of all flows, and one of these is the flow that is shown.
_KNOWN = {
    "explained_wait": "FROM main.executor_wait_explained("
    "$runs, arrivals := 'exact_arrival', waits := 'ready_wait',"
    " has_kernel := $has_kernel, has_teams := $has_teams)",
    "breakdown_wait": "SELECT callback_instance_id, executor_id, busy_min_ns, busy_max_ns,"
    " held_max_ns FROM explained_wait",
    "critical_trail": "SELECT c.flow_id, t.hop, t.take_id, t.publication_id, t.previous_take_id,"
    " t.next_take_id FROM critical_flow AS c JOIN breakdown_flow AS b ON c.path_id = b.path_id"
    " AND c.root_kind = b.root_kind AND c.root_id = b.root_id AND c.take_id = b.take_id"
    " JOIN breakdown_trail AS t ON b.flow_id = t.flow_id",
    "critical_part": "FROM main.end_to_end_piece_explained("
    "'critical_flow', 'critical_trail', 'breakdown_callback', $runs, has_turns := $has_turns)",
    "critical_piece": "FROM main.critical_piece('critical_part', $runs, waits := 'ready_wait',"
    " has_kernel := $has_kernel, has_calls := $has_calls, has_teams := $has_teams)",
}
_SAMPLED = "SELECT 1 FROM main.stack_sample WHERE run_id = ? LIMIT 1"
# How to know what a sentence says is not known.
_UNKNOWN = {
    "not known without a kernel trace": "msgflow record --kernel shows what had the CPU",
    "not known without its callbacks": "msgflow record -- COMMAND traces callbacks of Python nodes",
}
# What a path has in place of a topic without a name.
_UNNAMED = "?"
# Rows of an explanation: what its callbacks waited for, what was lost on the way, and the paths.
_OWN_WAITS = "FROM result WHERE list_contains($callbacks, [node, callback]) LIMIT 3"
_OWN_LOSSES = (
    f"FROM result WHERE list_contains($places, coalesce(topic_name, '{_UNNAMED}'))"
    " AND list_contains($places, subscriber) AND dropped + lost > 0"
)
_WORST_FIRST = "FROM result ORDER BY path <> $path, p95_ns DESC NULLS LAST, path"


@dataclass(frozen=True)
class Explanation:
    """Why messages that arrive somewhere are late.

    Attributes:
        run: what was read.
        start: begin of what was read, as of `msgflow.Slice`; as a rule a warm-up is left out.
        place: the topic or node at which flows end; None: wherever they end.
        verdict: a sentence for each culprit, the worst first; before them what is wrong with the
            recording, or the system. `who` and `kinds` say who does what.
        paths: rows of `e2e-latency`, first the path of the worst culprit.
        nodes: share of the time of that path by node, and what most of it was; the largest first.
        slow_flow: rows of `critical-path`: the longest pieces of a slow flow of it, in order, and
            the sum of the others. Of 100 flows, 95 take no longer.
        waits: rows of `waits --by pair`: what kept the callbacks of the path waiting longest.
        losses: rows of `topics --measure delivery` on its topics with messages dropped or lost.
        steps: commands that show more, as words behind `msgflow`.
        notes: a sentence each.
    """

    run: Run
    start: str | int | None
    place: str | None
    verdict: QueryResult
    paths: QueryResult
    nodes: QueryResult
    slow_flow: QueryResult
    waits: QueryResult
    losses: QueryResult
    steps: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]

    @property
    def sections(self) -> dict[str, QueryResult]:
        """The results, by the names of the attributes."""
        names = ("verdict", "paths", "nodes", "slow_flow", "waits", "losses")
        return {name: getattr(self, name) for name in names}


def explain(
    connection: duckdb.DuckDBPyConnection, run: Run, times: Slice, place: str | None = None
) -> Explanation:
    """Return why flows of a run are late that end at a place; raise NoFlowError if none does."""
    with Steps(connection, _KNOWN) as steps:

        def ask(name: str, part: Slice, **given: Value) -> QueryResult:
            header, is_first = load_query(name), name == "e2e-latency"
            # It has looked for the places that are asked for; others are of its paths.
            result = run_query(
                connection, header, given, part, steps=steps, runs=(run,), is_known=not is_first
            )
            # Only its paths have to be told apart.
            if not is_first:
                return result
            return with_path_numbers(connection, result, *([] if given else ["named_path"]))

        try:
            return _explained(connection, ask, run, times, place, steps.recorded)
        finally:
            for name in ("ready_wait", *_OF_VERDICT):
                connection.execute(f"DROP TABLE IF EXISTS temp.{name}")


def _explained(
    connection: duckdb.DuckDBPyConnection,
    ask_of: Ask,
    run: Run,
    asked: Slice,
    place: str | None,
    recorded: Mapping[str, bool],
) -> Explanation:
    ends = {} if place is None else {"to": place}
    paths = ask_of("e2e-latency", asked, **ends)
    if not _has_flows(paths):
        raise _nothing(partial(ask_of, part=asked), place)
    skipped = 0.0
    if asked.start is None:
        # Of the flows that were read, as `compare` finds it.
        ((last_ns,),) = internal_sql().run(connection, "warm_up", {}).fetchall()
        skipped = warm_up_seconds(None if last_ns is None else last_ns - (run.start_ns or 0))
    # It ends with a step, which may lie behind all that was asked for.
    if (run.start_ns or 0) + skipped * 1e9 >= asked.window([run]).end_ns:
        skipped = 0.0
    times = asked
    if skipped:
        later = replace(asked, start=f"{skipped:g}s")
        warm = ask_of("e2e-latency", later, **ends)
        # A recording may be shorter than the steps in which it is left out.
        times, paths, skipped = (later, warm, skipped) if _has_flows(warm) else (asked, paths, 0.0)
    ask = partial(ask_of, part=times)
    values = {"runs": [run.run_id], **times.window([run]).bindings, **recorded}
    values["asked_ns"] = asked.window([run]).start_ns
    internal_sql().keep(connection, "ready_wait", values)
    waits = ask("waits-pair")
    parts = ask("path-breakdown", **ends)
    # What is lost while a system warms up is lost.
    losses = ask_of("topics-delivery", asked)
    shown = paths.table["path"].to_pylist()
    tables = {"path_row": paths.table, "breakdown": parts.table, "delivery": losses.table}
    with registered(connection, **tables):
        for name in _OF_VERDICT:
            internal_sql().keep(connection, name, values)
        verdict = internal_sql().run(connection, "verdict", values).to_arrow_table()
    path = _worst(verdict, paths)
    places = path.split(" → ")
    flow = ask("critical-path", **ends, via=[path], quantile="p95")
    parts = _rows(connection, "FROM result WHERE path = $path", parts, "result", path=path)
    callbacks = [[row["node"], row["what"]] for row in parts.table.to_pylist()]
    # What is said of paths that end at a node which publishes.
    ends_of = [each.split(" → ")[-2:] for each in ([path] if place is None else shown)]
    dead_ends = connection.execute(_DEAD_ENDS, [values["runs"]]).fetchall()
    said = (
        detail
        for node, detail in dead_ends
        if any(node == last and f" on {topic} " in detail for topic, last in ends_of)
    )
    ends_here = list(dict.fromkeys(said))
    waits = _rows(connection, _OWN_WAITS, waits, "result", callbacks=callbacks)
    losses = _rows(connection, _OWN_LOSSES, losses, "result", places=places)
    paths = _rows(connection, _WORST_FIRST, paths, "result", path=path)
    internal, since = internal_sql(), ["--start", f"{skipped:g}s"] if skipped else []
    asked_for = {"has_unknown": bool(ends_here) or _UNNAMED in places, "since": since}
    with registered(connection, piece=flow.table, loss=losses.table):
        steps = internal.run(connection, "next_command", asked_for).fetchall()
    computes = _functions(connection, run, {**values, "callbacks": callbacks}, since)
    sentences = " ".join(verdict["sentence"].to_pylist())
    notes = [cure for unknown, cure in _UNKNOWN.items() if unknown in sentences]
    if skipped:
        notes.append(
            f"without the first {skipped:g} s, a warm-up: the longest latencies lie there (--start"
            " 0s reads them, too)"
        )
    notes += [*ends_here, *_outlier(run, paths.table.to_pylist()[0]), *paths.notes, *flow.notes]
    notes += computes[0]
    return Explanation(
        run=run,
        start=times.start,
        place=place,
        verdict=replace(paths, table=verdict, header=None, notes=[], path_numbers={}),
        paths=paths,
        nodes=_rows(connection, internal.text("node_share"), parts, "breakdown", path=path),
        slow_flow=_rows(
            connection, internal.text("longest_piece"), flow, "slow_flow", count=_PIECES
        ),
        waits=waits,
        losses=losses,
        steps=(*(tuple(words) for (words,) in steps), *computes[1]),
        notes=tuple(dict.fromkeys(notes)),
    )


def _worst(verdict: pa.Table, paths: QueryResult) -> str:
    """Return the path that the worst culprit delays, else the one that is slowest as a rule."""
    for path in verdict["path"].to_pylist():
        if path is not None:
            return str(path)
    slowest = max(paths.table.to_pylist(), key=lambda row: row["p95_ns"] or 0)
    return str(slowest["path"])


def _has_flows(paths: QueryResult) -> bool:
    return any(row["pairs"] for row in paths.table.to_pylist())


def _outlier(run: Run, path: dict[str, Any]) -> Iterator[str]:
    """Yield when the slowest flow of a path began, if nearly all others took far less."""
    if path["max_ns"] > 2 * path["p95_ns"]:
        at_s = (path["max_root_ns"] - (run.start_ns or 0)) / 1e9
        yield (
            f"the slowest flow took {format_duration(path['max_ns'])}, at {at_s:.3f} s: an outlier"
            f" (msgflow flow --take {path['max_take_id']} --why)"
        )


def _nothing(ask: Ask, place: str | None) -> NoFlowError:
    """Return what to say where no flow ends at a place: flows may begin there or pass."""
    if place is None:
        message = "no flow arrives at the end of a path"
    elif any(
        fnmatchcase(step.strip("()"), place)
        for row in ask("e2e-latency").table.to_pylist()
        for step in row["path"].split(" → ")
    ):
        return NoFlowError(
            f"flows begin there or pass, none ends — {place}",
            shlex.join(["msgflow", "query", "e2e-latency", "--via", place]),
        )
    else:
        message = f"no flow arrives — {place}"
    return NoFlowError(message, "msgflow check says where flows break off")


def _rows(
    connection: duckdb.DuckDBPyConnection, sql: str, of: QueryResult, name: str, **values: Any
) -> QueryResult:
    """Return a result with the rows of a query on it, which reads it by this name."""
    with registered(connection, **{name: of.table}):
        return replace(of, table=connection.sql(sql, params=values).to_arrow_table())


def _functions(
    connection: duckdb.DuckDBPyConnection, run: Run, values: Mapping[str, Any], since: list[str]
) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return a sentence on the callback that computes most, where samples are, and a command."""
    if not connection.execute(_SAMPLED, [run.run_id]).fetchall():
        return [], []
    asked = {"run_id": run.run_id, **values}
    rows = internal_sql().run(connection, "callback_function", asked).fetchall()
    if not rows:
        return [], []
    node, callback, *_, samples = rows[0]
    shares = ", ".join(f"{function} {100 * share:.0f} %" for *_, function, share, _ in rows)
    said = f"CPU time of {node} {callback}: {shares} (of {samples:,} samples)"
    return [said], [("query", "functions", "--node", node, "--callback", callback, *since)]
