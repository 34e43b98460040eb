"""Times of a result as other programs read them: seconds, or UTC as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy
import pyarrow
from pyarrow import compute

from msgflow.errors import UsageError
from msgflow.run.window import known_moments

if TYPE_CHECKING:
    from msgflow.run.choice import Run

_NS = "_ns"
_SECOND = 1e9


def converted(
    table: pyarrow.Table, units: Mapping[str, str], runs: Sequence[Run], times: str
) -> pyarrow.Table:
    """Return rows with their times in another form; `_ns` becomes `_s` or `_utc` in names."""
    if times == "ns":
        return table
    columns, names = [], []
    for name, column in zip(table.column_names, table.columns, strict=True):
        unit = units.get(name)
        suffix = ""
        if unit == "epoch ns":
            column, suffix = _moment(column, times, table, runs)
        elif unit == "ns":
            column, suffix = _seconds(column), "_s"
        renamed = name.removesuffix(_NS) + suffix if name.endswith(_NS) and suffix else name
        columns.append(column)
        names.append(renamed if renamed not in table.column_names else name)
    return pyarrow.table(columns, names=names)


def _moment(column: Any, times: str, table: pyarrow.Table, runs: Sequence[Run]) -> tuple[Any, str]:
    if times == "seconds":
        return _seconds(column), "_s"
    if times == "relative":
        return _seconds(compute.subtract(column, _starts(table, runs))), "_s"
    if times == "sim":
        return _simulated(column, known_moments(runs)), "_s"
    stamps = column.cast(pyarrow.timestamp("ns"))
    return compute.strftime(stamps, format="%Y-%m-%dT%H:%M:%SZ"), "_utc"


def _seconds(column: Any) -> Any:
    return compute.divide(column.cast(pyarrow.float64(), safe=False), _SECOND)


def _simulated(column: Any, moments: Sequence[tuple[int, int]]) -> Any:
    origin = moments[0][0]
    recorded = numpy.array([at - origin for at, _ in moments], dtype=numpy.float64)
    simulated = numpy.array([then for _, then in moments], dtype=numpy.float64)
    times = compute.subtract(column, origin).cast(pyarrow.float64(), safe=False).to_numpy()
    piece = numpy.clip(numpy.searchsorted(recorded, times, "right") - 1, 0, len(moments) - 2)
    pace = numpy.diff(simulated) / numpy.diff(recorded)
    found = simulated[piece] + (times - recorded[piece]) * pace[piece]
    return pyarrow.array(found / _SECOND, from_pandas=True)


def _starts(table: pyarrow.Table, runs: Sequence[Run]) -> Any:
    starts = {run.run_id: run.start_ns for run in runs}
    if "run_id" in table.column_names and len(starts) > 1:
        place = compute.index_in(
            table["run_id"], value_set=pyarrow.array(list(starts), pyarrow.int64())
        )
        return pyarrow.array(list(starts.values()), pyarrow.int64()).take(place.combine_chunks())
    if len(starts) != 1:
        raise UsageError("no row says which run it is of", "choose one with --run")
    (start,) = starts.values()
    return pyarrow.scalar(start, pyarrow.int64())
