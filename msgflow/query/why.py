"""Why a topic is late: a verdict, and the answers of the named queries that it stands on."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

from msgflow.db.finding import kind_of
from msgflow.errors import NoFlowError
from msgflow.files.resources import resource_directory
from msgflow.query.catalogue import load_query
from msgflow.query.compare import warm_up_seconds
from msgflow.query.names import with_path_numbers
from msgflow.query.runner import Steps, run_query
from msgflow.sql.statement import Statements, internal_sql, registered
from msgflow.text.values import ARROW, format_duration

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice
    from msgflow.sql.header import Header
    from msgflow.sql.value import Value

_PIECES = 5
# The query whose paths are explained.
_FIRST = "e2e-latency"
_SAMPLED = "SELECT 1 FROM main.stack_sample WHERE run_id = ? LIMIT 1"
# By what a culprit lacks: how to know what is not known of it.
_RECORDED_BY = {
    "kernel": "msgflow record --kernel shows what had the CPU",
    "callbacks": "msgflow record -- COMMAND traces callbacks of Python nodes",
}
# What a path has in place of a topic without a name.
_UNNAMED = "?"
# Rows of an explanation: what its callbacks waited for, what was lost on the way, and the paths.
_OF_PATH = "FROM result WHERE path = $path"
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

    @property
    def ends(self) -> dict[str, Value]:
        """The parameter of queries of paths that chooses where flows end."""
        return {} if self.place is None else {"to": self.place}

    def explanation(self, asked: Slice) -> Explanation:
        """Ask all that an explanation consists of."""
        skipped, paths = self.paths(asked)
        since = ["--start", skipped] if skipped else []
        times = replace(asked, start=skipped) if skipped else asked
        values: dict[str, Any] = {
            "runs": [self.run.run_id],
            **times.window([self.run]).bindings,
            "asked_ns": asked.window([self.run]).start_ns,
            **self.steps.recorded,
        }
        self.steps.keep("ready_wait", values)
        waits = self.ask("waits-pair", times)
        parts = self.ask("path-breakdown", times, **self.ends)
        # What is lost while a system warms up is lost.
        losses = self.ask("topics-delivery", asked)
        verdict = self.verdict(values, paths, parts, losses)
        path = _worst(verdict, paths)
        shown = [path] if self.place is None else paths.table["path"].to_pylist()
        flow = self.ask("critical-path", times, **self.ends, via=[path], quantile="p95")
        paths = self.rows(_WORST_FIRST, paths, path=path)
        parts = self.rows(_OF_PATH, parts, path=path)
        losses = self.rows(_OWN_LOSSES, losses, places=path.split(ARROW))
        callbacks = [[row["node"], row["what"]] for row in parts.table.to_pylist()]
        kept = self.internal("kept_input", {**values, "paths": shown})
        functions = self.functions({**values, "callbacks": callbacks})
        notes = [
            *_to_record(verdict),
            *_without(skipped),
            *(row["detail"] for row in kept),
            *_outlier(self.run, paths.table.to_pylist()[0]),
            *paths.notes,
            *flow.notes,
            *_computing(functions),
        ]
        with registered(self.connection, piece=flow.table):
            pieces = self.internal("piece_to_ask", {})
        unnamed = [{}] if _UNNAMED in path.split(ARROW) else []
        steps = [
            *_next(kind_of("dead_end"), kept),
            *_next(kind_of("topic_unnamed"), unnamed),
            *_next(internal_sql().header("piece_to_ask"), pieces, since),
            *_next(load_query("critical-path"), flow.table.to_pylist()[:1]),
            *_next(load_query("topics-delivery"), losses.table.to_pylist()),
            *_next(internal_sql().header("callback_function"), functions[:1], since),
        ]
        return Explanation(
            run=self.run,
            start=times.start,
            place=self.place,
            verdict=replace(paths, table=verdict, header=None, notes=[], path_numbers={}),
            paths=paths,
            nodes=self.rows(internal_sql().text("node_share"), parts, "breakdown", path=path),
            slow_flow=self.rows(
                internal_sql().text("longest_piece"), flow, "slow_flow", count=_PIECES
            ),
            waits=self.rows(_OWN_WAITS, waits, callbacks=callbacks),
            losses=losses,
            steps=tuple(dict.fromkeys(steps)),
            notes=tuple(dict.fromkeys(notes)),
        )

    def ask(self, name: str, times: Slice, **given: Value) -> QueryResult:
        """Return the answer of a named query; its steps stay for the next one."""
        # The first one has looked for the places that are asked for; others are of its paths.
        header, is_first = load_query(name), name == _FIRST
        return run_query(
            self.connection,
            header,
            given,
            times,
            steps=self.steps,
            runs=(self.run,),
            is_known=not is_first,
        )

    def paths(self, asked: Slice) -> tuple[str | None, QueryResult]:
        """Return the paths without a warm-up, and when that is over; None: it is not left out."""
        paths = self.ask(_FIRST, asked, **self.ends)
        if not _has_flows(paths):
            raise self.nothing(asked)
        skipped = None
        # Of the flows that were read, as `compare` finds it.
        ((last_ns,),) = internal_sql().run(self.connection, "warm_up", {}).fetchall()
        if asked.start is None and last_ns is not None:
            start_ns = self.run.start_ns or 0
            seconds = warm_up_seconds(last_ns - start_ns)
            # It ends with a step, which may lie behind all that was asked for.
            if start_ns + seconds * 1e9 < asked.window([self.run]).end_ns:
                later = self.ask(_FIRST, replace(asked, start=f"{seconds:g}s"), **self.ends)
                # A recording may be shorter than the steps in which it is left out.
                if _has_flows(later):
                    skipped, paths = f"{seconds:g}s", later
        # Only paths have to be told apart.
        known = [] if self.ends else ["named_path"]
        return skipped, with_path_numbers(self.connection, paths, *known)

    def verdict(
        self, values: Mapping[str, Any], paths: QueryResult, parts: QueryResult, losses: QueryResult
    ) -> pa.Table:
        """Return the sentences about culprits."""
        tables = {"path_row": paths.table, "breakdown": parts.table, "delivery": losses.table}
        with registered(self.connection, **tables):
            for name in ("open_end", "why_callback", "suspect"):
                self.steps.keep(name, values)
            return internal_sql().run(self.connection, "verdict", values).to_arrow_table()

    def functions(self, values: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return in which functions the callback was that computes most, where samples are."""
        run_id = self.run.run_id
        if not self.connection.execute(_SAMPLED, [run_id]).fetchall():
            return []
        return self.internal("callback_function", {"run_id": run_id, **values})

    def internal(self, name: str, values: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the rows of a statement of `schema/internal`."""
        return list(internal_sql().rows(self.connection, name, values))

    def rows(self, sql: str, of: QueryResult, name: str = "result", **values: Any) -> QueryResult:
        """Return a result with the rows of a query on it, which reads it by this name."""
        with registered(self.connection, **{name: of.table}):
            return replace(of, table=self.connection.sql(sql, params=values).to_arrow_table())

    def nothing(self, asked: Slice) -> NoFlowError:
        """Return what to say where no flow ends at a place: flows may begin there or pass."""
        if self.place is None:
            message = "no flow arrives at the end of a path"
        elif any(
            fnmatchcase(step.strip("()"), self.place)
            for path in self.ask(_FIRST, asked).table["path"].to_pylist()
            for step in path.split(ARROW)
        ):
            return NoFlowError(
                f"flows begin there or pass, none ends — {self.place}",
                shlex.join(["msgflow", "query", _FIRST, "--via", self.place]),
            )
        else:
            message = f"no flow arrives — {self.place}"
        return NoFlowError(message, "msgflow check says where flows break off")


def _has_flows(paths: QueryResult) -> bool:
    return any(paths.table["pairs"].to_pylist())


def _worst(verdict: pa.Table, paths: QueryResult) -> str:
    """Return the path that the worst culprit delays, else the one that is slowest as a rule."""
    for path in verdict["path"].to_pylist():
        if path is not None:
            return str(path)
    slowest = max(paths.table.to_pylist(), key=lambda row: row["p95_ns"] or 0)
    return str(slowest["path"])


def _next(
    header: Header, rows: Iterable[Mapping[str, Any]], more: Sequence[str] = ()
) -> Iterator[tuple[str, ...]]:
    """Yield the commands that show more of rows, as words behind `msgflow`."""
    for row in rows:
        if words := header.next_command(row):
            yield (*words, *more)


def _to_record(verdict: pa.Table) -> Iterator[str]:
    """Yield how to know what is not known of culprits."""
    lacking = {word for words in verdict["lacks"].to_pylist() for word in words}
    for word, cure in _RECORDED_BY.items():
        if word in lacking:
            yield cure


def _without(skipped: str | None) -> Iterator[str]:
    """Yield what was left out."""
    if skipped:
        yield (
            f"without the first {skipped.removesuffix('s')} s, a warm-up: the longest latencies lie"
            " there (--start 0s reads them, too)"
        )


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
