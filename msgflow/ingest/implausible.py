"""Leaves out payload values that cannot be times or names: one of them must not end an ingest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc

if TYPE_CHECKING:
    from collections.abc import Iterator

_TIMES = {"timestamp", "source_timestamp", "message_timestamp", "init_timestamp", "period"}
# 146 years in nanoseconds: differences of any two times fit, as they do in the reader.
_LATEST_NS = 1 << 62
# Bytes. ROS allows 255 for a name; symbols of templates can be long. Every message is joined with
# the name of its topic.
_LONGEST_NAME = 1 << 10
_LONGEST_SYMBOL = 1 << 16


class Implausible:
    """Counts what it leaves out."""

    def __init__(self) -> None:
        self._counts: dict[tuple[str, str, str], int] = {}

    def without(self, name: str, batch: pa.RecordBatch) -> pa.RecordBatch:
        """Return events of this name with NULL in place of what makes no sense."""
        for place, field in enumerate(batch.schema):
            values = batch.column(place)
            if field.name in _TIMES:
                is_good, what = _is_time(values), "times"
            elif pa.types.is_string(field.type):
                longest = _LONGEST_SYMBOL if field.name == "symbol" else _LONGEST_NAME
                is_good, what = _is_short(values, longest), "names: too long"
            else:
                continue
            if is_good is None:
                continue
            self._count(name, field.name, what, pc.sum(pc.invert(is_good)).as_py())
            kept = pc.if_else(is_good, values, pa.scalar(None, values.type))
            batch = batch.set_column(place, field, kept)
        return batch

    def _count(self, name: str, column: str, what: str, bad: int) -> None:
        self._counts[name, column, what] = self._counts.get((name, column, what), 0) + bad

    def rows(self) -> Iterator[tuple[str, str, str, int]]:
        """Yield event, field, what its values cannot be, and how many were left out."""
        for key, count in sorted(self._counts.items()):
            yield *key, count


def _is_time(values: pa.Array) -> pa.Array | None:
    """Return which values are times, None if all of them are."""
    extent = pc.min_max(values).as_py()
    least, most = extent["min"], extent["max"]
    if least is None or -_LATEST_NS < least <= most < _LATEST_NS:
        return None
    return pc.and_(pc.greater(values, -_LATEST_NS), pc.less(values, _LATEST_NS))


def _is_short(values: pa.Array, longest: int) -> pa.Array | None:
    """Return which texts have at most so many bytes, None if all of them do."""
    lengths = pc.binary_length(values)
    if (pc.max(lengths).as_py() or 0) <= longest:
        return None
    return pc.less_equal(lengths, longest)
