"""`msgflow check`: what is wrong with a recording, numbered, with cause and cure."""

from __future__ import annotations

import json
import shutil
import textwrap
from dataclasses import asdict
from enum import StrEnum
from itertools import groupby
from typing import TYPE_CHECKING, Annotated

import typer

from msgflow.cli.options import DatabaseOption, MemoryLimitOption, RunOption, format_option
from msgflow.default_files import DEFAULT_DATABASE
from msgflow.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from msgflow.db.finding import Finding

_WIDTH = 100
_PLACES_SHOWN = 10


class CheckFormat(StrEnum):
    """Formats of findings."""

    TABLE = "table"
    JSON = "json"


def command(
    run: RunOption = None,
    form: Annotated[CheckFormat, format_option("How to write it")] = CheckFormat.TABLE,
    memory_limit: MemoryLimitOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Show what is wrong with a recording, with cause and cure; exit code 1 on errors.

    With warnings only, the exit code is 0. An audit of the database that failed
    when the run was ingested (msgflow db check) is a finding too. Of a run with
    several clocks it is said how far their times can be compared.
    """
    from msgflow.cli.output import count, print_lines, print_status
    from msgflow.database import Database
    from msgflow.query.clock_notes import clock_verdicts

    with Database(database, memory_limit=memory_limit) as opened:
        findings = opened.findings(run=run)
        runs = opened.query("clocks", run=run).runs if opened.runs() else ()
        verdicts = clock_verdicts(opened.connection, runs, only_several=True)
        names = {known.run_id: known.title for known in opened.runs()}
    labels = names if run == "all" and len(names) > 1 else {}
    print_lines(_json(findings) if form is CheckFormat.JSON else _text(findings, labels))
    numbers = [
        count(len({f.name for f in findings if f.severity == severity}), severity)
        for severity in ("error", "warning")
    ]
    for verdict in verdicts:
        print_status(verdict)
    print_status(", ".join(numbers) if findings else "nothing is wrong with the recording")
    if any(finding.severity == "error" for finding in findings):
        raise typer.Exit(ExitCode.FAILED)


def _json(findings: Sequence[Finding]) -> Iterator[str]:
    yield "["
    for position, (number, finding) in enumerate(_numbered(findings), start=1):
        comma = "," if position < len(findings) else ""
        row = {"number": number, **asdict(finding)}
        yield f"  {json.dumps(row, ensure_ascii=False)}{comma}"
    yield "]"


def _numbered(findings: Sequence[Finding]) -> Iterator[tuple[int, Finding]]:
    groups = groupby(findings, key=lambda finding: finding.name)
    for number, (_, places) in enumerate(groups, start=1):
        for finding in places:
            yield number, finding


def _text(findings: Sequence[Finding], run_labels: Mapping[int, str]) -> Iterator[str]:
    from msgflow.cli.output import is_screen
    from msgflow.text.values import format_cell
    from msgflow.text.wrapping import wrap

    def fitting(text: str, room: int) -> list[str]:
        # In a pipe each text stays in one line, so that grep finds it.
        return wrap(text, room) if is_screen() else [text]

    width = min(_WIDTH, shutil.get_terminal_size((_WIDTH, 24)).columns)
    for number, group in groupby(_numbered(findings), key=lambda item: item[0]):
        places = [finding for _, finding in group]
        first = places[0]
        if number > 1:
            yield ""
        head, *more = fitting(f"{first.severity}: {first.title} ({first.name})", width - 4)
        yield f"{number}. {head}"
        yield from (f"   {line}" for line in more)
        for finding in places[:_PLACES_SHOWN]:
            run = f"run {run_labels[finding.run_id]}: " if run_labels else ""
            text = f"{format_cell(run + finding.subject)} — {format_cell(finding.detail)}"
            first_line, *more = fitting(text, width - 5)
            yield f"   {first_line}"
            yield from (f"     {line}" for line in more)
        if len(places) > _PLACES_SHOWN:
            yield f"   … and {len(places) - _PLACES_SHOWN} more; --format json has them all"
        for label, text in (
            ("means", first.description),
            ("cause", first.cause),
            ("cure", first.cure),
        ):
            yield from textwrap.wrap(
                text,
                width,
                initial_indent=f"   {label + ':':<7}",
                subsequent_indent=" " * 10,
                break_long_words=False,
                break_on_hyphens=False,
            )
