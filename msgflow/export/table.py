"""Tables and Markdown of a result: as wide as its content, never cut."""

from __future__ import annotations

from functools import cache, partial
from itertools import repeat
from operator import add
from typing import TYPE_CHECKING

from rich.cells import cell_len

from msgflow.text.values import column_title, format_cell

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import pyarrow as pa

    from msgflow.query.result import QueryResult

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
    yield _markdown_line(names)
    yield "|" + "|".join(" ---: " if is_right else " --- " for is_right in right) + "|"
    for row in zip(*columns, strict=True):
        yield _markdown_line(row)


def cells(result: QueryResult) -> tuple[list[str], list[list[str]], list[bool]]:
    """Return the titles, the cells of each column, and whether each column has numbers."""
    import pyarrow.types

    units = result.units
    names = [column_title(name, units.get(name), result.columns) for name in result.columns]
    columns: list[list[str]] = []
    right: list[bool] = []
    for field, column in zip(result.table.schema, result.table.columns, strict=True):
        is_handle = field.name.endswith("_handle") and pyarrow.types.is_uint64(field.type)
        cell = partial(format_cell, unit=units.get(field.name), is_handle=is_handle)
        # Most texts of a column repeat.
        texts = cache(cell) if pyarrow.types.is_string(field.type) else cell
        columns.append(list(map(texts, column.to_pylist())))
        right.append(_is_number(field.type))
    return names, columns, right


def _is_number(kind: pa.DataType) -> bool:
    import pyarrow.types

    return bool(
        pyarrow.types.is_integer(kind)
        or pyarrow.types.is_floating(kind)
        or pyarrow.types.is_decimal(kind)
    )


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


def _markdown_line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
