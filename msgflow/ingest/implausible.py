"""Leaves out payload values that cannot be times or names: one of them must not end an ingest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pyarrow as pa

from msgflow.trace.numpy_arrow import is_valid, text_lengths, to_numpy, without

if TYPE_CHECKING:
    from collections.abc import Iterator

_TIMES = {"timestamp", "source_timestamp", "message_timestamp", "init_timestamp", "period"}
# 146 years in nanoseconds: differences of any two times fit, as they do in the reader.
_LATEST_NS = (1 << 62) - 1
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
                what, numbers, least, most = "times", to_numpy(values), -_LATEST_NS, _LATEST_NS
            elif pa.types.is_string(field.type):
                what, numbers, least = "names: too long", text_lengths(values), 0
                most = _LONGEST_SYMBOL if field.name == "symbol" else _LONGEST_NAME
            else:
                continue
            if not numbers.size or (least <= numbers.min() and numbers.max() <= most):
                continue
            bad = is_valid(values) & ~((least <= numbers) & (numbers <= most))
            if bad.any():
                self._count(name, field.name, what, int(bad.sum()))
                batch = batch.set_column(place, field, without(values, bad))
        return batch

    def _count(self, name: str, column: str, what: str, bad: int) -> None:
        self._counts[name, column, what] = self._counts.get((name, column, what), 0) + bad

    def rows(self) -> Iterator[tuple[str, str, str, int]]:
        """Yield event, field, what its values cannot be, and how many were left out."""
        for key, count in sorted(self._counts.items()):
            yield *key, count
