"""The summary of a run as Markdown, for a pull request or an issue."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from msgflow.result.rows import cells
from msgflow.text.markdown import code, code_lines, markdown_line, rule_line
from msgflow.text.shell import shell_joined
from msgflow.text.values import format_cell

if TYPE_CHECKING:
    from msgflow.db.finding import Finding
    from msgflow.run.choice import Run
    from msgflow.view.summary import Section

# Of each kind of finding; `msgflow check` lists all of them.
_MOST_PLACES = 3


def markdown(
    run: Run,
    facts: Sequence[str],
    notes: Sequence[str],
    findings: Sequence[Finding],
    sections: Sequence[Section],
) -> str:
    """Return the summary."""
    before = [section for section in sections if section.name in ("verdicts", "change", "why")]
    after = [section for section in sections if section.name not in ("verdicts", "change", "why")]
    lines = [f"# {code(format_cell(run.name))}", "", ", ".join(facts), ""]
    lines += [line for note in notes for line in (code(note), "")]
    for section in before:
        lines += _section(section)
    lines += _findings(run, findings)
    for section in after:
        lines += _section(section)
    return "\n".join(lines)


def _section(section: Section) -> Iterator[str]:
    yield f"## {section.title}"
    yield ""
    if section.reading:
        # Runs have names of their own.
        reading = code(section.reading) if section.name == "change" else f"{section.reading}."
        yield from (reading, "")
    if len(section.result):
        lines = {"blame": _flows, "why": _sentences}.get(section.name, _table)
        yield from lines(section)
    elif not section.reading:
        yield from (section.when_empty, "")
    if section.commands:
        yield from code_lines(section.commands)
        yield ""


def _table(section: Section) -> Iterator[str]:
    result = section.result.with_columns(section.columns)
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


def _sentences(section: Section) -> Iterator[str]:
    for sentence in section.result.table["sentence"].to_pylist():
        yield f"- {code(sentence)}"
    yield ""


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
