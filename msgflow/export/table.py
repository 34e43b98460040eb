"""Tables and Markdown of a result: as wide as its content, never cut."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import repeat
from operator import add
from typing import TYPE_CHECKING

from rich.cells import cell_len

from msgflow.result.rows import cells
from msgflow.text.markdown import markdown_line, rule_line

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult

_GAP = "  "


def table_lines(result: QueryResult) -> Iterator[str]:
    """Yield the lines of a table: names, a rule, one line per row, numbers to the right."""
    names, columns, right = cells(result)
    if not names:
        return
    padded, widths = zip(*map(_aligned, names, columns, right), strict=True)
    lines = (_GAP.join(row).rstrip() for row in zip(*padded, strict=True))
    yield next(lines)
    yield "─" * (sum(widths) + len(_GAP) * (len(widths) - 1))
    yield from lines


def markdown_lines(result: QueryResult) -> Iterator[str]:
    """Yield the lines of a Markdown table."""
    names, columns, right = cells(result)
    if not names:
        return
    yield markdown_line(names)
    yield rule_line(right)
    for row in zip(*columns, strict=True):
        yield markdown_line(row)


def _aligned(name: str, column: Sequence[str], is_right: bool) -> tuple[Iterator[str], int]:
    """Return the title and cells of a column padded to one width, and that width."""
    texts = [name, *column]
    characters = "".join(texts)
    if characters.isascii() or all(cell_len(character) == 1 for character in set(characters)):
        width = max(map(len, texts))
        return map(str.rjust if is_right else str.ljust, texts, repeat(width)), width
    width = max(map(cell_len, texts))
    padding = (" " * (width - cell_len(text)) for text in texts)
    return map(add, *((padding, texts) if is_right else (texts, padding))), width
