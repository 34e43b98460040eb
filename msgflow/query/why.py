"""Why a topic is late: the answers of the named queries on the path of its slowest flow."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

import duckdb

from msgflow.errors import UsageError
from msgflow.sql.statement import internal_sql
from msgflow.text.values import format_duration

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run

    Ask = Callable[..., QueryResult]

_PIECES = 5
_WAITS = 3
# By what took longest in the slowest flow: the query that shows more of it, by node or by topic.
_BY_NODE = {
    "callback": ("callbacks", "--each", "--slowest", "5"),
    "executor_busy": ("waits", "--by", "instance", "--slowest", "5"),
    "all_threads_busy": ("waits", "--by", "instance", "--slowest", "5"),
    "blocked": ("waits", "--by", "instance", "--slowest", "5"),
    "undecided": ("waits", "--by", "instance", "--slowest", "5"),
    "take_to_callback": ("waits", "--by", "instance", "--slowest", "5"),
    "timer": ("timers",),
    "service": ("service-latency",),
}
_BY_STATE = {"preempted": "preemption", "runnable": "wakeup"}
_BY_TOPIC = dict.fromkeys(("network_or_idle", "undecided"), ("topics", "--measure", "latency"))
_LINKS = ("suggest", "links")
# What a path has in place of a topic without a name.
_UNNAMED = "?"
_NO_NAMES = (None, _UNNAMED)
# Queries with rows of callbacks: none of what a node without traced callbacks did.
_OF_CALLBACKS = ("callbacks", "waits")


@dataclass(frozen=True)
class Explanation:
    """Why messages that arrive somewhere are late.

    Attributes:
        run: what was read.
        place: the topic or node at which flows end; None: wherever they end.
        paths: rows of `e2e-latency`, the path with the slowest flow first.
        nodes: share of the time of that path by node, and what most of it was; the largest first.
        slowest_flow: rows of `critical-path`: the longest pieces of its slowest flow, in order.
        waits: rows of `waits --by pair`: what kept the callbacks of the path waiting longest.
        losses: rows of `topics --measure delivery` on its topics with messages not delivered.
        steps: commands that show more, as words behind `msgflow`.
        notes: a sentence each.
    """

    run: Run
    place: str | None
    paths: QueryResult
    nodes: QueryResult
    slowest_flow: QueryResult
    waits: QueryResult
    losses: QueryResult
    steps: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]

    @property
    def sections(self) -> dict[str, QueryResult]:
        """The results, by the names of the attributes."""
        names = ("paths", "nodes", "slowest_flow", "waits", "losses")
        return {name: getattr(self, name) for name in names}


def explain(
    ask: Ask,
    run: Run,
    place: str | None,
    dead_ends: Sequence[tuple[str, str]],
    hanging: Sequence[str],
) -> Explanation:
    """Return why flows are late that end at a topic or node.

    Args:
        ask: runs a named query in the run and the times that are wanted.
        run: that run.
        place: a topic or node, or a glob; the path with the slowest flow of all when None.
        dead_ends: nodes that publish and at which messages end, with what is said of it.
        hanging: what is said of callbacks that never ended.

    Raises:
        UsageError: there is no such place, or no flow arrives there.
    """
    ends = {} if place is None else {"to": place}
    flow = ask("critical-path", **ends)
    pieces = flow.table.to_pylist()
    if not pieces:
        raise _nothing(ask, place)
    path = pieces[0]["path"]
    places = path.split(" → ")
    paths = ask("e2e-latency", **ends)
    parts = _chosen(ask("path-breakdown", **ends), lambda row: row["path"] == path)
    callbacks = {(row["node"], row["what"]) for row in parts.table.to_pylist()}
    shown = [path] if place is None else paths.table["path"].to_pylist()
    ends_here = list(dict.fromkeys(_ending(dead_ends, shown)))
    waits = _chosen(ask("waits-pair"), lambda row: (row["node"], row["callback"]) in callbacks)
    losses = _chosen(
        ask("topics-delivery"),
        lambda row: (
            (row["topic_name"] or _UNNAMED) in places
            and row["subscriber"] in places
            and row["delivered"] < row["published"]
        ),
    )
    return Explanation(
        run=run,
        place=place,
        paths=_slowest_first(paths, path),
        nodes=_by_node(parts, path),
        slowest_flow=_longest(flow),
        waits=waits.first(_WAITS),
        losses=losses,
        steps=tuple(dict.fromkeys(_steps(places, ends_here, pieces, losses))),
        notes=tuple(
            dict.fromkeys(
                [
                    *hanging,
                    *ends_here,
                    *_preempted(pieces),
                    *_unexplained(pieces, waits.table.to_pylist()),
                    *paths.notes,
                    *flow.notes,
                ]
            )
        ),
    )


def _nothing(ask: Ask, place: str | None) -> UsageError:
    """Return what to say where no flow ends at a place: flows may begin there or pass."""
    if place is None:
        message = "no flow arrives at the end of a path"
    elif any(
        fnmatchcase(step.strip("()"), place)
        for row in ask("e2e-latency").table.to_pylist()
        for step in row["path"].split(" → ")
    ):
        return UsageError(
            f"flows begin there or pass, none ends — {place}",
            shlex.join(["msgflow", "query", "e2e-latency", "--via", place]),
        )
    else:
        message = f"no flow arrives — {place}"
    return UsageError(message, "msgflow check says where flows break off")


def _ending(dead_ends: Sequence[tuple[str, str]], paths: Sequence[str]) -> Iterator[str]:
    """Yield what is said of paths that end at a node which publishes."""
    ends = [path.split(" → ")[-2:] for path in paths]
    for node, detail in dead_ends:
        if any(node == last and f" on {topic} " in detail for topic, last in ends):
            yield detail


def _preempted(pieces: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Yield what took the CPU, if most of the slowest flow was over while others had it."""
    lost = [row for row in pieces if row["state"] == "preempted"]
    latency_ns = pieces[0]["latency_ns"]
    total_ns = sum(row["duration_ns"] for row in lost)
    if 2 * total_ns <= latency_ns:
        return
    by: dict[str, int] = {}
    for row in lost:
        who = row["who"] or "?"
        if row["who_priority"] is not None:
            who += f" (priority {row['who_priority']}, taken from {row['priority']})"
        by[who] = by.get(who, 0) + row["duration_ns"]
    names = sorted(by, key=lambda who: -by[who])[:_WAITS]
    yield (
        f"for {100 * total_ns / latency_ns:.0f} % of the slowest flow another thread had the CPU: "
        + ", ".join(f"{who} for {format_duration(by[who])}" for who in names)
    )


def _unexplained(
    pieces: Sequence[dict[str, Any]], waits: Sequence[dict[str, Any]]
) -> Iterator[str]:
    """Yield what may explain the slowest flow, if most of it was over without a known reason.

    The groups of callbacks are not in a trace: one thread may be free, and must not run them.
    """
    latency_ns = pieces[0]["latency_ns"]
    undecided = [row for row in pieces if row["activity"] == "undecided"]
    undecided_ns = sum(row["duration_ns"] for row in undecided)
    if 2 * undecided_ns > latency_ns:
        nodes = ", ".join(dict.fromkeys(row["node"] or "?" for row in undecided))
        yield (
            f"for {100 * undecided_ns / latency_ns:.0f} % of the slowest flow nothing shows whether"
            f" the message was on its way or waited in the queue of {nodes}"
        )
    total_ns = sum(
        row["duration_ns"]
        for row in pieces
        if row["activity"] == "network_or_idle" and row["state"] is None
    )
    if 2 * total_ns <= latency_ns:
        return
    others = [row for row in waits if row["meanwhile_callback"] and 2 * row["worst_ns"] > total_ns]
    if others:
        other = max(others, key=lambda row: row["worst_ns"])
        yield (
            f"for {100 * total_ns / latency_ns:.0f} % of the slowest flow a thread of the executor"
            f" was free, but others ran {other['meanwhile_callback']} of {other['meanwhile_node']}"
            f" (for up to {format_duration(other['worst_ns'])} of a wait): one callback group may"
            " have both"
        )
    else:
        yield (
            f"for {100 * total_ns / latency_ns:.0f} % of the slowest flow the message was on its"
            " way, or its thread had no CPU: a kernel trace shows which (msgflow record --kernel)"
        )


def _chosen(result: QueryResult, is_wanted: Callable[[dict[str, Any]], bool]) -> QueryResult:
    rows = result.table.to_pylist()
    return _taken(result, [place for place, row in enumerate(rows) if is_wanted(row)])


def _taken(result: QueryResult, places: Sequence[int]) -> QueryResult:
    import pyarrow

    # Table.take() would load pandas, which takes longer than all these rows.
    table = result.table
    rows = [table.slice(place, 1) for place in places] or [table.slice(0, 0)]
    return replace(result, table=pyarrow.concat_tables(rows))


def _slowest_first(paths: QueryResult, first: str) -> QueryResult:
    rows = paths.table.to_pylist()
    places = sorted(
        range(len(rows)),
        key=lambda place: (rows[place]["path"] != first, -(rows[place]["max_ns"] or 0)),
    )
    return _taken(paths, places)


def _by_node(parts: QueryResult, path: str) -> QueryResult:
    """Return the share of each node in the time of a path, and the largest of its parts."""
    with duckdb.connect() as con:
        con.register("breakdown", parts.table)
        table = internal_sql().run(con, "node_share", {"path": path}).to_arrow_table()
    return replace(parts, table=table)


def _longest(flow: QueryResult) -> QueryResult:
    rows = flow.table.to_pylist()
    longest = sorted(range(len(rows)), key=lambda place: -rows[place]["duration_ns"])[:_PIECES]
    return _taken(flow, sorted(longest))


def _steps(
    places: Sequence[str],
    dead_ends: Sequence[str],
    pieces: Sequence[dict[str, Any]],
    losses: QueryResult,
) -> Iterator[tuple[str, ...]]:
    """Yield the commands that show more: of the longest piece, the flow, and lost messages.

    First comes what the path lacks: links, or names of topics.
    """
    if dead_ends or _UNNAMED in places:
        yield _LINKS
    longest = max(pieces, key=lambda row: row["duration_ns"])
    if of_state := _BY_STATE.get(longest["state"] or ""):
        yield ("query", "scheduling", "--measure", of_state)
    # What the trace has no name for cannot be asked for.
    elif (
        longest["node"] is not None
        and (of_node := _BY_NODE.get(longest["activity"]))
        and (longest["callback_instance_id"] is not None or of_node[0] not in _OF_CALLBACKS)
    ):
        yield ("query", *of_node, "--node", longest["node"])
    elif (of_topic := _BY_TOPIC.get(longest["activity"])) and longest["what"] not in _NO_NAMES:
        yield ("query", *of_topic, "--topic", longest["what"])
    yield ("flow", "--take", str(pieces[0]["take_id"]), "--why")
    if len(losses):
        topics = set(losses.table["topic_name"].to_pylist())
        named = (
            []
            if None in topics
            else [word for topic in sorted(topics) for word in ("--topic", topic)]
        )
        yield ("query", "topics", "--measure", "unmatched", *named)
