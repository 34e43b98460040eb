"""Explain why a topic is late: who is to blame, where the time goes, what to ask next."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.backports import Unpack
from msgflow.cli.culprits import culprit_lines
from msgflow.cli.moment import moment_lines
from msgflow.cli.operation import extends
from msgflow.cli.output import command_text, print_note, print_runs, print_status
from msgflow.cli.progress import replay_progress
from msgflow.cli.remedy import remedy_lines
from msgflow.cli.sections import SectionsFormat, chosen_format, print_sections, screen_sections
from msgflow.cli.story import print_story
from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.run.slice import SliceWords
from msgflow.text.values import printable
from msgflow.text.wrapping import hanging

if TYPE_CHECKING:
    from msgflow.query.moment import Moment
    from msgflow.query.why import Explanation
    from msgflow.result.query_result import QueryResult

_PATHS = 3
# Titles, and the columns that answer the question.
_SHOWN = {
    "paths": ("paths", "path roots reached ambiguous median_ns p95_ns max_ns reasons"),
    "slow_flow": (
        "one of its slow flows (95 of 100 take no longer)",
        "rank latency_ns take_id duration_ns share pieces activity state who node what",
    ),
}


@extends(Database.why)
def command(
    database: Database,
    *,
    fix: bool = False,
    goal: str | None = None,
    request: int | None = None,
    form: SectionsFormat | None = None,
    output: Path | None = None,
    wide: bool = False,
    **asked: Any,
) -> None:
    """The first path is that of the worst culprit, or the slowest: all other sections are about
    it. Each section but the verdict and the doubts, which are findings, is part of a named query,
    with the same numbers: e2e-latency, path-breakdown, critical-path, waits --by pair, and topics
    --measure delivery.

    The last lines are the commands to ask next.

    Args:
        fix: Try what may make data sooner, in replays of the run, in place of that.
        goal (ID): What became of a goal, in place of that: goal_id of the view goal, or its first
            digits.
        request (ID): Likewise of the call of a service: request_id of the view request.
        form (table|json|markdown): By default by the suffix of FILE, else table.
    """
    form = chosen_format(form, output)
    if fix:
        if "at" in asked or goal is not None or request is not None:
            raise UsageError("what is tried is tried on all of a run", "leave out the rest")
        with replay_progress() as progress:
            remedies = database.remedies(**asked, progress=progress)
        print_runs([remedies.run])
        whole: SliceWords = {"run": asked.get("run")}
        lines = partial(remedy_lines, remedies, lambda words: _command(words, whole, database.path))
        print_sections(remedies.sections, form, output, None if wide else lines)
        for note in remedies.notes:
            print_note(note)
        return
    if goal is None and request is None:
        found = database.why(**asked)
        # A pager may read the rest of it for long: others can write to the database meanwhile.
        database.close()
        asked.pop("place", None)
        asked.pop("at", None)
        _show(found, form, output, wide=wide, database=database.path, **asked)
        return
    run = asked.pop("run", None)
    if asked:
        raise UsageError(
            f"a goal has a place and times of its own — {next(iter(asked))}", "leave it out"
        )
    story = database.story(goal, request_id=request, run=run)
    print_story(story, form, output, database.path, wide=wide)


def _show(
    found: Explanation | Moment,
    form: SectionsFormat,
    output: Path | None,
    *,
    wide: bool,
    database: Path,
    **part: Unpack[SliceWords],
) -> None:
    from msgflow.query.why import Explanation

    print_runs([found.run])
    if not isinstance(found, Explanation):
        lines = partial(moment_lines, found)
        print_sections(found.sections, form, output, None if wide else lines)
        for step in found.steps:
            print_status(f"next: {_command(step, {'run': part.get('run')}, database)}")
        return
    brief = partial(_brief, found, lambda words: _command(words, part, database))
    print_sections(found.sections, form, output, None if wide else brief)
    if (more := len(found.paths) - _PATHS) > 0:
        ends = ("--to", found.place) if found.place else ()
        paths = "1 more path" if more == 1 else f"{more} more paths"
        whole = part | {"start": found.start}
        print_note(f"{paths}: {_command(('query', 'e2e-latency', *ends), whole, database)}")
    for note in found.notes:
        print_note(note)
    for step in found.steps:
        print_status(f"next: {_command(step, part, database)}")
    if found.suggestion is not None:
        fix = _command(("why", *((found.place,) if found.place else ()), "--fix"), part, database)
        print_status(f"{found.suggestion} ({fix})")


def _brief(
    found: Explanation, command_of: Callable[[Sequence[str]], str], width: int
) -> Iterator[str]:
    """Yield a block for each of the worst culprits, what the recording cannot tell, and why."""
    yield from culprit_lines(found.verdict, command_of, width)
    for row in found.doubts.table.to_pylist():
        yield from hanging("note: ", printable(row["sentence"]), width)
    if len(found.doubts):
        yield ""
    yield from screen_sections(_shown(found), width, is_chosen=True)


def _shown(found: Explanation) -> dict[str, QueryResult]:
    path = found.paths.table["path"][0].as_py()
    number = found.paths.path_numbers.get(path)
    place = "the path" if number is None else f"path {number}"
    shown = {}
    for name, (title, columns) in _SHOWN.items():
        result = found.sections[name]
        # Of how many equal ones a row is the sum: as a rule, of one.
        if name == "slow_flow" and not any(
            row["pieces"] > 1 for row in result.to_arrow().to_pylist() if row["activity"] != "rest"
        ):
            columns = columns.replace(" pieces", "")
        title = title.format(place)
        rows = result.first(_PATHS) if name == "paths" else result
        shown[title] = rows.with_columns(columns.split())
    return shown


def _command(step: Sequence[str], part: SliceWords, database: Path) -> str:
    # Of a flow the identity tells the run; suggestions and findings are from all of a run.
    whole: SliceWords = {"run": part.get("run")}
    taken = {"query": part, "why": part, **dict.fromkeys(("suggest", "check", "predict"), whole)}
    words = ["msgflow", *step]
    for name, value in taken.get(step[0], {}).items():
        if value is not None:
            words += [f"--{name.replace('_', '-')}", str(value)]
    return command_text(words, database)
