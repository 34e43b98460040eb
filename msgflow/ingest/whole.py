"""Puts the layers of calls together, as far as they are in memory at the same time.

What is left apart loses nothing: the model joins it as it is. See `calls.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from msgflow.ingest.calls import CALLS, Call, apart, layers
from msgflow.ingest.catalogue import load
from msgflow.trace.numpy_arrow import is_valid, to_arrow, to_numpy

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

_NONE = -1
_NOT_AFTER = {call.not_after for call in CALLS if call.not_after}


def staged(batches: Sequence[tuple[str, pa.RecordBatch]]) -> Iterator[tuple[str, pa.RecordBatch]]:
    """Yield (table of `raw`, rows) of the events of a round, as `Sequences` placed them.

    Args:
        batches: (name of the tracepoint, rows).
    """
    tracepoints = load().tracepoints
    parts: dict[str, list[pa.RecordBatch]] = {layer.name: [] for layer in layers()}
    for name, rows in batches:
        if name in parts:
            parts[name].append(rows)
        else:
            yield tracepoints[name].table, rows
    given = {
        name: _Layer(rows[0] if len(rows) == 1 else pa.concat_batches(rows))
        for name, rows in parts.items()
        if rows
    }
    if not given:
        return
    others = [
        (name, to_numpy(rows["event_id"]))
        for name, rows in batches
        if name in _NOT_AFTER and name not in given
    ]
    places = _Places([*((name, layer.ids) for name, layer in given.items()), *others])
    for call in CALLS:
        if all(name in given for name in call.names):
            of_call = [given[name] for name in call.names]
            found = _found(call, of_call, places)
            if found[0].size:
                yield call.table, _joined(call, of_call, found)
                for layer, chosen in zip(of_call, found, strict=True):
                    layer.is_apart[chosen] = False
    for name, layer in given.items():
        if layer.is_apart.any():
            yield apart(tracepoints[name]), layer.left()


class _Layer:
    """The events of a tracepoint.

    Attributes:
        rows: the events.
        ids: their numbers.
        is_apart: which are in no whole call.
    """

    def __init__(self, rows: pa.RecordBatch) -> None:
        self.rows = rows
        self.ids: NDArray[np.int64] = to_numpy(rows["event_id"])
        self.is_apart = np.ones(rows.num_rows, np.bool_)

    def before(self, column: str, chosen: NDArray[Any]) -> NDArray[np.int64]:
        """Return the events that these rows follow, -1 for none."""
        found = self.rows[column]
        values: NDArray[np.int64] = to_numpy(found)[chosen]
        if found.null_count:
            values = np.where(is_valid(found)[chosen], values, _NONE)
        return values

    def left(self) -> pa.RecordBatch:
        """Return the events that are in no whole call."""
        if self.is_apart.all():
            return self.rows
        chosen = np.flatnonzero(self.is_apart)
        columns = [_chosen(column, chosen) for column in self.rows.columns]
        return pa.RecordBatch.from_arrays(columns, schema=self.rows.schema)


class _Places:
    """Where the events of a round are, by their ids."""

    def __init__(self, given: Sequence[tuple[str, NDArray[np.int64]]]) -> None:
        self._numbers = {name: number for number, name in enumerate(dict(given))}
        self.first = min(int(ids.min()) for _, ids in given)
        count = max(int(ids.max()) for _, ids in given) + 1 - self.first
        self._kinds = np.full(count, _NONE, np.int16)
        self._rows = np.zeros(count, np.int32)
        for name, ids in given:
            self._kinds[ids - self.first] = self._numbers[name]
            self._rows[ids - self.first] = np.arange(ids.size, dtype=np.int32)

    def rows(self, name: str, ids: NDArray[np.int64]) -> NDArray[np.int32]:
        """Return the rows of events of a tracepoint, -1 for those that are none of it."""
        if name not in self._numbers:
            return np.full(ids.size, _NONE, np.int32)
        places = np.maximum(ids - self.first, 0)
        is_found = (ids >= self.first) & (self._kinds[places] == self._numbers[name])
        return np.where(is_found, self._rows[places], np.int32(_NONE))


def _found(call: Call, layers: Sequence[_Layer], places: _Places) -> list[NDArray[Any]]:
    """Return the rows of each layer that are whole calls."""
    found: list[NDArray[Any]] = [np.arange(layers[-1].ids.size)]
    for place in range(len(layers) - 1, 0, -1):
        later, earlier = layers[place], layers[place - 1]
        rows = places.rows(call.names[place - 1], later.before(call.follows, found[0]))
        is_whole = rows != _NONE
        for column in ("trace_index", "cpu_id", call.same):
            is_whole &= _is_same(later.rows[column], found[0], earlier.rows[column], rows)
        found = [rows, *found]
        if not is_whole.all():
            found = [each[is_whole] for each in found]
    if call.not_after is not None:
        # What came before the round is not known.
        ids = layers[0].before(call.follows, found[0])
        is_begin = (ids == _NONE) | (ids >= places.first)
        is_begin &= places.rows(call.not_after, ids) == _NONE
        if not is_begin.all():
            found = [each[is_begin] for each in found]
    return found


def _is_same(
    left: pa.Array, of_left: NDArray[Any], right: pa.Array, of_right: NDArray[Any]
) -> NDArray[np.bool_]:
    """Tell where rows of two columns have the same value, and have one."""
    is_same: NDArray[np.bool_] = to_numpy(left)[of_left] == to_numpy(right)[of_right]
    if left.null_count or right.null_count:
        is_same &= is_valid(left)[of_left] & is_valid(right)[of_right]
    return is_same


def _joined(call: Call, layers: Sequence[_Layer], found: Sequence[NDArray[Any]]) -> pa.RecordBatch:
    """Return the rows of the table of whole calls."""
    is_all = [
        np.array_equal(rows, np.arange(layer.ids.size))
        for layer, rows in zip(layers, found, strict=True)
    ]
    columns = {}
    for name, (place, column) in call.columns.items():
        values = layers[place].rows[column]
        columns[name] = values if is_all[place] else _chosen(values, found[place])
    return pa.RecordBatch.from_pydict(columns)


def _chosen(column: pa.Array, rows: NDArray[Any]) -> pa.Array:
    """Return rows of a column of numbers.

    Arrow's own way would take memory that is never given back.
    """
    is_missing = ~is_valid(column)[rows] if column.null_count else None
    return to_arrow(to_numpy(column)[rows], is_missing)
