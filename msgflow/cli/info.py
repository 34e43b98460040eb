"""`msgflow info`: the content of a database, by named queries."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

from msgflow.cli.options import DatabaseOption, InternalOption, RunOption, WideOption, format_option
from msgflow.default_files import DEFAULT_DATABASE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from msgflow.query.result import QueryResult

SECTIONS = ("runs", "hosts", "processes", "nodes", "topics", "counts", "findings")


class InfoFormat(StrEnum):
    """Formats of all tables together; the queries write each table in any format."""

    TABLE = "table"
    JSON = "json"
    MARKDOWN = "markdown"


def command(
    run: RunOption = None,
    internal: InternalOption = False,
    form: Annotated[InfoFormat, format_option("Output format")] = InfoFormat.TABLE,
    wide: WideOption = False,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Print what a database holds: runs, hosts, processes, nodes, topics, counts, data quality.

    Each section is a named query: `msgflow query info --section nodes`, `msgflow query topics`.
    """
    from msgflow.cli.output import is_screen, print_lines, print_note
    from msgflow.cli.show.layout import screen_width
    from msgflow.database import Database

    with Database(database) as opened:
        # Its topics are a query of their own.
        results = {
            section: opened.query("topics", run=run, internal=internal)
            if section == "topics"
            else opened.query(
                "info",
                run="all" if section == "runs" else run,
                internal=internal,
                section=section,
            )
            for section in SECTIONS
        }
    if form is InfoFormat.TABLE and is_screen() and not wide:
        lines = _for_screen(results, screen_width())
    else:
        lines = _json(results) if form is InfoFormat.JSON else _sections(results, form)
    print_lines(lines)
    for section, result in results.items():
        for note in result.notes:
            print_note(f"{section}: {note}")


def _json(results: dict[str, QueryResult]) -> Iterator[str]:
    from msgflow.export.formats import json_rows

    yield "{"
    for position, (section, result) in enumerate(results.items(), start=1):
        rows = ",\n    ".join(json_rows(result))
        comma = "," if position < len(results) else ""
        yield f"  {json.dumps(section)}: [{rows}]{comma}"
    yield "}"


def _for_screen(results: dict[str, QueryResult], width: int) -> Iterator[str]:
    from msgflow.cli.show.layout import lay_out
    from msgflow.cli.show.screen import screen_lines
    from msgflow.text.wrapping import wrap

    for position, (section, result) in enumerate(results.items()):
        if position:
            yield ""
        yield section.upper()
        # The line about columns stands in brackets.
        shown = lay_out(result, width - 2)
        yield from screen_lines(shown, width)
        said = () if shown.not_shown is None else (shown.not_shown,)
        notes = (*said, *shown.notes) if len(result) else ("none",)
        for note in notes:
            yield from wrap(f"({note})", width)


def _sections(results: dict[str, QueryResult], form: InfoFormat) -> Iterator[str]:
    from msgflow.export.table import markdown_lines, table_lines

    for position, (section, result) in enumerate(results.items()):
        if position:
            yield ""
        if form is InfoFormat.MARKDOWN:
            yield f"## {section.capitalize()}"
            yield ""
            yield from markdown_lines(result)
        else:
            yield section.upper()
            yield from table_lines(result)
