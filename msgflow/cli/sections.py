"""Several results together, each below a title."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from msgflow.cli.output import print_text
from msgflow.export.formats import by_suffix, json_rows
from msgflow.result.layout import lay_out, screen_width
from msgflow.result.screen import screen_lines
from msgflow.text.wrapping import wrap

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult

SectionsFormat = Literal["table", "json", "markdown"]
"""Formats of several tables; the queries write each table in any format."""
_SUFFIXES: dict[str, SectionsFormat] = {".txt": "table", ".json": "json", ".md": "markdown"}


def chosen_format(form: SectionsFormat | None, output: Path | None) -> SectionsFormat:
    """Return the format that is asked for, else that of the suffix."""
    if form is not None:
        return form
    return "table" if output is None else by_suffix(output, _SUFFIXES)


def print_sections(
    results: Mapping[str, QueryResult],
    form: SectionsFormat,
    output: Path | None,
    brief: Callable[[int], Iterator[str]] | None,
) -> None:
    """Print results; `brief` returns the lines of a table of a width, where people read it."""
    if form == "json":
        sections = []
        for section, result in results.items():
            rows = ",\n    ".join(json_rows(result))
            sections.append(f"  {json.dumps(section)}: [{rows}]")
        lines: Iterable[str] = ("{", ",\n".join(sections), "}")
    elif form == "table" and brief is not None:
        lines = brief(screen_width())
    else:
        lines = _whole_sections(results, form)
    print_text("\n".join(lines), output)


def screen_sections(
    results: Mapping[str, QueryResult], width: int, *, is_chosen: bool = False
) -> Iterator[str]:
    """Yield lines for people, none longer than `width` cells."""
    for position, (section, result) in enumerate(results.items()):
        if position:
            yield ""
        yield section.upper()
        # A line about columns that are not shown stands in brackets.
        shown = lay_out(result, width if is_chosen else width - 2, is_whole=is_chosen)
        yield from screen_lines(shown, width)
        said = () if shown.not_shown is None or is_chosen else (shown.not_shown,)
        notes = (*said, *shown.notes) if len(result) else ("none",)
        for note in notes:
            yield from wrap(f"({note})", width)


def _whole_sections(results: Mapping[str, QueryResult], form: SectionsFormat) -> Iterator[str]:
    from msgflow.export.formats import markdown_lines, table_lines

    for position, (section, result) in enumerate(results.items()):
        if position:
            yield ""
        if form == "markdown":
            yield f"## {section.capitalize()}"
            yield ""
            yield from markdown_lines(result)
        else:
            yield section.upper()
            yield from table_lines(result)
