"""Text and HTML of a result: how it prints itself, and how a notebook shows it."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING

from msgflow.result.layout import MOST_ROWS, lay_out, screen_width
from msgflow.result.rows import cells
from msgflow.result.screen import screen_lines
from msgflow.text.values import printable
from msgflow.text.wrapping import wrap

if TYPE_CHECKING:
    from msgflow.result.rows import Rows

_STYLE = "text-align: {}; white-space: pre-wrap"


def result_text(result: Rows) -> str:
    """Return the text of a terminal: runs, the first rows as a table that fits, notes."""
    width = screen_width()
    shown = lay_out(result, width, remedy="to_arrow() has all")
    runs = ", ".join(run.title for run in result.runs)
    head = [("run: " if len(result.runs) == 1 else "runs: ", runs)] if runs else []
    notes = [*shown.notes, *([] if len(result) else [result.when_empty]), *result.notes]
    lines = [
        *(line for label, text in head for line in _labelled(label, text, width)),
        *screen_lines(shown, width),
        *([] if shown.not_shown is None else [shown.not_shown]),
        *(line for note in notes for line in _labelled("note: ", note, width)),
    ]
    return "\n".join(lines)


def _labelled(label: str, text: str, width: int) -> list[str]:
    first, *more = wrap(printable(text), width - len(label))
    return [f"{label}{first}", *(" " * len(label) + line for line in more)]


def result_html(result: Rows) -> str:
    """Return the first rows as an HTML table; names from a trace are always text in it."""
    names, columns, right = cells(replace(result, table=result.table.slice(0, MOST_ROWS)))
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
    for row in zip(*columns, strict=True):
        parts.append("<tr>")
        parts += [
            f'<td style="{style}">{escape(cell)}</td>'
            for cell, style in zip(row, styles, strict=True)
        ]
        parts.append("</tr>")
    parts.append("</tbody></table>")
    notes = [f"the first {MOST_ROWS} of {len(result):,} rows"] if len(result) > MOST_ROWS else []
    notes += [*([] if len(result) else [result.when_empty]), *result.notes]
    parts += [f"<p>{escape(note)}</p>" for note in notes]
    return "".join(parts)
