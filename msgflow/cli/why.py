"""`msgflow why`: why a topic is late, on one screen."""

from __future__ import annotations

import shlex
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from msgflow.cli.completion import complete
from msgflow.cli.options import DatabaseOption, MemoryLimitOption, OutputOption, WideOption
from msgflow.cli.sections import (
    SectionsFormat,
    SectionsFormatOption,
    json_lines,
    screen_sections,
    sections_format,
    whole_sections,
)
from msgflow.cli.slice_options import with_slice
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.run.slice import LATEST, Slice

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from msgflow.query.why import Explanation
    from msgflow.result.query_result import QueryResult

_PATHS = 3
# Titles, and the columns that answer the question.
_SHOWN = {
    "paths": ("paths", "path reached roots median_ns p95_ns max_ns reasons"),
    "nodes": ("time by node, on {}", "node share part what median_ns max_ns"),
    "slowest_flow": (
        "its slowest flow",
        "rank latency_ns take_id duration_ns share activity state who node what",
    ),
    "waits": (
        "what kept its callbacks waiting",
        "node callback meanwhile_node meanwhile_callback meanwhile_thread worst_ns",
    ),
    "losses": (
        "messages not delivered",
        "topic_name subscriber published dropped lost reasons",
    ),
}


@with_slice()
def command(
    place: Annotated[
        str | None,
        typer.Argument(
            metavar="[TOPIC|NODE]",
            help="Where the flows end; a glob is possible",
            show_default="the end of the path with the slowest flow",
            autocompletion=complete("place"),
        ),
    ] = None,
    part: Slice = LATEST,
    form: SectionsFormatOption = None,
    output: OutputOption = None,
    wide: WideOption = False,
    memory_limit: MemoryLimitOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Explain why a topic is late: its slowest path, where the time goes, what to ask next.

    The first path is that of the slowest flow: all other sections are about it. Each
    section is part of a named query, with the same numbers: e2e-latency,
    path-breakdown, critical-path, waits --by pair, and topics --measure delivery.
    """
    from msgflow.cli.output import print_note, print_runs, print_status, print_text
    from msgflow.database import Database
    from msgflow.result.layout import screen_width

    form = form or sections_format(output)
    with Database(database, memory_limit=memory_limit) as opened:
        found = opened.why(place, **asdict(part))
    print_runs([found.run])
    if form is SectionsFormat.JSON:
        lines = json_lines(found.sections)
    elif wide or form is SectionsFormat.MARKDOWN:
        lines = whole_sections(found.sections, form)
    else:
        lines = screen_sections(_shown(found), screen_width(), is_chosen=True)
    print_text("\n".join(lines), output)
    for note in [*_more(found, part, database), *found.notes]:
        print_note(note)
    for step in found.steps:
        print_status(f"next: {_command(step, part, database)}")


def _shown(found: Explanation) -> dict[str, QueryResult]:
    path = found.paths.table["path"][0].as_py()
    number = found.paths.path_numbers.get(path)
    place = "the path" if number is None else f"path {number}"
    shown = {}
    for name, result in found.sections.items():
        title, columns = _SHOWN[name]
        title = title.format(place)
        rows = result.first(_PATHS) if name == "paths" else result
        shown[title] = rows.with_columns(columns.split())
    return shown


def _more(found: Explanation, part: Slice, database: Path) -> Iterator[str]:
    if (more := len(found.paths) - _PATHS) > 0:
        ends = ("--to", found.place) if found.place else ()
        paths = "1 more path" if more == 1 else f"{more} more paths"
        yield f"{paths}: {_command(('query', 'e2e-latency', *ends), part, database)}"


def _command(step: tuple[str, ...], part: Slice, database: Path) -> str:
    """Return a command that runs as it is printed."""
    from msgflow.cli.output import database_option

    # Of a flow the identity tells the run; suggestions are from all of a run.
    taken = {"query": asdict(part), "suggest": {"run": part.run}}.get(step[0], {})
    words = ["msgflow", *step]
    for name, value in taken.items():
        if value is not None:
            words += [f"--{name.replace('_', '-')}", str(value)]
    return shlex.join([*words, *database_option(database)])
