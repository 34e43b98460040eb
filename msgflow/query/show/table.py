"""A result as an aligned table or as Markdown: as wide as its content, never cut."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.cells import cell_len

from msgflow.query.show.human import format_cell, shown_name

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import pyarrow as pa

    from msgflow.query.rows import Rows


def table_lines(result: Rows) -> Iterator[str]:
    """Yield the lines of a table: names, a rule, one line per row, numbers to the right."""
    return lay_out(*cells(result))


def lay_out(
    names: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[bool]
) -> Iterator[str]:
    """Yield the lines of a table of text.

    Args:
        names: titles of the columns.
        rows: cells, as many in each row as there are columns.
        right: for each column, whether it is aligned to the right.
    """
    if not names:
        return
    widths = [
        max(cell_len(name), max((cell_len(cell) for cell in column), default=0))
        for name, column in zip(names, _columns(rows, len(names)), strict=True)
    ]
    yield _line(names, widths, right)
    yield "─" * (sum(widths) + 2 * (len(widths) - 1))
    for row in rows:
        yield _line(row, widths, right)


def markdown_lines(result: Rows) -> Iterator[str]:
    """Yield the lines of a Markdown table."""
    names, rows, right = cells(result)
    if not names:
        return
    yield _markdown_line(names)
    yield "|" + "|".join(" ---: " if is_right else " --- " for is_right in right) + "|"
    for row in rows:
        yield _markdown_line(row)


def cells(result: Rows) -> tuple[list[str], list[list[str]], list[bool]]:
    """Return titles, rows as people read them, and which columns are numbers."""
    import pyarrow.types

    units = result.units
    names = [shown_name(name, units.get(name), result.columns) for name in result.columns]
    columns: list[list[str]] = []
    right: list[bool] = []
    for field, column in zip(result.table.schema, result.table.columns, strict=True):
        is_handle = field.name.endswith("_handle") and pyarrow.types.is_uint64(field.type)
        unit = units.get(field.name)
        columns.append([format_cell(value, unit, is_handle=is_handle) for value in _list(column)])
        right.append(_is_number(field.type))
    return names, [list(row) for row in zip(*columns, strict=True)], right


def _list(column: pa.ChunkedArray) -> list[Any]:
    values: list[Any] = column.to_pylist()
    return values


def _is_number(kind: pa.DataType) -> bool:
    import pyarrow.types

    return bool(
        pyarrow.types.is_integer(kind)
        or pyarrow.types.is_floating(kind)
        or pyarrow.types.is_decimal(kind)
    )


def _columns(rows: Sequence[Sequence[str]], count: int) -> list[Sequence[str]]:
    return list(zip(*rows, strict=True)) if rows else [()] * count


def _line(cells: Sequence[str], widths: Sequence[int], right: Sequence[bool]) -> str:
    parts = []
    for cell, width, is_right in zip(cells, widths, right, strict=True):
        padding = " " * (width - cell_len(cell))
        parts.append(padding + cell if is_right else cell + padding)
    return "  ".join(parts).rstrip()


def _markdown_line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
