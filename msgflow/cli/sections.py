"""Several results together, each below a title."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import TYPE_CHECKING

from msgflow.export.formats import by_suffix, json_rows
from msgflow.result.layout import lay_out
from msgflow.text.wrapping import wrap

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from msgflow.result.query_result import QueryResult


class SectionsFormat(StrEnum):
    """Formats of several tables; the queries write each table in any format."""

    TABLE = "table"
    JSON = "json"
    MARKDOWN = "markdown"


_SUFFIXES = {
    ".txt": SectionsFormat.TABLE,
    ".json": SectionsFormat.JSON,
    ".md": SectionsFormat.MARKDOWN,
}


def sections_format(path: Path | None) -> SectionsFormat:
    """Return the format for a file by its suffix, a table for stdout."""
    return SectionsFormat.TABLE if path is None else by_suffix(path, _SUFFIXES)


def json_lines(results: Mapping[str, QueryResult]) -> Iterator[str]:
    """Yield the lines of an object with a list of rows for each result."""
    yield "{"
    for position, (section, result) in enumerate(results.items(), start=1):
        rows = ",\n    ".join(json_rows(result))
        comma = "," if position < len(results) else ""
        yield f"  {json.dumps(section)}: [{rows}]{comma}"
    yield "}"


def screen_sections(
    results: Mapping[str, QueryResult], width: int, *, is_chosen: bool = False
) -> Iterator[str]:
    """Yield lines for people, none longer than `width` cells."""
    from msgflow.result.screen import screen_lines

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


def whole_sections(results: Mapping[str, QueryResult], form: SectionsFormat) -> Iterator[str]:
    """Yield lines of tables with all columns."""
    from msgflow.export.table import markdown_lines, table_lines

    for position, (section, result) in enumerate(results.items()):
        if position:
            yield ""
        if form is SectionsFormat.MARKDOWN:
            yield f"## {section.capitalize()}"
            yield ""
            yield from markdown_lines(result)
        else:
            yield section.upper()
            yield from table_lines(result)
