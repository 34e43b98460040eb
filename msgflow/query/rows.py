"""Rows that a query returned, and what is known of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.run.choice import Run
    from msgflow.sql.header import Header


@dataclass(frozen=True, repr=False)
class Rows:
    """Rows in the order of the query. Times are integers in nanoseconds.

    Attributes:
        table: the rows.
        header: of the named query, which holds the units; None for plain SQL.
        runs: the runs that were read; empty for plain SQL.
        notes: what the rows do not say themselves (hidden rows, truncation), a sentence each.
        when_empty: what to say where there are no rows.
    """

    table: pa.Table
    header: Header | None = None
    runs: tuple[Run, ...] = ()
    notes: list[str] = field(default_factory=list)
    when_empty: str = "no rows"

    def __len__(self) -> int:
        return int(self.table.num_rows)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.table.column_names)

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column that has one ('ns' a duration, 'epoch ns' a point in time)."""
        if self.header is None:
            return {}
        return {column.name: column.unit for column in self.header.columns if column.unit}
