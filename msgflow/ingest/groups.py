"""Events of groups, such as those of a thread or of a CPU, and what came before each of them."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from msgflow.trace.numpy_arrow import is_valid, to_numpy

NONE = -1
"""Stands for what is not there: times, numbers and identities are not negative."""


class Numbers:
    """Numbers of values from 0, in order of appearance."""

    def __init__(self) -> None:
        self._values = np.empty(0, np.int64)
        self._numbers = np.empty(0, np.int32)

    @property
    def count(self) -> int:
        """How many there are."""
        return self._values.size

    def of(self, given: NDArray[Any]) -> NDArray[np.int32]:
        """Return the number of each value."""
        values: NDArray[np.int64] = given.astype(np.int64, copy=False)
        if self.count == 0:
            self._add(values)
        places = np.searchsorted(self._values[1:], values, side="right")
        is_new = self._values[places] != values
        if is_new.any():
            self._add(values[is_new])
            places = np.searchsorted(self._values[1:], values, side="right")
        return self._numbers[places]

    def _add(self, values: NDArray[np.int64]) -> None:
        fresh, first = np.unique(values, return_index=True)
        numbers = np.empty(fresh.size, np.int32)
        numbers[np.argsort(first)] = np.arange(self.count, self.count + fresh.size)
        merged = np.concatenate([self._values, fresh])
        order = np.argsort(merged)
        self._values = merged[order]
        self._numbers = np.concatenate([self._numbers, numbers])[order]


class Groups:
    """Events ordered by group and number."""

    def __init__(self, ids: NDArray[np.int64], of_groups: NDArray[np.int32]) -> None:
        count = ids.size
        numbers = np.arange(count, dtype=np.int32)
        first = ids.min()
        by_id = np.full(ids.max() - first + 1, NONE, np.int32)
        by_id[ids - first] = numbers
        order = by_id if by_id.size == count else by_id[by_id != NONE]
        # Numbers of 16 bits are sorted in linear time.
        is_short = of_groups.max() < 1 << 16
        keys = of_groups[order].astype(np.uint16 if is_short else np.uint32)
        # The events, as rows of the batches one after the other.
        self.rows = order[np.argsort(keys, kind="stable")]
        self.place = np.empty(count, np.int32)  # where each row went
        self.place[self.rows] = numbers
        self.groups = of_groups[self.rows]  # the group of each
        is_start = np.append(True, self.groups[1:] != self.groups[:-1])
        self.starts = np.flatnonzero(is_start).astype(np.int32)  # where each group begins
        # Where each group's last event is.
        self.ends = np.append(self.starts[1:], count).astype(np.int32) - 1
        # Where the group of each begins.
        self.start_of = np.repeat(self.starts, self.ends + 1 - self.starts)


class Latest:
    """The latest event of a sequence in each group."""

    def __init__(self, origins: Sequence[Hashable]) -> None:
        self._values = {origin: np.empty(0, np.int64) for origin in origins}

    def grow(self, count: int) -> None:
        """Make room for so many groups."""
        for origin, values in self._values.items():
            more = np.full(count - values.size, NONE, np.int64)
            self._values[origin] = np.append(values, more)

    def before(
        self, groups: Groups, is_member: NDArray[Any], events: Mapping[Any, NDArray[Any]]
    ) -> dict[Any, NDArray[Any]]:
        """Return the latest event before each one of `groups`; remember the last of the round."""
        places = np.arange(is_member.size, dtype=np.int32)
        places[is_member == 0] = NONE
        until = np.maximum.accumulate(places, out=places)
        before = np.empty_like(until)
        before[:1] = NONE
        before[1:] = until[:-1]
        earlier = np.flatnonzero(before < groups.start_of)
        last = until[groups.ends]
        is_new = last >= groups.starts
        latest, threads = last[is_new], groups.groups[groups.starts[is_new]]
        result = {}
        for origin, carried in self._values.items():
            values = events[origin][before]
            values[earlier] = carried[groups.groups[earlier]]
            result[origin] = values
            carried[threads] = events[origin][latest]
        return result


def gathered(batches: Sequence[tuple[Any, pa.RecordBatch]], name: str) -> NDArray[Any]:
    """Return a column of batches, one after the other."""
    return np.concatenate([to_numpy(batch[name]) for _, batch in batches])


def present(batches: Sequence[tuple[Any, pa.RecordBatch]], name: str) -> NDArray[np.bool_]:
    """Return where a column of batches has values."""
    return np.concatenate([is_valid(batch[name]) for _, batch in batches])
