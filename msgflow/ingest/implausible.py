"""Leaves out payload values that cannot be times: one of them must not end an ingest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc

if TYPE_CHECKING:
    from collections.abc import Iterator

_TIMES = {"timestamp", "source_timestamp", "message_timestamp", "init_timestamp", "period"}
# 146 years in nanoseconds: differences of any two times fit, as they do in the reader.
_LATEST_NS = 1 << 62


class Implausible:
    """Counts what it leaves out."""

    def __init__(self) -> None:
        self._counts: dict[tuple[str, str], int] = {}

    def without(self, name: str, batch: pa.RecordBatch) -> pa.RecordBatch:
        """Return events of this name with NULL in place of times that make no sense."""
        for place, column in enumerate(batch.schema.names):
            if column not in _TIMES:
                continue
            values = batch.column(place)
            extent = pc.min_max(values).as_py()
            least, most = extent["min"], extent["max"]
            if least is None or -_LATEST_NS < least <= most < _LATEST_NS:
                continue
            is_good = pc.and_(pc.greater(values, -_LATEST_NS), pc.less(values, _LATEST_NS))
            bad = pc.sum(pc.invert(is_good)).as_py()
            self._counts[name, column] = self._counts.get((name, column), 0) + bad
            kept = pc.if_else(is_good, values, pa.scalar(None, values.type))
            batch = batch.set_column(place, batch.schema.field(place), kept)
        return batch

    def diagnostics(self) -> Iterator[tuple[str, str, int, str]]:
        """Yield name, severity, count and detail of what was left out."""
        for (name, column), count in sorted(self._counts.items()):
            detail = f"values of {column} in {name} that cannot be times: left out"
            yield "implausible_value", "data_loss", count, detail
