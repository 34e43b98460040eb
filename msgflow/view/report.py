"""The report (`msgflow report`): all pages in one file with their data, or the summary alone.

What does not fit is left out by rules that the pages state: first single bars of the timeline, kept
around the slowest flows of each path, with the whole run in bins beside them.
"""

from __future__ import annotations

import gzip
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
from pyarrow import compute

from msgflow.db.finding import read_findings
from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.query.compare import Comparison
from msgflow.query.compare import compare as compare_runs
from msgflow.result.query_result import QueryResult
from msgflow.run.choice import Run
from msgflow.run.slice import Slice
from msgflow.run.window import WHOLE, Window
from msgflow.text.values import format_duration
from msgflow.verify.verify import Verification
from msgflow.view.assets import single_page
from msgflow.view.page_query import Question, run_page_query
from msgflow.view.pages import LEVEL_BINS, NAMED, SUMMARY, Pages, named
from msgflow.view.summary import (
    Section,
    change_section,
    encoded_comparison,
    encoded_section,
    markdown,
    verdict_section,
)
from msgflow.view.table_encoding import encode

MARKDOWN = ".md"
# Pictures of at most so many paths: of those with the slowest flows.
MOST_PATHS = 200
# Panels of at most so many callbacks, topics and clients.
MOST_PANELS = 200
# A named query whose rows open panels, the column that tells them apart, the parameter of it in
# page queries, and these.
_PANELS = (
    ("callbacks", "callback_id", "callback", ("callback_point", "callback_slowest")),
    ("topics-summary", "topic_name", "topic", ("topic_point", "topic_slowest")),
    ("service-latency", "client_id", "client", ("service_point", "service_slowest")),
)
# The report has the critical paths of so many flows, the slowest ones.
MOST_CRITICAL = 6
# Estimate: bytes of a bar with its links in the file, compressed.
_BYTES_PER_BAR = 16
_LEVEL_SHARE = 0.25
_STRETCHES = 12


@dataclass(frozen=True)
class Report:
    """A report that was written.

    Attributes:
        path: the file.
        size: bytes of it.
        run: what it is about.
        notes: what it leaves out, a sentence each.
    """

    path: Path
    size: int
    run: Run
    notes: tuple[str, ...] = ()


def write_report(
    connection: duckdb.DuckDBPyConnection,
    path: Path,
    part: Slice,
    *,
    compare: str | int | None = None,
    verification: Verification | None = None,
    through: str | None = None,
    max_size: int,
) -> Report:
    """Write the pages of a run into one file that any browser opens, or its summary as Markdown."""
    one = part.one_run(connection, "a report")
    window = part.window([one])
    asked = Question(connection, {"run": one.run_id}, window)
    other = None if compare is None else Slice(compare).one_run(connection, "the other side")
    if other is not None and other.run_id == one.run_id:
        raise UsageError("a run is not compared with itself", "give another --compare")
    maker = _Maker(asked, Pages(window), other, verification, through, max_size)
    try:
        content = maker.markdown() if path.suffix.lower() == MARKDOWN else maker.pages_in_one()
    finally:
        maker.pages.close()
    written = content.encode()
    if len(written) > max_size:
        raise UsageError(
            f"the report takes {len(written):,} bytes, more than {max_size:,}",
            "give a larger --max-size, or cut the report with --start, --end or --through",
        )
    with replacing(path) as temporary:
        temporary.write_bytes(written)
    return Report(path, len(written), one, tuple(maker.notes))


@dataclass
class _Maker:
    """Makes a report: it keeps the answers to what its pages will ask, each under its question."""

    asked: Question
    pages: Pages
    other: Run | None  # which it is compared with
    verification: Verification | None
    through: str | None
    max_size: int
    notes: list[str] = field(default_factory=list)
    parts: dict[str, bytes] = field(default_factory=dict)
    named: dict[str, QueryResult] = field(default_factory=dict)

    def answer(self, name: str, /, **params: Any) -> bytes:
        return self.pages.answer(self.asked.connection, name, self.asked.params | params)

    @cached_property
    def comparison(self) -> Comparison | None:
        if self.other is None:
            return None
        return compare_runs(
            self.asked.connection, str(self.other.run_id), str(self.asked.run.run_id)
        )

    def keep(self, name: str, /, of: Run | None = None, **params: Any) -> None:
        """Keep an answer, of the other run if one is given."""
        known = "&".join(sorted(f"{key}={value}" for key, value in params.items()))
        place, run = ("", {}) if of is None else (f"@{of.run_id}", {"run": of.run_id})
        self.parts[f"{name}?{known}{place}"] = self.answer(name, **params, **run)

    def pages_in_one(self) -> str:
        self.look_at_window()
        runs = [self.asked.run] if self.other is None else [self.other, self.asked.run]
        rows = (run_page_query(self.asked.connection, "run", {"run": one.run_id}) for one in runs)
        self.parts["run"] = encode(pa.concat_tables(rows))
        self.keep("finding")
        for name in NAMED:
            self.named[name], content = named(self.asked, name)
            self.parts[f"query?name={name}"] = content
        for name in (
            "row", "gap", "path", "executor_node", "executor_share", "callback", "loss",
            "loss_point", "thread_name", "program_share", "mark", "counter",
        ):  # fmt: skip
            self.keep(name)
        self.keep("counter", rates=1)
        self.keep_panels()
        chosen = self.keep_paths()
        if self.other is not None and self.comparison is not None:
            self.keep_comparison(self.other, self.comparison, chosen)
        sections = self.sections()
        self.keep("course")
        for section in sections:
            content = encoded_section(section, self.asked.origin_ns)
            self.parts[f"summary?part={section.name}"] = content
        names = [section.name for section in sections]
        said = {"summary": names, "absent": self.empty_pages()}
        head = self.keep_timeline(chosen, said)
        return single_page(self.parts, head)

    def markdown(self) -> str:
        self.look_at_window()
        run = self.asked.run
        if self.through is not None:
            self.paths_through(self.asked.paths)
            self.notes.append(f"Its slowest paths are those with {self.through} (--through).")
        (row,) = run_page_query(self.asked.connection, "run", {"run": run.run_id}).to_pylist()
        facts = [
            format_duration(row["length"]),
            f"{row['event_count']:,} events",
            f"{row['host_count']} {'host' if row['host_count'] == 1 else 'hosts'}",
            f"msgflow {row['msgflow_version']}",
        ]
        findings = read_findings(self.asked.connection, [run.run_id])
        sections = self.sections()
        picture = list(self.pages.course(self.asked).picture())
        return markdown(run, facts, self.notes, picture, findings, sections)

    def look_at_window(self) -> None:
        """Raise if nothing is in the window; note that it is not the whole run."""
        origin_ns, length_ns = self.asked.origin_ns, self.asked.length_ns
        window = self.asked.window
        if length_ns and window.start_ns >= window.end_ns:
            raise UsageError(
                "nothing was recorded in the time window",
                f"the run lasts {length_ns / 1e9:.3f} s: --start 0s",
            )
        if self.asked.shown != WHOLE:
            self.notes.append(
                f"Only {(window.start_ns - origin_ns) / 1e9:.3f} s to"
                f" {(window.end_ns - origin_ns) / 1e9:.3f} s of the run are in this report"
                " (--start, --end)."
            )

    def sections(self) -> list[Section]:
        through = self.through or ""
        sections = [self.pages.summary(self.asked, part, through) for part in SUMMARY]
        if self.comparison is not None:
            sections.insert(0, change_section(self.comparison))
        if self.verification is not None:
            sections.insert(0, verdict_section(self.verification, self.asked.options))
        return sections

    def empty_pages(self) -> list[str]:
        """Return the pages that would show nothing."""
        empty = [] if self.asked.paths.num_rows else ["paths"]
        empty += [] if self.asked.rows("row").num_rows else ["graph", "timeline"]
        named = {"nodes": "info-nodes", "topics": "topics-summary"}
        empty += [page for page, name in named.items() if not len(self.named[name])]
        return [*empty, *([] if self.other else ["compare"])]

    def keep_panels(self) -> None:
        """Keep what callbacks, topics and services did over time: of the first ones of each."""
        for query, column, key, names in _PANELS:
            for value in dict.fromkeys(
                self.named[query].to_arrow()[column].to_pylist()[:MOST_PANELS]
            ):
                given = {} if value is None else {key: value}
                for name in names:
                    self.keep(name, **given)

    def keep_paths(self) -> list[int]:
        """Keep the pictures of paths; return the numbers of those kept."""
        rows = self.asked.paths
        numbers = self.paths_through(rows)
        if self.through is not None:
            self.notes.append(
                f"Pictures of {len(numbers)} of {rows.num_rows} paths are in this report, and the"
                f" timeline has the rows on these: those with {self.through} (--through)."
            )
        if len(numbers) > MOST_PATHS:
            self.notes.append(
                f"Pictures of {MOST_PATHS} of {len(numbers)} paths are in this report: those"
                " with the slowest flows. The table has all of them."
            )
            slowest = [flow["path_id"] for flow in self.pages.slowest_flows(self.asked)]
            ranks = {number: rank for rank, number in enumerate(slowest)}
            numbers = sorted(numbers, key=lambda n: ranks.get(n, len(ranks)))[:MOST_PATHS]
        for number in numbers:
            for name in ("path_histogram", "path_share", "path_point", "path_slowest"):
                self.keep(name, path=number)
        self.keep("path_slowest", limit=1)
        # Critical paths of few flows, as each takes a query.
        slowest_takes = self.pages.slowest_takes(self.asked, numbers)[:MOST_CRITICAL]
        for topic, _, take in slowest_takes:
            content = self.answer("critical", kind="take", id=take, **{"from": topic})
            self.parts[f"critical?id={take}&kind=take"] = content
        return numbers

    def paths_through(self, paths: pa.Table) -> list[int]:
        numbers: list[int] = paths["path_id"].to_pylist()
        if self.through is None:
            return numbers
        texts = paths["path"].to_pylist()
        numbers = [n for n, text in zip(numbers, texts, strict=True) if self.through in text]
        if not numbers:
            raise UsageError(f"no path has this text — {self.through}", "msgflow query e2e-latency")
        return numbers

    def keep_comparison(self, other: Run, comparison: Comparison, chosen: list[int]) -> None:
        content = encoded_comparison(comparison, "paths")
        self.parts[f"compare?other={other.run_id}&what=paths"] = content
        for what in ("callbacks", "topics"):
            self.keep("compare", other=other.run_id, what=what)
        for name in ("path", "row"):
            self.keep(name, other)
        rows = Question(self.asked.connection, {"run": other.run_id}).paths
        for number in rows["path_id"].to_pylist()[:MOST_PATHS]:
            self.keep("path_share", other, path=number)
        # The page of the comparison shows the distributions of both runs for any path.
        for number in self.asked.paths["path_id"].to_pylist()[:MOST_PATHS]:
            if number not in chosen:
                self.keep("path_share", path=number)

    def keep_timeline(self, paths: list[int], said: dict[str, Any]) -> dict[str, Any]:
        """Keep bars, arrows and links; return the head, which says that beside what is `said`."""
        origin, window = self.asked.origin_ns, self.asked.window
        head: dict[str, Any] = said | {
            "start": window.start_ns - origin,
            "end": window.end_ns - origin,
            "stretches": [],
            "count": 0,
        }
        rows = self.rows_on(paths) if self.through is not None else None
        (count,) = self.asked.rows("segment_count", window)["count"].to_pylist()
        head["count"] = count
        used = len(single_page(self.parts, head | {"notes": self.notes}).encode())
        room = self.max_size - used
        if room < 0:
            raise UsageError(
                f"the pages alone take {used:,} bytes, without the timeline",
                "give a larger --max-size, or cut the report with --start, --end or --through",
            )
        if count * _BYTES_PER_BAR <= room or rows is not None:
            self.keep_stretch(0, window, rows)
            self.parts["edge?"] = encode(self.asked.rows("edge", window))
            head["stretches"] = [{"start": head["start"], "end": head["end"], "whole": True}]
        else:
            self.keep_thinned(head, window, room, count)
        head["notes"] = self.notes
        return head

    def keep_stretch(self, place: int, window: Window, rows: list[int] | None) -> int:
        table = self.asked.rows("segments", window)
        links = self.asked.links(2**40, window)
        if rows is not None:
            known = pa.array(rows, pa.int64())
            table = table.filter(compute.is_in(table["row_key"], known))
            links = links.filter(
                compute.and_(
                    compute.is_in(links["from_row"], known), compute.is_in(links["to_row"], known)
                )
            )
        slim = table.select(["row_key", "kind", "id", "start_at", "length", "flags"])
        self.parts[f"detail?place={place}"] = encode(slim)
        self.parts[f"links?place={place}"] = encode(links)
        return int(table.num_rows)

    def rows_on(self, paths: list[int]) -> list[int]:
        """Return the rows of the timeline on some paths: objects, timers, events, executors."""
        chosen = self.asked.paths
        chosen = chosen.filter(compute.is_in(chosen["path_id"], pa.array(paths, pa.int64())))
        publishers = {one for several in chosen["publishers"].to_pylist() for one in several}
        subscriptions = {one for several in chosen["subscriptions"].to_pylist() for one in several}
        keys = {8 * one + 4 for one in publishers} | {8 * one + 1 for one in subscriptions}
        rows = self.asked.rows("row").to_pylist()
        nodes = {(row["process_id"], row["node"]) for row in rows if row["row_key"] in keys}
        processes = {process for process, _ in nodes}
        return [
            row["row_key"]
            for row in rows
            if row["row_key"] in keys
            or (
                row["kind"] in ("timer", "event", "state")
                and (row["process_id"], row["node"]) in nodes
            )
            or (row["kind"] in ("thread", "schedule") and row["process_id"] in processes)
            or row["kind"] == "core"
        ]

    def keep_thinned(self, head: dict[str, Any], window: Window, room: int, count: int) -> None:
        """Keep the run in bins, and single bars around the slowest flows."""
        origin = self.asked.origin_ns
        bins = LEVEL_BINS
        while True:
            bin_ns = (window.end_ns - window.start_ns) // bins + 1
            table = self.asked.rows("segments", window, bin_ns=bin_ns)
            level = encode(table, units={})
            size = len(gzip.compress(level, compresslevel=1)) * 4 // 3
            if size <= room * _LEVEL_SHARE or bins <= 256:
                break
            bins //= 2
        self.parts["level?"] = level
        head["bin"] = bin_ns
        room -= size
        each = window.end_ns - window.start_ns
        share = max(room, 0) / (count * _BYTES_PER_BAR)
        # When the slowest flow of each path began, the slowest first.
        begins = [flow["root_at"] for flow in self.pages.slowest_flows(self.asked)]
        middles = begins[:_STRETCHES] or [window.start_ns - origin + each // 2]
        length = max(int(each * share / len(middles)), 1)
        stretches: list[Window] = []
        for middle in sorted(middles):
            low = max(middle + origin - length // 4, window.start_ns)
            high = min(low + length, window.end_ns)
            if stretches and low <= stretches[-1].end_ns:
                last = stretches[-1]
                stretches[-1] = Window(last.start_ns, max(high, last.end_ns))
            else:
                stretches.append(Window(low, high))
        held = sum(
            self.keep_stretch(place, stretch, None) for place, stretch in enumerate(stretches)
        )
        edges = pa.concat_tables(self.asked.rows("edge", stretch) for stretch in stretches)
        distinct = edges.group_by(edges.column_names).aggregate([])
        order = [
            (name, "ascending")
            for name in ("from_kind", "to_kind", "from_id", "to_id", "link_kind")
        ]
        self.parts["edge?"] = encode(distinct.sort_by(order))
        head["stretches"] = [
            {"start": stretch.start_ns - origin, "end": stretch.end_ns - origin}
            for stretch in stretches
        ]
        self.notes.append(
            f"The timeline of {count:,} bars does not fit into {self.max_size:,} bytes: single bars"
            f" and flows are here for {len(stretches)}"
            f" {'stretch' if len(stretches) == 1 else 'stretches'} around the slowest flows"
            f" ({held:,} bars), the rest in bins of {bin_ns / 1e6:.3f} ms. A larger --max-size, or"
            " --start and --end, keep more; msgflow ui has everything."
        )
