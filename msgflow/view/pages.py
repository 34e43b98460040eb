"""Data of the pages, read from a database: by the server on request, by a report in advance."""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.db.finding import read_findings
from msgflow.errors import UsageError
from msgflow.query.catalogue import load_query
from msgflow.query.clock_notes import clock_notes
from msgflow.query.compare import compare, warm_up
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow.run.window import WHOLE, Window
from msgflow.text.shell import shell_joined
from msgflow.view.critical_path import critical_path
from msgflow.view.encoded import encoded_comparison, encoded_result, encoded_section
from msgflow.view.page_query import Scratch, page_query, run_page_query
from msgflow.view.sql_page import examples, words
from msgflow.view.stacks import stacks, stacks_of_path
from msgflow.view.summary import (
    MOST_PATHS,
    Part,
    Section,
    area_section,
    blame_section,
    query_section,
    why_section,
)
from msgflow.view.table_encoding import encode

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import duckdb

    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run
    from msgflow.sql.header import Param

Params = dict[str, Any]

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
_OF_CLOCKS = ("clocks_apart", "clocks_not_together")
_KINDS = ("publication", "take", "callback_instance", "request", "response")
_LARGEST = 2**62


@dataclass(frozen=True)
class Extent:
    """A run on the page: times are offsets from `origin_ns`."""

    run: Run
    origin_ns: int  # its first event, epoch ns
    length_ns: int  # from there to its last event

    def frame(self, window: Window) -> Params:
        """Return the parameters that most page queries need."""
        return {"run": self.run.run_id, "origin_ns": self.origin_ns, **window.bindings}


class Pages:
    """Answers to what pages ask, each as bytes (see `table_encoding`).

    A pages object may be used by several threads, each with a connection of its own. Pages show the
    times of `window`; a window with more bars than `most_bars` is sent in bins.
    """

    def __init__(self, window: Window = WHOLE, *, most_bars: int = MOST_BARS) -> None:
        self._scratch = Scratch()
        self._window = window
        self._most_bars = most_bars
        self._kept: OrderedDict[str, bytes] = OrderedDict()
        self._guard = threading.Lock()

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
        content = self._find(connection, name, params)
        with self._guard:
            self._kept[key] = content
            while sum(map(len, self._kept.values())) > _KEPT_BYTES and len(self._kept) > 1:
                self._kept.popitem(last=False)
        return content

    def _find(self, connection: duckdb.DuckDBPyConnection, name: str, params: Params) -> bytes:
        if name in _PLAIN:
            return self._plain(connection, name, params)
        if name in _OF_PATH:
            return self._of_path(connection, name, params)
        if name in ANSWERS:
            return ANSWERS[name](self, connection, params)
        raise UsageError(f"pages have no such data — {name}")

    def extent(self, connection: duckdb.DuckDBPyConnection, params: Params) -> Extent:
        """Return the run that the page is about."""
        run = Slice(params.get("run")).one_run(connection, "a page")
        if run.start_ns is None or run.end_ns is None:
            return Extent(run, 0, 0)
        return Extent(run, run.start_ns, max(run.end_ns - run.start_ns, 0))

    def window(self, extent: Extent, params: Params) -> Window:
        """Return the window that the page asks for, within the times that pages show."""
        start = _whole(params, "start", 0)
        end = _whole(params, "end", extent.length_ns + 1)
        return Window(
            max(extent.origin_ns + start, self._window.start_ns),
            min(extent.origin_ns + end, self._window.end_ns),
        )

    def _slice(self, extent: Extent, params: Params) -> Slice:
        """Return the run, and the window that the page asks for; the whole run has no window."""
        window = self.window(extent, params)
        # Only those ends that were given: a command then has no other ones.
        is_begun = "start" in params or self._window.start_ns != WHOLE.start_ns
        is_ended = "end" in params or self._window.end_ns != WHOLE.end_ns
        return Slice(
            extent.run.run_id,
            window.start_ns if is_begun else None,
            window.end_ns if is_ended else None,
        )

    def part(self, extent: Extent, params: Params) -> Part:
        """Return the run and the window that the page asks for."""
        part = self._slice(extent, params)
        return Part(part, _window_options(extent, part))

    def named(
        self, connection: duckdb.DuckDBPyConnection, name: str, params: Params
    ) -> tuple[QueryResult, bytes]:
        """Return the rows of a named query that pages show, also as bytes."""
        if name not in NAMED:
            raise UsageError(f"pages do not show such a query — {name}")
        header = load_query(name)
        extent = self.extent(connection, params)
        internal = _is_internal(params)
        part = self._slice(extent, params) if header.has_window else Slice(extent.run.run_id)
        result = run_query(connection, header, {}, part, internal=internal)
        meta = {
            "title": header.title,
            "description": header.description,
            "command": _command(name, extent, part, internal=internal),
        }
        return result, encoded_result(result, meta, extent.origin_ns)

    def _warm_up(self, connection: duckdb.DuckDBPyConnection, params: Params) -> bytes:
        extent = self.extent(connection, params)
        skipped_ns = round(warm_up(connection, extent.run) * 1e9)
        return encode(pa.table({"skipped": [skipped_ns]}), units={"skipped": "ns"})

    def summary(
        self,
        connection: duckdb.DuckDBPyConnection,
        extent: Extent,
        name: str,
        through: str = "",
        params: Params | None = None,
    ) -> Section:
        """Return a section of the summary: 'why', 'paths', 'blame', 'drops' or 'threads'."""
        if name not in SUMMARY:
            raise UsageError(f"the summary has no such section — {name}")
        part = self.part(extent, params or {})
        if name == "why":
            return why_section(connection, extent.run, part)
        if name != "blame":
            return query_section(connection, extent.run, part, name, through)
        self.fill_flows(connection, extent)
        values = _window_of_flows(params or {})
        flows = self.ask("path_slowest", {"run": extent.run.run_id, "limit": 1} | values)
        rows = run_page_query(connection, "path", {"run": extent.run.run_id}).to_pylist()
        topics = {row["path_id"]: row["topics"] for row in rows if through in row["path"]}
        order = [("latency", "descending"), ("path_id", "ascending")]
        # Several paths may end with the same take: what is said of it once is enough.
        chosen = {
            flow["take_id"]: (names[0], names[-1], flow["take_id"])
            for flow in reversed(flows.sort_by(order).to_pylist())
            if (names := topics.get(flow["path_id"])) and flow["take_id"] is not None
        }
        slowest = list(reversed(chosen.values()))[:MOST_PATHS]
        return blame_section(connection, extent.run, part, slowest)

    def _summary(self, connection: duckdb.DuckDBPyConnection, params: Params) -> bytes:
        extent = self.extent(connection, params)
        section = self.summary(connection, extent, str(params.get("part")), params=params)
        return encoded_section(section, extent.origin_ns)

    def _area(self, connection: duckdb.DuckDBPyConnection, params: Params) -> bytes:
        extent = self.extent(connection, params)
        try:
            of = json.loads(str(params.get("of")))
        except (ValueError, RecursionError):
            of = None
        if not of or not isinstance(of, list) or not all(isinstance(one, str | int) for one in of):
            raise UsageError(f"sums are of a list of names or identities — {params.get('of')}")
        part = self.part(extent, params)
        section = area_section(connection, extent.run, part, str(params.get("part")), of)
        return encoded_section(section, extent.origin_ns)

    def _critical(self, connection: duckdb.DuckDBPyConnection, params: Params) -> bytes:
        extent = self.extent(connection, params)
        chosen = None if params.get("from") is None else str(params["from"])
        kind, number = _kind(params), _whole(params, "id")
        return critical_path(connection, extent.run, extent.origin_ns, kind, number, chosen)

    def _finding(self, connection: duckdb.DuckDBPyConnection, params: Params) -> bytes:
        extent = self.extent(connection, params)
        listed = read_findings(connection, [extent.run.run_id])
        findings = [asdict(found) for found in listed]
        fields = ("name", "severity", "title", "subject", "count", "detail", "description",
                  "cause", "cure")  # fmt: skip
        table = pa.table({field: [found[field] for found in findings] for field in fields})
        # A note does not repeat what a finding says.
        is_said = any(found["name"] in _OF_CLOCKS for found in findings)
        notes = [] if is_said else clock_notes(connection, [extent.run])
        command = shell_joined(["msgflow", "check", "--run", extent.run.name])
        return encode(table, meta={"notes": notes, "command": command})

    def _stack(self, connection: duckdb.DuckDBPyConnection, params: Params) -> bytes:
        extent = self.extent(connection, params)
        run, window = extent.run, self.window(extent, params)
        parts: tuple[pa.Table, ...] = (stacks(connection, run, window),)
        words = ["export", "folded", "-o", "robot.folded"]
        # Without samples there is nothing to look for.
        if "path" in params and parts[0].num_rows:
            listed = run_page_query(connection, "path", {"run": run.run_id}).to_pylist()
            paths = {row["path_id"]: row["path"] for row in listed}
            number, slowest = _whole(params, "path"), _whole(params, "slowest")
            if number not in paths:
                raise UsageError(f"the run has no such path — {number}")
            parts = stacks_of_path(connection, run, window, paths[number], slowest)
            number = sorted(set(paths.values())).index(paths[number]) + 1
            words = ["query", "functions", "--path", str(number), "--slowest", str(slowest)]
        shown = [part.slice(0, MOST_STACKS) for part in parts]
        table = pa.concat_tables(
            part.append_column("part", pa.array([at] * part.num_rows, pa.int64()))
            for at, part in enumerate(shown)
        )
        options = _window_options(extent, self._slice(extent, params))
        meta = {
            "left_out": sum(part.num_rows for part in parts) - table.num_rows,
            "command": shell_joined(["msgflow", *words, "--run", run.name, *options]),
        }
        return encode(table, meta=meta)

    def _compare(self, connection: duckdb.DuckDBPyConnection, params: Params) -> bytes:
        extent = self.extent(connection, params)
        # Intervals take longest: the page first shows what was measured, then asks for them.
        is_quick = bool(params.get("quick"))
        what = str(params.get("what", "paths"))
        comparison = compare(
            connection, str(_whole(params, "other")), str(extent.run.run_id), run=None, window=(),
            what=what, resamples=0 if is_quick else None,
        )  # fmt: skip
        return encoded_comparison(comparison, what, is_quick=is_quick)

    def links(self, connection: duckdb.DuckDBPyConnection, values: Params, limit: int) -> pa.Table:
        """Return the arrows of a window, at most `limit`; its values are those of `frame`."""
        (ids,) = run_page_query(connection, "window_ids", values).to_pylist()
        return run_page_query(connection, "links", values | ids | {"limit": limit})

    def _segments(self, connection: duckdb.DuckDBPyConnection, params: Params) -> bytes:
        extent = self.extent(connection, params)
        window = self.window(extent, params)
        width = max(window.end_ns - window.start_ns, 1)
        bin_ns = -(-width // MOST_BINS)
        level_ns = extent.length_ns // LEVEL_BINS + 1
        values = extent.frame(window)
        # The number of bars decides alone, whatever the page asked for before.
        (count,) = run_page_query(connection, "segment_count", values)["count"].to_pylist()
        meta: dict[str, Any] = {"start": window.start_ns - extent.origin_ns, "count": count}
        meta["end"] = window.end_ns - extent.origin_ns
        if count <= self._most_bars:
            table = run_page_query(connection, "segments", values)
        elif bin_ns < level_ns:
            meta["bin"] = bin_ns
            table = run_page_query(connection, "segments", values | {"bin_ns": bin_ns})
        else:
            meta["bin"] = -(-bin_ns // level_ns) * level_ns
            self.fill_level(connection, extent)
            table = self._scratch.ask("level", values | {"bin_ns": meta["bin"]})
        return encode(table, meta=meta, units=_units("segments"))

    def fill_level(self, connection: duckdb.DuckDBPyConnection, extent: Extent) -> None:
        """Count the bars of the whole run in bins, once."""
        level_ns = extent.length_ns // LEVEL_BINS + 1
        whole = Window(extent.origin_ns, extent.origin_ns + extent.length_ns + 1)
        self._scratch.fill(
            "level",
            extent.run.run_id,
            lambda: run_page_query(
                connection,
                "segments",
                extent.frame(whole) | {"bin_ns": level_ns},
            ),
        )

    def _links(self, connection: duckdb.DuckDBPyConnection, params: Params) -> bytes:
        extent = self.extent(connection, params)
        values = extent.frame(self.window(extent, params))
        table = self.links(connection, values, MOST_LINKS + 1)
        is_cut = table.num_rows > MOST_LINKS
        return encode(table.slice(0, MOST_LINKS), meta={"is_cut": is_cut}, units=_units("links"))

    def _flow(self, connection: duckdb.DuckDBPyConnection, params: Params) -> bytes:
        extent = self.extent(connection, params)
        values: Params = {
            "origin_ns": extent.origin_ns,
            "kind": _kind(params),
            "id": _whole(params, "id"),
        }
        table = run_page_query(connection, "flow", values)
        return encode(table, units=_units("flow"))

    def fill_flows(self, connection: duckdb.DuckDBPyConnection, extent: Extent) -> None:
        """Find the flows of all paths of a run, once."""
        values = extent.frame(self._window)
        self._scratch.fill(
            "flow", extent.run.run_id, lambda: run_page_query(connection, "path_flow", values)
        )

    def ask(self, name: str, values: Params) -> pa.Table:
        """Return the rows of a page query over the tables in memory."""
        return self._scratch.ask(name, values)

    def _plain(self, connection: duckdb.DuckDBPyConnection, name: str, params: Params) -> bytes:
        extent = self.extent(connection, params)
        values = extent.frame(self.window(extent, params))
        table = run_page_query(connection, name, values | _own(name, params, values))
        meta = {}
        if name in _LISTED_BY:
            part, internal = self._slice(extent, params), _is_internal(params)
            meta["command"] = _command(_LISTED_BY[name], extent, part, internal=internal)
        return encode(table, meta=meta, units=_units(name))

    def _of_path(self, connection: duckdb.DuckDBPyConnection, name: str, params: Params) -> bytes:
        extent = self.extent(connection, params)
        self.fill_flows(connection, extent)
        values: Params = {"run": extent.run.run_id} | _window_of_flows(params)
        table = self._scratch.ask(name, values | _own(name, params, values))
        return encode(table, units=_units(name))


ANSWERS: dict[str, Callable[[Pages, duckdb.DuckDBPyConnection, Params], bytes]] = {
    "run": lambda _, connection, params: encode(
        run_page_query(connection, "run", {}), units=_units("run")
    ),
    "word": lambda _, connection, params: encode(words(connection)),
    "example": lambda _, connection, params: encode(examples()),
    "query": lambda pages, connection, params: pages.named(
        connection, str(params.get("name")), params
    )[1],
    "finding": Pages._finding,
    "summary": Pages._summary,
    "area": Pages._area,
    "stack": Pages._stack,
    "compare": Pages._compare,
    "segments": Pages._segments,
    "links": Pages._links,
    "flow": Pages._flow,
    "critical": Pages._critical,
    "warm_up": Pages._warm_up,
}
"""The answers that are no plain page query, by name."""

# Sections of the summary that need nothing but the run.
SUMMARY = ("why", "paths", "blame", "drops", "threads")
_PLAIN = (
    "row", "gap", "path", "executor_share", "executor_node", "neighbour", "rate", "callback",
    "callback_point", "callback_slowest", "topic_point", "topic_slowest", "service_point",
    "service_slowest", "loss", "loss_point", "thread_name", "place", "run_before",
)  # fmt: skip
# Named queries that list one by one what a page query counts.
_LISTED_BY = {"loss": "topics-unmatched"}
_OF_PATH = ("path_histogram", "path_share", "path_point", "path_slowest")


def _units(name: str) -> dict[str, str]:
    return {column.name: column.unit for column in page_query(name).columns if column.unit}


def _window_of_flows(params: Params) -> Params:
    """Return the window of page queries on flows: of their roots, None where it is open."""
    names = {"start": "begin_at", "end": "end_at"}
    return {name: _whole(params, end) if end in params else None for end, name in names.items()}


def _is_internal(params: Params) -> bool:
    return str(params.get("internal", "")) not in ("", "0", "False")


def _command(name: str, extent: Extent, part: Slice, *, internal: bool) -> str:
    """Return the command that prints the rows of a named query, as the page shows them."""
    words = [*load_query(name).command.split(), "--run", extent.run.name]
    return shell_joined(words + _window_options(extent, part) + ["--internal"] * internal)


def _window_options(extent: Extent, part: Slice) -> list[str]:
    """Return the options that choose the window of a slice, as offsets in seconds."""
    options = []
    for option, time_ns in {"--start": part.start, "--end": part.end}.items():
        if time_ns is not None:
            whole, rest = divmod(max(int(time_ns) - extent.origin_ns, 0), 1_000_000_000)
            options += [option, f"{whole}.{rest:09d}".rstrip("0").rstrip(".") + "s"]
    return options


def _kind(params: Params) -> str:
    kind = params.get("kind")
    if kind not in _KINDS:
        raise UsageError(f"a flow begins with one of {', '.join(_KINDS)} — {kind}")
    return str(kind)


def _own(name: str, params: Params, given: Mapping[str, Any]) -> Params:
    # Parameters of the query that the page gives, besides those of `frame`.
    own: Params = {}
    for param in page_query(name).params:
        if param.name in params and param.name not in given:
            own[param.name] = _value(param, params)
    return own


def _value(param: Param, params: Params) -> int | str:
    if param.type != "BIGINT":
        return str(params[param.name])
    number = _whole(params, param.name)
    least, most = param.minimum, param.maximum
    if (least is not None and number < least) or (most is not None and number > most):
        raise UsageError(f"{param.name} is from {least} to {most} — {number}")
    return number


def _whole(params: Params, name: str, default: int | None = None) -> int:
    value = params.get(name, default)
    try:
        number = int(value) if value is not None else None
    except (TypeError, ValueError):
        number = None
    if number is None or abs(number) > _LARGEST:
        raise UsageError(f"{name} is a whole number — {value}")
    return number
