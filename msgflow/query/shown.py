"""A result for people: as text, and for a notebook. Long ones are cut, which they say."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING

from msgflow.query.present import MOST_ROWS
from msgflow.query.table import cells, table_lines

if TYPE_CHECKING:
    from msgflow.query.result import QueryResult

_STYLE = "text-align: {}; white-space: pre-wrap"


def shown_text(result: QueryResult) -> str:
    """Return the first rows as an aligned table, and what is to be said about them."""
    lines = list(table_lines(_first(result)))
    return "\n".join([*lines, *(f"note: {note}" for note in _notes(result))])


def shown_html(result: QueryResult) -> str:
    """Return the first rows as an HTML table; names from a trace are never more than text."""
    names, rows, right = cells(_first(result))
    styles = [_STYLE.format("right" if is_right else "left") for is_right in right]
    parts = ["<table>"]
    if result.header is not None:
        parts.append(f"<caption>{escape(result.header.title)}</caption>")
    parts.append("<thead><tr>")
    parts += [
        f'<th style="{style}">{escape(name)}</th>'
        for name, style in zip(names, styles, strict=True)
    ]
    parts.append("</tr></thead><tbody>")
    for row in rows:
        parts.append("<tr>")
        parts += [
            f'<td style="{style}">{escape(cell)}</td>'
            for cell, style in zip(row, styles, strict=True)
        ]
        parts.append("</tr>")
    parts.append("</tbody></table>")
    parts += [f"<p>{escape(note)}</p>" for note in _notes(result)]
    return "".join(parts)


def _first(result: QueryResult) -> QueryResult:
    return replace(result, table=result.table.slice(0, MOST_ROWS))


def _notes(result: QueryResult) -> list[str]:
    count = len(result)
    if not count:
        return ["no rows", *result.notes]
    cut = [f"the first {MOST_ROWS} of {count:,} rows"] if count > MOST_ROWS else []
    return [*cut, *result.notes]
