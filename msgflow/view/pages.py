"""Data of the pages, read from a database: by the server on request, by a report in advance."""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, replace
from typing import Any

import duckdb
import pyarrow as pa

from msgflow.db.finding import read_findings
from msgflow.errors import NoFlowError, UsageError
from msgflow.query.catalogue import load_query
from msgflow.query.compare import compare, warm_up
from msgflow.query.course import Course, read_course
from msgflow.query.notes import clock_notes
from msgflow.query.runner import Steps, bind, run_query
from msgflow.query.why import explain
from msgflow.result.query_result import QueryResult
from msgflow.run.slice import Slice
from msgflow.run.window import WHOLE, Window
from msgflow.sql.statement import internal_sql
from msgflow.sql.value import Value
from msgflow.text.shell import shell_joined
from msgflow.trace.numpy_arrow import integers_to_arrow, texts_to_arrow
from msgflow.view import summary
from msgflow.view.page_query import Params, Question, Scratch, page_query, run_page_query
from msgflow.view.sql_page import examples, words
from msgflow.view.table_encoding import encode, encode_result, escaped
from msgflow.view.what_if import WhatIf

# Named queries that pages show, with the numbers of `msgflow query`.
NAMED = (
    "e2e-latency", "path-breakdown", "e2e-latency-reaction", "e2e-latency-age",
    "executor-usage",
    "waits", "waits-pair", "topics-rate", "topics-latency", "service-latency",
    "action-latency", "links", "topics-delivery", "info-hosts", "info-processes", "topics-summary",
    "callbacks", "timers", "info-nodes",
)  # fmt: skip
# A window with more bars than this is drawn in bins, in so many at the most.
MOST_BARS = 40_000
MOST_BINS = 2_000
# Bins of the whole run; wider bins are sums of these.
LEVEL_BINS = 8_192
MOST_LINKS = 20_000
# Different stacks of a flame graph, those with most samples.
MOST_STACKS = 5_000
_KEPT_BYTES = 32 * 2**20
_OF_SENTENCES = ["at", "what", "node", "subject", "sentence"]
_OF_CLOCKS = ("clocks_apart", "clocks_not_together")


class Pages:
    """Answers to what pages ask, each as bytes (see `table_encoding`).

    A pages object may be used by several threads, each with a connection of its own. Pages show the
    times of `window`; a window with more than MOST_BARS bars is sent in bins.
    """

    def __init__(self, window: Window = WHOLE) -> None:
        self._scratch = Scratch()
        self._window = window
        self._kept: OrderedDict[str, bytes] = OrderedDict()
        self._guard = threading.Lock()
        self.what_if = WhatIf()
        # What changed last, and in which times that was looked for: parts of a page ask together.
        self._course_guard = threading.Lock()
        self._course: tuple[Slice, Course] | None = None

    def close(self) -> None:
        """Free what is kept."""
        self._scratch.close()

    def answer(self, connection: duckdb.DuckDBPyConnection, name: str, params: Params) -> bytes:
        """Return what a page asks for."""
        key = json.dumps([name, params], sort_keys=True)
        with self._guard:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        content = self._find(name, Question(connection, params, self._window))
        with self._guard:
            self._kept[key] = content
            while sum(map(len, self._kept.values())) > _KEPT_BYTES and len(self._kept) > 1:
                self._kept.popitem(last=False)
        return content

    def _find(self, name: str, asked: Question) -> bytes:
        if name in _PLAIN:
            return _plain(name, asked)
        if name in _OF_PATH:
            self.fill_flows(asked)
            values: Params = {"run": asked.run.run_id} | asked.window_of_flows()
            table = self._scratch.ask(name, values | asked.own(name, values))
            return encode(table, units=_units(name))
        if name in ANSWERS:
            return ANSWERS[name](self, asked)
        raise UsageError(f"pages have no such data — {name}")

    def summary(self, asked: Question, name: str, through: str = "") -> summary.Section:
        """Return a section of the summary: 'why', 'paths', 'blame', 'drops' or 'threads'."""
        if name not in SUMMARY:
            raise UsageError(f"the summary has no such section — {name}")
        if name == "why":
            try:
                found = explain(asked.connection, asked.run, asked.slice)
            except NoFlowError:
                return summary.why_section(asked, None)
            with self._course_guard:
                self._course = asked.slice, found.course
            return summary.why_section(asked, found)
        if name != "blame":
            return summary.query_section(asked, name, through)
        paths = [row["path_id"] for row in asked.paths.to_pylist() if through in row["path"]]
        return summary.blame_section(asked, self.slowest_takes(asked, paths)[: summary.MOST_PATHS])

    def course(self, asked: Question) -> Course:
        """Return what changed, which an explanation of the same times has found, too."""
        with self._course_guard:
            if self._course is None or self._course[0] != asked.slice:
                course = read_course(asked.connection, asked.run, asked.slice)
                self._course = asked.slice, course
            return self._course[1]

    def slowest_flows(self, asked: Question) -> list[dict[str, Any]]:
        """Return the slowest flow of each path that began in the window, the slowest first."""
        self.fill_flows(asked)
        values = {"run": asked.run.run_id, "limit": 1} | asked.window_of_flows()
        flows: list[dict[str, Any]] = self._scratch.ask("path_slowest", values).to_pylist()
        return sorted(flows, key=lambda flow: (-flow["latency"], flow["path_id"]))

    def slowest_takes(self, asked: Question, paths: Collection[int]) -> list[tuple[str, str, int]]:
        """Return first topic, last topic and take of the slowest flow of each of these paths.

        Several may end with the same take: what is said of it once is enough.
        """
        topics = {row["path_id"]: row["topics"] for row in asked.paths.to_pylist()}
        takes: dict[int, tuple[str, str, int]] = {}
        for flow in self.slowest_flows(asked):
            names, take = topics.get(flow["path_id"]), flow["take_id"]
            if flow["path_id"] in paths and names and take is not None:
                takes.setdefault(take, (names[0], names[-1], take))
        return list(takes.values())

    def fill_flows(self, asked: Question) -> None:
        """Find the flows of all paths of a run, once."""
        self._scratch.fill("flow", asked.run.run_id, lambda: asked.rows("path_flow", self._window))

    def _segments(self, asked: Question) -> bytes:
        window = asked.window
        width = max(window.end_ns - window.start_ns, 1)
        bin_ns = -(-width // MOST_BINS)
        level_ns = asked.length_ns // LEVEL_BINS + 1
        # The number of bars decides alone, whatever the page asked for before.
        (count,) = asked.rows("segment_count")["count"].to_pylist()
        meta: dict[str, Any] = {"start": window.start_ns - asked.origin_ns, "count": count}
        meta["end"] = window.end_ns - asked.origin_ns
        if count <= MOST_BARS:
            table = asked.rows("segments")
        elif bin_ns < level_ns:
            meta["bin"] = bin_ns
            table = asked.rows("segments", bin_ns=bin_ns)
        else:
            meta["bin"] = -(-bin_ns // level_ns) * level_ns
            whole = Window(asked.origin_ns, asked.origin_ns + asked.length_ns + 1)
            # The bars of the whole run are counted once.
            self._scratch.fill(
                "level", asked.run.run_id, lambda: asked.rows("segments", whole, bin_ns=level_ns)
            )
            table = self._scratch.ask("level", asked.frame() | {"bin_ns": meta["bin"]})
        return encode(table, meta=meta, units=_units("segments"))

    def _summary(self, asked: Question) -> bytes:
        return summary.encoded_section(self.summary(asked, asked.text("part")), asked.origin_ns)


def named(asked: Question, name: str) -> tuple[QueryResult, bytes]:
    """Return the rows of a named query that pages show, also as bytes."""
    if name not in NAMED:
        raise UsageError(f"pages do not show such a query — {name}")
    header = load_query(name)
    part = asked.slice if header.has_window else Slice(asked.run.run_id)
    result = run_query(asked.connection, header, {}, part, internal=asked.is_internal)
    meta = {
        "title": header.title,
        "description": header.description,
        "command": _command(asked, name),
    }
    return result, encode_result(result, meta, asked.origin_ns)


def _plain(name: str, asked: Question) -> bytes:
    table = asked.rows(name, **asked.own(name, asked.frame()))
    meta = {"command": _command(asked, _LISTED_BY[name])} if name in _LISTED_BY else {}
    return encode(table, meta=meta, units=_units(name))


def _warm_up(_: Pages, asked: Question) -> bytes:
    skipped_ns = round(warm_up(asked.connection, asked.run) * 1e9)
    return encode(pa.table({"skipped": [skipped_ns]}), units={"skipped": "ns"})


def _area(_: Pages, asked: Question) -> bytes:
    try:
        of = json.loads(asked.text("of"))
    except (ValueError, RecursionError):
        of = None
    if not of or not isinstance(of, list) or not all(isinstance(one, str | int) for one in of):
        raise UsageError(f"sums are of a list of names or identities — {asked.params.get('of')}")
    return summary.encoded_section(
        summary.area_section(asked, asked.text("part"), of), asked.origin_ns
    )


def _finding(_: Pages, asked: Question) -> bytes:
    findings = [asdict(found) for found in read_findings(asked.connection, [asked.run.run_id])]
    texts = ("name", "severity", "title", "subject", "detail", "description", "cause", "cure")
    columns = {name: texts_to_arrow([found[name] for found in findings]) for name in texts}
    counts = integers_to_arrow([found["count"] for found in findings], pa.int64())
    table = pa.table({**columns, "count": counts})
    # A note does not repeat what a finding says.
    is_said = any(found["name"] in _OF_CLOCKS for found in findings)
    notes = [] if is_said else clock_notes(asked.connection, [asked.run])
    command = shell_joined(["msgflow", "check", "--run", asked.run.name])
    return encode(table, meta={"notes": notes, "command": command})


def _stack(_: Pages, asked: Question) -> bytes:
    parts: tuple[pa.Table, ...] = (_stacks(asked),)
    words = ["export", "folded", "-o", "robot.folded"]
    # Without samples there is nothing to look for.
    if "path" in asked.params and parts[0].num_rows:
        paths = {row["path_id"]: row["path"] for row in asked.paths.to_pylist()}
        number, slowest = asked.whole("path"), asked.whole("slowest")
        if number not in paths:
            raise UsageError(f"the run has no such path — {number}")
        parts = _stacks_of_path(asked, paths[number], slowest)
        number = sorted(paths.values()).index(paths[number]) + 1
        words = ["query", "functions", "--path", str(number), "--slowest", str(slowest)]
    shown = [part.slice(0, MOST_STACKS) for part in parts]
    table = pa.concat_tables(
        part.append_column("part", pa.array([at] * part.num_rows, pa.int64()))
        for at, part in enumerate(shown)
    )
    meta = {
        "left_out": sum(part.num_rows for part in parts) - table.num_rows,
        "command": shell_joined(["msgflow", *words, "--run", asked.run.name, *asked.options]),
    }
    return encode(table, meta=meta)


def _stacks(asked: Question, instances: Sequence[int] | None = None) -> pa.Table:
    """Return stacks of callback instances, else of the window; those with most samples first."""
    values = {"run_id": asked.run.run_id, "instances": instances, **asked.window.bindings}
    table = internal_sql().run(asked.connection, "folded_stack", values).to_arrow_table()
    return table.sort_by([("samples", "descending"), ("stack", "ascending")])


def _stacks_of_path(asked: Question, path: str, slowest: int) -> tuple[pa.Table, pa.Table]:
    """Return stacks on the way of so many slowest flows of a path, and of its other flows."""
    header = load_query("functions")
    chosen = bind(header, {"via": [path]})
    with Steps(asked.connection) as steps:
        steps.make(header, {"runs": [asked.run.run_id], **chosen, **asked.window.bindings})
        found = asked.connection.table("function_instance").fetchall()
    slow = [instance for instance, place in found if place <= slowest]
    others = [instance for instance, place in found if place > slowest]
    return _stacks(asked, slow), _stacks(asked, others)


def _compare(_: Pages, asked: Question) -> bytes:
    # Intervals take longest: the page first shows what was measured, then asks for them.
    is_quick = bool(asked.params.get("quick"))
    what = str(asked.params.get("what", "paths"))
    comparison = compare(
        asked.connection, str(asked.whole("other")), str(asked.run.run_id), what=what,
        resamples=0 if is_quick else None,
    )  # fmt: skip
    return summary.encoded_comparison(comparison, what, is_quick=is_quick)


def critical_path(asked: Question) -> bytes:
    """Return the pieces of the critical path as bytes, with the command that prints them.

    It belongs to the longest flow that ends where the picked one does, see critical_end.sql. It
    starts on the topic `from`, or without it on the topic of its first message.
    """
    picked: dict[str, Value] = {"kind": asked.kind, "id": asked.whole("id")}
    ends = run_page_query(asked.connection, "critical_end", picked).to_pylist()
    if not ends:
        return encode(pa.table({"at_ns": pa.array([], pa.int64())}))
    (end,) = ends
    first = str(asked.params.get("from") or end["from_topic"])
    chosen: dict[str, Value] = {
        "from": [first],
        "to": [end["to_topic"]],
        "take": end["take_id"],
        # Whatever was picked has a flow, also one that is not the first arrival of its root.
        "case": "every_pair",
        "detail": "full",
    }
    header = load_query("critical-path")
    result = run_query(asked.connection, header, chosen, Slice(asked.run.run_id))
    command = ["msgflow", "flow", "--take", str(end["take_id"]), "--why"]
    # The page shows the path itself.
    shown = replace(
        result,
        table=result.table.drop_columns(["path"]),
        header=replace(header, columns=tuple(c for c in header.columns if c.name != "path")),
    )
    meta = {
        "from": first,
        "to": end["to_topic"],
        "take_id": end["take_id"],
        "command": shell_joined([*command, "--from", first, "--detail", "full"]),
    }
    return encode_result(shown, meta, asked.origin_ns)


def _course(pages: Pages, asked: Question) -> bytes:
    course = pages.course(asked)
    meta = {
        "lines": escaped(course.lines.to_pylist()),
        "sentences": escaped(course.sentences.select(_OF_SENTENCES).to_pylist()),
        "command": _command(asked, "changes"),
    }
    return encode_result(course.changes, meta, asked.origin_ns)


def _links(_: Pages, asked: Question) -> bytes:
    table = asked.links(MOST_LINKS + 1)
    is_cut = table.num_rows > MOST_LINKS
    return encode(table.slice(0, MOST_LINKS), meta={"is_cut": is_cut}, units=_units("links"))


def _flow(_: Pages, asked: Question) -> bytes:
    values: Params = {"origin_ns": asked.origin_ns, "kind": asked.kind, "id": asked.whole("id")}
    return encode(run_page_query(asked.connection, "flow", values), units=_units("flow"))


def _runs(_: Pages, asked: Question) -> bytes:
    return encode(run_page_query(asked.connection, "run", {}), units=_units("run"))


ANSWERS: dict[str, Callable[[Pages, Question], bytes]] = {
    "run": _runs,
    "word": lambda _, asked: encode(words(asked.connection)),
    "example": lambda _, asked: encode(examples()),
    "query": lambda _, asked: named(asked, asked.text("name"))[1],
    "critical": lambda _, asked: critical_path(asked),
    "finding": _finding,
    "summary": Pages._summary,
    "area": _area,
    "stack": _stack,
    "compare": _compare,
    "segments": Pages._segments,
    "course": _course,
    "links": _links,
    "flow": _flow,
    "warm_up": _warm_up,
    "remedy": lambda pages, asked: pages.what_if.remedies(asked),
    "what_if": lambda pages, asked: pages.what_if.paths(asked),
    "what_if_part": lambda pages, asked: pages.what_if.parts(asked),
}
"""The answers that are no plain page query, by name."""

# Sections of the summary that need nothing but the run.
SUMMARY = ("why", "paths", "blame", "drops", "threads")
_PLAIN = (
    "row", "gap", "path", "executor_share", "executor_node", "neighbour", "rate", "callback",
    "callback_point", "callback_slowest", "topic_point", "topic_slowest", "service_point",
    "service_slowest", "loss", "loss_point", "thread_name", "place", "run_before", "program_share",
    "mark", "counter",
)  # fmt: skip
# Named queries that list one by one what a page query counts.
_LISTED_BY = {"loss": "topics-unmatched"}
_OF_PATH = ("path_histogram", "path_share", "path_point", "path_slowest")


def _units(name: str) -> dict[str, str]:
    return {column.name: column.unit for column in page_query(name).columns if column.unit}


def _command(asked: Question, name: str) -> str:
    """Return the command that prints the rows of a named query, as the page shows them."""
    header = load_query(name)
    options = asked.options if header.has_window else ()
    words = [*header.command.split(), "--run", asked.run.name, *options]
    return shell_joined(words + ["--internal"] * asked.is_internal)
