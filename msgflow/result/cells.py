"""Cells of a result as people read them."""

from __future__ import annotations

from functools import cache, partial
from typing import TYPE_CHECKING

from msgflow.text.values import column_title, format_cell

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.result.rows import Rows


def cells(result: Rows) -> tuple[list[str], list[list[str]], list[bool]]:
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
        right.append(is_number(field.type))
    return names, columns, right


def is_number(kind: pa.DataType) -> bool:
    """Tell whether values of an Arrow type are numbers."""
    import pyarrow.types

    return bool(
        pyarrow.types.is_integer(kind)
        or pyarrow.types.is_floating(kind)
        or pyarrow.types.is_decimal(kind)
    )
