"""Show what is wrong with a recording, with cause and cure; exit code 1 on errors."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from msgflow.cli.operation import operation
from msgflow.cli.output import is_screen, print_lines, print_next, print_result, print_status
from msgflow.database import Database
from msgflow.errors import ExitCode
from msgflow.export.formats import Format
from msgflow.run.choice import choose_runs
from msgflow.text.values import count, format_cell
from msgflow.text.wrapping import hanging, wrap

if TYPE_CHECKING:
    from msgflow.db.finding import Finding

_WIDTH = 100
PLACES_SHOWN = 10


@operation
def command(
    database: Database,
    *,
    run: str | None = None,
    detail: bool = False,
    form: Format | None = None,
    output: Path | None = None,
) -> None:
    """With warnings only, the exit code is 0.

    If a run has several clocks, the last line says how far their times can be compared.

    Args:
        detail: Also what is worth knowing but not wrong, what the database breaks now, and what
            share of the answers each defect affects.
    """
    import pyarrow as pa

    from msgflow.cli.tracing_cost import part_of_latencies, share_of_cpu
    from msgflow.db.finding import Finding, commands_after
    from msgflow.result.query_result import QueryResult

    findings = database.findings(run=run, detail=detail)
    is_text = output is None and form in (None, Format.TABLE)
    is_explained = detail and is_text
    quality = database.query("info", section="quality", run=run) if is_explained else None
    every = database.runs()
    chosen = choose_runs(every, run)
    runs = every if detail else chosen
    clocks = database.clock_verdicts(run=run, only_several=True)
    notes = [*clocks, *share_of_cpu(database, chosen)]
    if detail:
        notes += part_of_latencies(database, database.query("e2e-latency", run=run))
    # A pager may read the rest for long: others can write to the database meanwhile.
    database.close()
    labels = {one.run_id: one.title for one in runs} if len(runs) > 1 else {}
    if is_text:
        print_lines(_text(findings, labels))
        if quality is not None and len(quality):
            print_lines([""] if findings else [])
            print_result(quality)
    else:
        columns = ["number", *Finding.__dataclass_fields__]
        rows = [{"number": number, **asdict(finding)} for number, finding in _numbered(findings)]
        listed = pa.table({name: [row[name] for row in rows] for name in columns})
        print_result(QueryResult(listed, when_empty="no findings"), form, output)
    for note in notes:
        print_status(note)
    numbers = [
        count(len({f.name for f in findings if f.severity == severity}), severity)
        for severity in ("error", "warning")
    ]
    print_status(", ".join(numbers) if findings else "nothing is wrong with the recording")
    if not runs:
        print_next(["msgflow", "ingest", "TRACE"], database.path)
    else:
        # Most commands explain one run: what is worst comes first, else what is newest.
        shown = [one.run_id for one in chosen]
        about = next((each.run_id for each in findings if each.run_id in shown), shown[-1])
        for words in commands_after([each for each in findings if each.run_id == about]):
            print_next(["msgflow", *words], database.path, None if run is None else about)
    if any(finding.severity == "error" for finding in findings):
        raise typer.Exit(ExitCode.FAILED)


def _numbered(findings: Sequence[Finding]) -> Iterator[tuple[int, Finding]]:
    groups = groupby(findings, key=lambda finding: finding.name)
    for number, (_, places) in enumerate(groups, start=1):
        for finding in places:
            yield number, finding


def _text(findings: Sequence[Finding], run_labels: Mapping[int, str]) -> Iterator[str]:
    width = min(_WIDTH, shutil.get_terminal_size((_WIDTH, 24)).columns)
    # In a pipe what people search for stays in one line.
    room = width if is_screen() else sys.maxsize
    for number, group in groupby(_numbered(findings), key=lambda item: item[0]):
        places = [finding for _, finding in group]
        first = places[0]
        if number > 1:
            yield ""
        head, *more = wrap(f"{first.severity}: {first.title} ({first.name})", room - 4)
        yield f"{number}. {head}"
        yield from (f"   {line}" for line in more)
        for finding in places[:PLACES_SHOWN]:
            run = f"run {run_labels[finding.run_id]}: " if run_labels else ""
            text = f"{format_cell(run + finding.subject)} — {format_cell(finding.detail)}"
            first_line, *more = wrap(text, room - 5)
            yield f"   {first_line}"
            yield from (f"     {line}" for line in more)
        if len(places) > PLACES_SHOWN:
            yield f"   … and {len(places) - PLACES_SHOWN} more; --format json has them all"
        for label, text in (
            ("   means: ", first.description),
            ("   cause: ", first.cause),
            ("   cure:  ", first.cure),
        ):
            yield from hanging(label, text, width)
