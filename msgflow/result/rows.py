"""Rows of a result, and what is known about them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.run.choice import Run
    from msgflow.sql.header import Header


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
