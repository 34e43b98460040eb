"""The summary of a run: what somebody reads who opens only that.

Each section is the answer of a command, cut to its first rows, so that the page, the Markdown for a
pull request or an issue, and the command line have the same numbers.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import NamedTuple

import pyarrow as pa

from msgflow.db.finding import Finding
from msgflow.errors import UsageError
from msgflow.files.default_files import DEFAULT_PATHS
from msgflow.query.catalogue import load_query
from msgflow.query.compare import Comparison
from msgflow.query.runner import run_query
from msgflow.query.selection import Selection
from msgflow.query.why import MOST_CULPRITS, Explanation
from msgflow.result.query_result import QueryResult
from msgflow.result.rows import cells
from msgflow.run.choice import Run
from msgflow.sql.quoting import literal
from msgflow.sql.value import Value
from msgflow.text.markdown import code, code_lines, markdown_line, rule_line
from msgflow.text.shell import shell_joined
from msgflow.text.values import format_cell
from msgflow.trace.numpy_arrow import integers_to_arrow, texts_to_arrow
from msgflow.verify.verify import Verification
from msgflow.view.page_query import Question
from msgflow.view.table_encoding import encode_result

# The slowest paths whose latency is taken apart.
MOST_PATHS = 3
_MOST_ROWS = 5
# Places of each kind of finding in Markdown; `msgflow check` lists all of them.
_MOST_PLACES = 3
_QUERIES = {
    "paths": ("e2e-latency", Selection(where="pairs > 0", sort=("max_ns:desc",), limit=MOST_PATHS)),
    "drops": (
        "topics-delivery",
        Selection(where="dropped + lost > 0", sort=("delivered_percent",), limit=_MOST_ROWS),
    ),
    "threads": (
        "executor-usage",
        Selection(where="callbacks > 0", sort=("callback_share:desc",), limit=_MOST_ROWS),
    ),
}
# Sums of a part of the timeline: of the nodes or threads in it, whose identities are conditions.
_AREA = {
    "callbacks": ("callbacks", "total_ns:desc"),
    "usage": ("executor-usage", "callback_ns:desc"),
}
_NO_FLOW = "No flow reached the end of a path."


class Kind(NamedTuple):
    """What sections of one name are about."""

    title: str
    when_empty: str  # what to say where there are no rows
    columns: tuple[str, ...]  # those that matter most


_KINDS = {
    "why": Kind("What makes data late, or lets them get lost", _NO_FLOW, ("headline",)),
    "paths": Kind("Slowest paths", _NO_FLOW,
        ("path", "median_ns", "p99_ns", "max_ns", "reached", "roots")),
    "blame": Kind("Where the time of the slowest flows went", _NO_FLOW,
        ("path", "latency_ns", "node", "duration_ns", "share")),
    "drops": Kind("What was dropped or lost, and why",
        "Nothing was dropped or lost, as far as the trace tells.",
        ("topic_name", "subscriber", "published", "delivered", "dropped", "lost", "reasons")),
    "threads": Kind("Busiest threads", "No thread of an executor ran a callback.",
        ("nodes", "tid", "callback_share", "callback_ns", "callbacks")),
    "verdicts": Kind("Requirements", "The file has no requirements.",
        ("verdict", "target", "subject", "metric", "condition", "measured", "reason", "worst_ns")),
    "change": Kind("What changed", "No path differs.",
        ("path", "change", "a_median_ns", "b_median_ns", "median_percent", "p95_percent",
         "max_percent")),
    # Of a part of the timeline.
    "callbacks": Kind("Callbacks that began in it", "No callback of these nodes began in it.",
        ("node", "callback", "count", "total_ns", "median_ns", "max_ns")),
    "usage": Kind("What threads did in it", "Nothing is known of these threads in it.",
        ("nodes", "tid", "callback_share", "callback_ns", "take_ns", "select_ns", "wait_ns",
         "blocked_ns", "unknown_ns")),
}  # fmt: skip


@dataclass(frozen=True)
class Section:
    """A part of the summary."""

    name: str  # a key of _KINDS
    result: QueryResult  # its rows
    commands: tuple[str, ...]  # print the same numbers
    reading: str = ""  # a line before the rows

    @property
    def kind(self) -> Kind:
        """What it is about."""
        return _KINDS[self.name]


def query_section(asked: Question, name: str, through: str = "") -> Section:
    """Return 'paths', 'drops' or 'threads' of a run."""
    query, selection = _QUERIES[name]
    if through and name == "paths":
        where = f"{selection.where} AND contains(path, {literal(through)})"
        selection = replace(selection, where=where)
    return _chosen(asked, name, query, selection)


def why_section(asked: Question, found: Explanation | None) -> Section:
    """Return the culprits of `msgflow why`, the worst first; its notes are what is in doubt.

    `next` of each is a whole command.
    """
    if found is None:
        return Section("why", QueryResult(pa.table({"headline": pa.array([], pa.string())})), ())
    table = found.verdict.table
    commands = [text and _command(asked, shlex.split(text)) for text in table["next"].to_pylist()]
    place = table.column_names.index("next")
    verdict = replace(
        found.verdict,
        table=table.set_column(place, "next", texts_to_arrow(commands)),
        notes=found.doubts.table["sentence"].to_pylist(),
    )
    return Section("why", verdict, (_command(asked, ["why"]),))


def _command(asked: Question, words: Sequence[str]) -> str:
    # Findings are of whole runs.
    options = [] if words[0] == "check" else asked.options
    return shell_joined(["msgflow", *words, *options, "--run", asked.run.name])


def area_section(asked: Question, name: str, of: Sequence[str | int]) -> Section:
    """Return sums of a part of the timeline."""
    if name not in _AREA:
        raise UsageError(f"there are no such sums — {name}", f"one of {', '.join(_AREA)}")
    query, sort = _AREA[name]
    column = "node" if name == "callbacks" else "thread_id"
    wanted = ", ".join(literal(each) if isinstance(each, str) else str(int(each)) for each in of)
    return _chosen(asked, name, query, Selection(where=f"{column} IN ({wanted})", sort=(sort,)))


def _chosen(asked: Question, name: str, query: str, selection: Selection) -> Section:
    """Return the section with the rows of a query that are chosen."""
    header = load_query(query)
    result = run_query(asked.connection, header, {}, asked.slice, selection=selection)
    words = [*header.command.split(), "--where", selection.where or "", "--sort", *selection.sort]
    words += [] if selection.limit is None else ["--limit", str(selection.limit)]
    command = shell_joined([*words, *asked.options, "--run", asked.run.name])
    return Section(name, result, (command,))


def blame_section(asked: Question, flows: Sequence[tuple[str, str, int]]) -> Section:
    """Return how long each node took of each flow, the slowest flow first."""
    header = load_query("critical-path")
    results, commands = [], []
    for rank, (first, last, take) in enumerate(flows, 1):
        given: dict[str, Value] = {"from": [first], "to": [last], "take": take, "by": "node"}
        result = run_query(asked.connection, header, given, asked.slice)
        table = result.table
        ranks = integers_to_arrow([rank] * len(result), pa.int64())
        results.append(table.set_column(table.column_names.index("rank"), "rank", ranks))
        command = ["msgflow", "flow", "--take", str(take), "--why", "--from", first]
        commands.append(shell_joined([*command, "--case", "first", "--by", "node"]))
    if not results:
        return Section("blame", QueryResult(pa.table({"rank": pa.array([], pa.int64())})), ())
    return Section("blame", replace(result, table=pa.concat_tables(results)), tuple(commands))


def verdict_section(verification: Verification, options: Sequence[str]) -> Section:
    """Return the verdicts on requirements for a run and window, those that are not met first."""
    numbers = [
        f"{verification.count(verdict)} {verdict}"
        for verdict in ("failed", "not measured", "no data", "passed")
    ]
    words = ["msgflow", "verify", verification.file, *options]
    if verification.paths != DEFAULT_PATHS:
        words += ["--paths", verification.paths]
    command = shell_joined([*words, "--run", verification.run.name])
    return Section("verdicts", verification.result, (command,), ", ".join(numbers))


def change_section(comparison: Comparison) -> Section:
    """Return the paths that differ between two runs."""
    a, b = comparison.run_a.name, comparison.run_b.name
    changes = comparison.changes()
    command = shell_joined(["msgflow", "compare", a, b, "--only-different"])
    reading = f"{b} compared with {a}"
    if not len(changes):
        reading = changes.when_empty
    return Section("change", changes, (command,), reading)


def encoded_comparison(comparison: Comparison, what: str, *, is_quick: bool = False) -> bytes:
    """Return a comparison of runs as bytes, for the page of the comparison."""
    names = [comparison.run_a.name, comparison.run_b.name]
    meta = {
        "a": names[0],
        "b": names[1],
        "is_quick": is_quick,
        "command": shell_joined(
            ["msgflow", "compare", *names] + ["--what", what] * (what != "paths")
        ),
    }
    return encode_result(comparison.result, meta)


def encoded_section(section: Section, origin_ns: int) -> bytes:
    """Return a section of the summary as bytes; points in time count from `origin_ns`."""
    meta = {
        "title": section.kind.title,
        "reading": section.reading,
        "when_empty": section.kind.when_empty,
        "shown": section.kind.columns,
        "commands": section.commands,
    }
    return encode_result(section.result, meta, origin_ns)


def markdown(
    run: Run,
    facts: Sequence[str],
    notes: Sequence[str],
    picture: Sequence[str],
    findings: Sequence[Finding],
    sections: Sequence[Section],
) -> str:
    """Return the summary as Markdown."""
    lines = [f"# {code(format_cell(run.name))}", "", ", ".join(facts), ""]
    lines += [line for note in notes for line in (code(note), "")]
    for section in sections:
        lines += _section(section)
        # What makes data late comes first; why the numbers may be wrong stands before them.
        if section.name == "why":
            lines += _picture(run, picture)
            lines += _findings(run, findings)
    return "\n".join(lines)


def _section(section: Section) -> Iterator[str]:
    yield from (f"## {section.kind.title}", "")
    if section.reading:
        # Runs have names of their own.
        reading = code(section.reading) if section.name == "change" else f"{section.reading}."
        yield from (reading, "")
    if len(section.result):
        lines = {"blame": _flows, "why": _culprits}.get(section.name, _table)
        yield from lines(section)
    elif not section.reading:
        yield from (section.kind.when_empty, "")
    if section.commands:
        yield from code_lines(section.commands)
        yield ""


def _table(section: Section) -> Iterator[str]:
    result = section.result.with_columns(section.kind.columns)
    names, columns, right = cells(result)
    yield markdown_line(names)
    yield rule_line(right)
    for row in zip(*columns, strict=True):
        # Names come from the trace: as code they are neither markup nor mentions.
        yield markdown_line(
            text if is_right or text == format_cell(None) else code(text)
            for text, is_right in zip(row, right, strict=True)
        )
    yield ""


def _culprits(section: Section) -> Iterator[str]:
    """Yield a headline for each culprit, and below it what shows it, and what shows more."""
    rows = section.result.table.to_pylist()
    for row in rows[:MOST_CULPRITS]:
        yield f"- **{code(row['headline'])}**"
        for line in row["evidence"]:
            yield f"  - {code(line)}"
        if row["next"] is not None:
            yield f"  - next: {code(row['next'])}"
    if len(rows) > MOST_CULPRITS:
        yield f"- and {len(rows) - MOST_CULPRITS} more"
    yield ""
    for note in section.result.notes:
        yield from (f"note: {code(note)}", "")


def _flows(section: Section) -> Iterator[str]:
    """Yield a line for each flow, and below it one for each node, the longest first."""
    rows = section.result.table.to_pylist()
    for _, group in groupby(rows, key=lambda row: row["rank"]):
        nodes = list(group)
        latency = format_cell(nodes[0]["latency_ns"], unit="ns")
        yield f"- **{latency}**: {code(format_cell(nodes[0]['path']))}"
        for node in nodes:
            took = format_cell(node["duration_ns"], unit="ns")
            share = format_cell(node["share"], unit="share")
            yield f"  - {code(format_cell(node['node']))} {took}, {share} of it"
    yield ""


def _picture(run: Run, picture: Sequence[str]) -> Iterator[str]:
    """Yield the change that explains most, as text that is drawn."""
    if picture:
        yield from ("## When it changed", "", *code_lines(picture), "")
        yield from (
            *code_lines([shell_joined(["msgflow", "query", "changes", "--run", run.name])]),
            "",
        )


def _findings(run: Run, findings: Sequence[Finding]) -> Iterator[str]:
    yield from ("## Findings", "")
    if not findings:
        yield from ("Nothing is wrong with the recording.", "")
        return
    for _, group in groupby(findings, key=lambda finding: finding.name):
        places = list(group)
        first = places[0]
        yield f"- **{first.severity}**: {first.title}"
        for place in places[:_MOST_PLACES]:
            yield f"  - {code(format_cell(place.subject))}: {code(format_cell(place.detail))}"
        if len(places) > _MOST_PLACES:
            yield f"  - and {len(places) - _MOST_PLACES} more"
        yield f"  - Cure: {first.cure}"
    command = shell_joined(["msgflow", "check", "--run", run.name])
    yield from ("", *code_lines([command]), "")
