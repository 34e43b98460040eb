"""Why a topic is late: a verdict, and the answers of the named queries that it stands on."""

from __future__ import annotations

import fnmatch
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from msgflow.errors import NoFlowError
from msgflow.files.resources import resource_directory
from msgflow.query.catalogue import load_query
from msgflow.query.course import Course, course_of
from msgflow.query.differences import warm_up_seconds
from msgflow.query.names import with_path_numbers
from msgflow.query.runner import Steps, run_query
from msgflow.sql.statement import (
    Statements,
    culprit_sql,
    health_sql,
    internal_sql,
    may_have_rows,
    registered,
)
from msgflow.text.values import ARROW, format_duration

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice
    from msgflow.sql.header import Header
    from msgflow.sql.value import Value

# The query whose paths are explained.
_FIRST = "e2e-latency"
# By what a culprit lacks: how to know what is not known of it.
_SHOWS_CPU = (
    "msgflow record shows which callbacks compute, sleep, or have no CPU; where it may not read"
    " clocks, msgflow record --kernel does"
)
_RECORDED_BY = {
    "cpu": _SHOWS_CPU,
    "samples": _SHOWS_CPU,
    "callbacks": "msgflow record -- COMMAND traces callbacks of Python nodes",
}
MOST_CULPRITS = 3
"""So many of the worst culprits are shown; the others are counted."""
# What a path has in place of a topic without a name.
_UNNAMED = "?"


@dataclass(frozen=True)
class Explanation:
    """Why messages that arrive somewhere are late.

    Attributes:
        run: what was read.
        start: begin of what was read, as of `msgflow.Slice`; as a rule a warm-up is left out.
        place: the topic or node at which flows end; None: wherever they end.
        verdict: a row for each culprit, the worst first: who, what kind, how much harm, the
            headline and what shows it; or one row which says that nothing stands out.
        doubts: what the recording cannot tell, or what is wrong with the system, as far as it
            touches these paths: rows of findings.
        paths: rows of `e2e-latency`, first the path of the worst culprit.
        nodes: share of the time of that path by node, and what most of it was; the largest first.
        slow_flow: rows of `critical-path`: the longest pieces of a slow flow of it, in order, and
            the sum of the others. Of 100 flows, 95 take no longer.
        waits: rows of `waits --by pair`: what kept the callbacks of the path waiting longest.
        losses: rows of `topics --measure delivery` on its topics with messages dropped or lost.
        course: what changed during all that was asked for, also in a warm-up.
        candidates: what may make data sooner, to be tried in a replay.
        steps: commands that show more of the path, as words behind `msgflow`.
        notes: a sentence each.
        suggestion: what to try first; None: nothing that is known to gain much.
    """

    run: Run
    start: str | int | None
    place: str | None
    verdict: QueryResult
    doubts: QueryResult
    paths: QueryResult
    nodes: QueryResult
    slow_flow: QueryResult
    waits: QueryResult
    losses: QueryResult
    course: Course
    candidates: pa.Table
    steps: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]
    suggestion: str | None = None

    @property
    def sections(self) -> dict[str, QueryResult]:
        """The results, by the names of the attributes."""
        names = ("verdict", "doubts", "paths", "nodes", "slow_flow", "waits", "losses")
        return {name: getattr(self, name) for name in names}


def explain(
    connection: duckdb.DuckDBPyConnection, run: Run, times: Slice, place: str | None = None
) -> Explanation:
    """Return why flows of a run are late that end at a place; raise NoFlowError if none does."""
    # Other queries have the rows of these steps by then, or most of what they are made of.
    known = Statements(resource_directory("schema") / "internal" / "why" / "step")
    with Steps(connection, known) as steps:
        return _Questions(connection, steps, run, place).explanation(times)


@dataclass(frozen=True)
class _Questions:
    """What is asked of a run to explain why its flows are late."""

    connection: duckdb.DuckDBPyConnection
    steps: Steps
    run: Run
    place: str | None

    def explanation(self, asked: Slice) -> Explanation:
        """Ask all that an explanation consists of."""
        first = self.ask(_FIRST, asked, to=self.place)
        if not _has_flows(first):
            raise self.nothing(asked)
        changes = self.ask("changes", asked, to=self.place)
        course = course_of(self.connection, self.run, changes)
        times, paths = self.paths(asked, first)
        values: dict[str, Any] = {
            "runs": [self.run.run_id],
            **times.window([self.run]).bindings,
            "asked_ns": asked.window([self.run]).start_ns,
            "place": self.place,
            **self.steps.recorded,
        }
        self.keep(["ready_wait"], values)
        waits = self.ask("waits-pair", times)
        parts = self.ask("path-breakdown", times, to=self.place)
        # What is lost while a system warms up is lost, but not by what runs later.
        losses = self.ask("topics-delivery", asked)
        later = losses if times == asked else self.ask("topics-delivery", times)
        tables = {
            "path_row": paths.table,
            "breakdown": parts.table,
            "delivery": later.table,
            "whole_delivery": losses.table,
            "change": changes.table,
        }
        with registered(self.connection, **tables):
            for kind in culprit_sql().names():
                self.keep(culprit_sql().header(kind).reads, values)
            self.steps.unite("culprit", culprit_sql(), values)
            verdict, candidates = (
                internal_sql().run(self.connection, name, values).to_arrow_table()
                for name in ("verdict", "remedy_candidate")
            )
            paths = self.rows("worst_first", paths, values | {"path": _worst(verdict)})
        since = ["--start", str(times.start)] if times != asked else []
        verdict = _with_next(verdict, since)
        values["path"] = path = paths.table["path"][0].as_py()
        values["paths"] = paths.table["path"].to_pylist()
        doubts = self.rows("doubt", paths, values)
        flow = self.ask("critical-path", times, to=self.place, via=[path], quantile="p95")
        parts = self.rows("path_part", parts, values)
        losses = self.rows("own_loss", losses, values)
        values["callbacks"] = [[row["node"], row["what"]] for row in parts.table.to_pylist()]
        with registered(self.connection, piece=flow.table):
            names = ("piece_to_ask", "callback_function")
            pieces, functions = (self.internal(name, values) for name in names)
        shown: list[tuple[Header, Sequence[Mapping[str, Any]], Sequence[str]]] = [
            (
                health_sql().header("topic_unnamed"),
                [values] if _UNNAMED in path.split(ARROW) else [],
                (),
            ),
            (internal_sql().header("hanging_call"), self.internal("hanging_call", values), ()),
            (internal_sql().header("piece_to_ask"), pieces, since),
            (load_query("critical-path"), flow.table.to_pylist()[:1], ()),
            (internal_sql().header("callback_function"), functions, since),
        ]
        steps = [
            (*words, *more)
            for header, rows, more in shown
            for row in rows
            if (words := header.next_command(row))
        ]
        notes = [
            *(cure for word, cure in _RECORDED_BY.items() if word in verdict["lacks"].to_pylist()),
            *(
                f"without the first {start.removesuffix('s')} s, a warm-up: the longest latencies"
                " of some paths lie there, and what was lost in it (--start 0s reads them, too)"
                for start in since[1:]
            ),
            *_outlier(self.run, paths.table.to_pylist()[0]),
            *paths.notes,
            *flow.notes,
            *_computing(functions),
        ]
        return Explanation(
            run=self.run,
            start=times.start,
            place=self.place,
            verdict=replace(paths, table=verdict, header=None, notes=[], path_numbers={}),
            doubts=replace(doubts, header=None, notes=[], path_numbers={}),
            paths=paths,
            nodes=self.rows("node_share", parts, values),
            slow_flow=self.rows("longest_piece", flow, values),
            waits=self.rows("own_wait", waits, values),
            losses=losses,
            course=course,
            candidates=candidates,
            steps=tuple(dict.fromkeys(steps)),
            notes=tuple(dict.fromkeys(notes)),
        )

    def paths(self, asked: Slice, paths: QueryResult) -> tuple[Slice, QueryResult]:
        """Return the paths, and the times that are read of them: a warm-up is left out."""
        times = asked
        # Of the flows that were read, as `compare` finds it.
        ((last_ns,),) = internal_sql().run(self.connection, "warm_up", {}).fetchall()
        if asked.start is None and last_ns is not None:
            start_ns = self.run.start_ns or 0
            skipped = warm_up_seconds(last_ns - start_ns)
            # It ends with a step, which may lie behind all that was asked for or recorded.
            if start_ns + skipped * 1e9 < asked.window([self.run]).end_ns:
                later = replace(asked, start=f"{skipped:g}s")
                warm = self.ask(_FIRST, later, to=self.place)
                if _has_flows(warm):
                    times, paths = later, warm
        # Only its paths have to be told apart.
        known = ["named_path"] if self.place is None else []
        return times, with_path_numbers(self.connection, paths, *known)

    def ask(self, name: str, times: Slice, **given: Value) -> QueryResult:
        """Return the answer of a named query; its steps stay for the next one."""
        return run_query(
            self.connection,
            load_query(name),
            given,
            times,
            steps=self.steps,
            runs=(self.run,),
            # The first one looks for the places that are asked for; others are of its paths.
            is_known=name != _FIRST,
        )

    def keep(self, names: Iterable[str], values: Mapping[str, Any]) -> None:
        """Make tables of statements of `schema/internal`, each after those that it reads."""
        for name in names:
            if name in internal_sql().names() and name not in self.steps:
                self.keep(internal_sql().header(name).reads, values)
                self.steps.keep(name, values)

    def internal(self, name: str, values: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the rows of a statement of `schema/internal`, none if it has nothing to read."""
        if not may_have_rows(self.connection, internal_sql().header(name).sources, values):
            return []
        return list(internal_sql().rows(self.connection, name, values))

    def rows(self, name: str, of: QueryResult, values: Mapping[str, Any]) -> QueryResult:
        """Return a result with the rows of a statement, which reads its table first."""
        table, *_ = internal_sql().header(name).reads
        with registered(self.connection, **{table: of.table}):
            rows = internal_sql().run(self.connection, name, values).to_arrow_table()
        return replace(of, table=rows)

    def nothing(self, asked: Slice) -> NoFlowError:
        """Return what to say where no flow ends at a place: flows may begin there or pass."""
        message = "no flow arrives at the end of a path"
        if self.place is not None:
            message = f"no flow arrives — {self.place}"
            paths = self.ask(_FIRST, asked).table["path"].to_pylist()
            steps = {step.strip("()") for path in paths for step in path.split(ARROW)}
            if fnmatch.filter(steps, self.place):
                return NoFlowError(
                    f"flows begin there or pass, none ends — {self.place}",
                    shlex.join(["msgflow", "query", _FIRST, "--via", self.place]),
                )
            values = {"runs": [self.run.run_id], "place": self.place}
            for row in self.internal("untaken_place", values):
                message += f"; {row['sentence']}"
        return NoFlowError(message, "msgflow check says where flows break off")


def _has_flows(paths: QueryResult) -> bool:
    return any(paths.table["pairs"].to_pylist())


def _worst(verdict: pa.Table) -> str | None:
    """Return the path that the worst culprit delays; None: it delays none of these."""
    return next(filter(None, verdict["path"].to_pylist()), None)


def _with_next(verdict: pa.Table, since: Sequence[str]) -> pa.Table:
    """Return culprits with the words behind `msgflow` of the command that shows more of each.

    `since` leaves a warm-up out; what is lost meanwhile is lost.
    """
    from msgflow.trace.numpy_arrow import texts_to_arrow

    lines = []
    for row in verdict.to_pylist():
        words = culprit_sql().header(row["kind"]).next_command(row) if row["kind"] else None
        if words and words[0] == "query" and not {"delivery", "unmatched"}.intersection(words):
            words = (*words, *since)
        lines.append(shlex.join(words) if words else None)
    return verdict.append_column("next", texts_to_arrow(lines))


def _outlier(run: Run, path: Mapping[str, Any]) -> Iterator[str]:
    """Yield when the slowest flow of a path began, if nearly all others took far less."""
    if path["max_ns"] > 2 * path["p95_ns"]:
        at_s = (path["max_root_ns"] - (run.start_ns or 0)) / 1e9
        yield (
            f"the slowest flow took {format_duration(path['max_ns'])}, at {at_s:.3f} s: an outlier"
            f" (msgflow flow --take {path['max_take_id']} --why)"
        )


def _computing(functions: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield in which functions the callback was that computes most."""
    shares = ", ".join(f"{row['function']} {100 * row['self_share']:.0f} %" for row in functions)
    for row in functions[:1]:
        of = f"(of {row['all_samples']:,} samples)"
        yield f"CPU time of {row['node']} {row['callback']}: {shares} {of}"
