"""Rows of a result, what is known about them, and their cells as people read them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, partial
from typing import TYPE_CHECKING, Literal

from msgflow.text.values import column_title, format_cell

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.run.choice import Run
    from msgflow.sql.header import Header

Times = Literal["ns", "seconds", "relative", "sim", "iso"]
"""How times are written; with all but `ns`, durations are in seconds."""


@dataclass(frozen=True, repr=False)
class Rows:
    """Rows in the order of the query, as `QueryResult` describes them."""

    table: pa.Table
    header: Header | None = None
    runs: tuple[Run, ...] = ()
    notes: list[str] = field(default_factory=list)
    when_empty: str = "no rows"
    path_numbers: dict[str, int] = field(default_factory=dict)
    order: tuple[str, ...] = ()

    def __len__(self) -> int:
        return int(self.table.num_rows)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.table.column_names)

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column that has one ('ns' for a duration, 'epoch ns' for a moment)."""
        if self.header is None:
            return {}
        return {column.name: column.unit for column in self.header.columns if column.unit}


def cells(result: Rows) -> tuple[list[str], list[list[str]], list[bool]]:
    """Return the titles, the cells of each column, and whether each column has numbers."""
    import pyarrow.types

    units = result.units
    names = [column_title(name, units.get(name), result.columns) for name in result.columns]
    columns: list[list[str]] = []
    right: list[bool] = []
    for name, column in zip(result.columns, result.table.columns, strict=True):
        is_handle = name.endswith("_handle") and pyarrow.types.is_uint64(column.type)
        cell = partial(format_cell, unit=units.get(name), is_handle=is_handle)
        # Most texts of a column repeat.
        texts = cache(cell) if pyarrow.types.is_string(column.type) else cell
        columns.append(list(map(texts, column.to_pylist())))
        right.append(is_number(column.type))
    return names, columns, right


def is_number(kind: pa.DataType) -> bool:
    """Tell whether values of an Arrow type are numbers."""
    import pyarrow.types

    return bool(
        pyarrow.types.is_integer(kind)
        or pyarrow.types.is_floating(kind)
        or pyarrow.types.is_decimal(kind)
    )
