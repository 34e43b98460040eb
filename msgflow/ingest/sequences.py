"""What the order of the events says of each of them: its thread, and what that did before.

A *sequence* is a kind of events on one thread, such as begins and ends of callbacks; the catalogue
says which tracepoints belong to which. Only a reader has all events in hand in their total order:
looking for predecessors later would sort the largest tables there are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from msgflow.ingest.catalogue import Origin
from msgflow.trace import COMMON_SCHEMA

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from msgflow.ingest.catalogue import Catalogue, Predecessor

THREAD_SCHEMA = pa.schema(
    [
        pa.field("thread_index", pa.int32(), nullable=False),
        pa.field("trace_index", pa.int32(), nullable=False),
        pa.field("pid_ns", pa.int64()),
        pa.field("vpid", pa.int32(), nullable=False),
        pa.field("vtid", pa.int32(), nullable=False),
    ]
)
"""Threads by what their events say of them; `trace_index` is a trace of their host."""

THREAD_NAME_SCHEMA = pa.schema(
    [
        pa.field("thread_index", pa.int32(), nullable=False),
        pa.field("procname", pa.string()),
        pa.field("first_event_id", pa.int64(), nullable=False),
        pa.field("last_event_id", pa.int64(), nullable=False),
        pa.field("first_seen_ns", pa.int64(), nullable=False),
        pa.field("last_seen_ns", pa.int64(), nullable=False),
    ]
)
"""Stretches of events of a thread under one name; several may follow each other."""

_LEADING = ("event_id", "ts_ns", "trace_index", "cpu_id")
_CONTEXTS = len(COMMON_SCHEMA)
_NONE = -1


@dataclass(frozen=True)
class Placed:
    """Events of a round with what the order says of them.

    Attributes:
        batches: (event name, batch), with the columns of the staging tables.
        threads: rows of `THREAD_SCHEMA` that were not there before.
        thread_names: rows of `THREAD_NAME_SCHEMA`.
    """

    batches: tuple[tuple[str, pa.RecordBatch], ...]
    threads: pa.RecordBatch
    thread_names: pa.RecordBatch


class Sequences:
    """Follows all threads through the rounds of a reader, which it must be given in order."""

    def __init__(self, catalogue: Catalogue, hosts: Sequence[int]) -> None:
        """Start before the first event.

        Args:
            catalogue: says which sequences and predecessors there are.
            hosts: trace index -> a number that traces of the same host share.
        """
        self._tracepoints = catalogue.tracepoints
        self._labels = catalogue.labels
        self._label_of = {
            name: _NONE if t.label is None else self._labels.index(t.label)
            for name, t in catalogue.tracepoints.items()
        }

        self._hosts = np.asarray(hosts, np.int64)
        self._threads = _Numbers()
        self._processes = _Numbers()
        self._namespaces = _Numbers()
        asked = {
            (before.sequence, before.origin)
            for tracepoint in catalogue.tracepoints.values()
            for before in tracepoint.predecessors
        }
        self._latest = {
            name: _Latest([origin for origin in Origin if (name, origin) in asked])
            for name in catalogue.sequences
        }

    def place(self, batches: Sequence[tuple[str, pa.RecordBatch]]) -> Placed:
        """Give the events of one round their threads and predecessors.

        Args:
            batches: (event name, batch) of all wanted events of the round, as the reader
                delivers them.
        """
        sizes = [batch.num_rows for _, batch in batches]
        ends = np.cumsum([0, *sizes])
        ids = _gathered(batches, "event_id", np.int64)
        known = self._threads.count
        threads = self._threads_of(batches)
        order = np.argsort(ids, kind="stable")
        # Numbers of 16 bits are sorted in linear time.
        is_short = self._threads.count < 1 << 16
        keys = threads[order].astype(np.uint16 if is_short else np.uint32)
        groups = _Groups(order[np.argsort(keys, kind="stable")], threads)
        times = _gathered(batches, "ts_ns", np.int64)
        events = {
            Origin.EVENT_ID: ids,
            Origin.TS_NS: times,
            Origin.LABEL: np.repeat([self._label_of[name] for name, _ in batches], sizes),
        }
        origins: dict[str, dict[Origin, NDArray[np.int64]]] = {}
        for sequence, latest in self._latest.items():
            is_member = np.repeat(
                [sequence in self._tracepoints[name].sequences for name, _ in batches], sizes
            )
            latest.grow(self._threads.count)
            origins[sequence] = latest.before(groups, is_member, events)
        placed = tuple(
            (name, self._extended(name, batch, threads, origins, slice(begin, end)))
            for (name, batch), begin, end in zip(batches, ends[:-1], ends[1:], strict=True)
        )
        return Placed(
            placed,
            self._new_threads(batches, threads, known),
            _names(batches, groups, ids, times),
        )

    def _threads_of(self, batches: Sequence[tuple[str, pa.RecordBatch]]) -> NDArray[np.int32]:
        pids = _gathered(batches, "vpid", np.int64)
        tids = _gathered(batches, "vtid", np.int64)
        processes = self._processes.of((pids << 32) | (tids & 0xFFFFFFFF))
        hosts = self._hosts[_gathered(batches, "trace_index", np.int64)]
        if all(batch["pid_ns"].null_count == batch.num_rows for _, batch in batches):
            namespaces = np.zeros(pids.size, np.int64)
        else:
            values = [batch["pid_ns"] for _, batch in batches]
            numbers = np.concatenate([_filled(value) for value in values])
            has = np.concatenate([np.asarray(value.is_valid()) for value in values])
            namespaces = np.where(has, self._namespaces.of(numbers).astype(np.int64) + 1, 0)
        return self._threads.of(
            (processes.astype(np.int64) << 32) | (namespaces << 16) | hosts
        ).astype(np.int32)

    def _new_threads(
        self,
        batches: Sequence[tuple[str, pa.RecordBatch]],
        threads: NDArray[np.int32],
        known: int,
    ) -> pa.RecordBatch:
        found, first = np.unique(threads, return_index=True)
        first = first[found >= known]
        whole = {
            name: pa.chunked_array([batch[name] for _, batch in batches])
            for name in THREAD_SCHEMA.names[1:]
        }
        columns = [column.take(pa.array(first)).combine_chunks() for column in whole.values()]
        return pa.RecordBatch.from_arrays(
            [pa.array(found[found >= known], pa.int32()), *columns], schema=THREAD_SCHEMA
        )

    def _extended(
        self,
        name: str,
        batch: pa.RecordBatch,
        threads: NDArray[np.int32],
        origins: Mapping[str, Mapping[Origin, NDArray[np.int64]]],
        rows: slice,
    ) -> pa.RecordBatch:
        tracepoint = self._tracepoints[name]
        columns = {column: batch[column] for column in _LEADING}
        columns["thread_index"] = pa.array(threads[rows])
        for predecessor in tracepoint.predecessors:
            values = origins[predecessor.sequence]
            columns[predecessor.column] = self._column(predecessor, values, rows)
        for field in batch.schema.names[_CONTEXTS:]:
            columns[field] = batch[field]
        return pa.RecordBatch.from_pydict(columns)

    def _column(
        self, predecessor: Predecessor, values: Mapping[Origin, NDArray[np.int64]], rows: slice
    ) -> pa.Array:
        column = values[predecessor.origin][rows]
        is_missing = column == _NONE
        if predecessor.origin is not Origin.LABEL:
            return pa.array(column, mask=is_missing)
        codes = pa.array(column.astype(np.int8), mask=is_missing)
        return pa.DictionaryArray.from_arrays(codes, pa.array(self._labels))


class _Numbers:
    """Numbers values from 0 in the order in which they are first seen."""

    def __init__(self) -> None:
        self._values = np.empty(0, np.int64)
        self._numbers = np.empty(0, np.int64)

    @property
    def count(self) -> int:
        return self._values.size

    def of(self, values: NDArray[np.int64]) -> NDArray[np.int64]:
        places = np.searchsorted(self._values, values)
        is_known = places < self._values.size
        is_known[is_known] = self._values[places[is_known]] == values[is_known]
        if not is_known.all():
            fresh, first = np.unique(values[~is_known], return_index=True)
            rank = np.empty(fresh.size, np.int64)
            rank[np.argsort(first)] = np.arange(fresh.size)
            merged = np.concatenate([self._values, fresh])
            numbers = np.concatenate([self._numbers, self._values.size + rank])
            sort = np.argsort(merged)
            self._values, self._numbers = merged[sort], numbers[sort]
            places = np.searchsorted(self._values, values)
        return self._numbers[places]


class _Groups:
    """Events ordered by thread and number.

    Attributes:
        rows: the events, as rows of the batches one after the other.
        threads: the thread of each.
        starts: where each thread begins.
        start_of: where the thread of each begins.
    """

    def __init__(self, rows: NDArray[np.int64], threads: NDArray[np.int32]) -> None:
        self.rows = rows
        self.threads = threads[rows]
        is_start = np.empty(rows.size, np.bool_)
        is_start[:1] = True
        is_start[1:] = self.threads[1:] != self.threads[:-1]
        self.starts = np.flatnonzero(is_start)
        sizes = np.diff(np.append(self.starts, rows.size))
        self.start_of = np.repeat(self.starts, sizes)


class _Latest:
    """What is known of the latest event of a sequence on each thread."""

    def __init__(self, origins: Sequence[Origin]) -> None:
        self._values = {origin: np.empty(0, np.int64) for origin in origins}

    def grow(self, count: int) -> None:
        for origin, values in self._values.items():
            more = np.full(count - values.size, _NONE, np.int64)
            self._values[origin] = np.append(values, more)

    def before(
        self,
        groups: _Groups,
        is_member: NDArray[np.bool_],
        events: Mapping[Origin, NDArray[np.int64]],
    ) -> dict[Origin, NDArray[np.int64]]:
        """Return what is latest before each event, and go on to the end of the round."""
        count = groups.rows.size
        until = np.maximum.accumulate(np.where(is_member[groups.rows], np.arange(count), _NONE))
        before = np.append(_NONE, until[:-1])
        is_earlier = before < groups.start_of
        earlier = groups.threads[is_earlier]
        ends = np.append(groups.starts[1:], count) - 1
        is_new = until[ends] >= groups.starts
        latest, threads = until[ends][is_new], groups.threads[groups.starts[is_new]]
        result = {}
        for origin, carried in self._values.items():
            values = events[origin][groups.rows]
            column = values[before]
            column[is_earlier] = carried[earlier]
            result[origin] = np.empty_like(column)
            result[origin][groups.rows] = column
            carried[threads] = values[latest]
        return result


def _names(
    batches: Sequence[tuple[str, pa.RecordBatch]],
    groups: _Groups,
    ids: NDArray[np.int64],
    times: NDArray[np.int64],
) -> pa.RecordBatch:
    encoded = pa.chunked_array([batch["procname"] for _, batch in batches]).unify_dictionaries()
    codes = np.concatenate(
        [np.asarray(chunk.indices.fill_null(_NONE)) for chunk in encoded.chunks]
    )[groups.rows]
    is_start = np.empty(codes.size, np.bool_)
    is_start[:1] = True
    is_start[1:] = codes[1:] != codes[:-1]
    is_start[groups.starts] = True
    starts = np.flatnonzero(is_start)
    ends = np.append(starts[1:], codes.size) - 1
    names = encoded.chunks[0].dictionary.take(pa.array(codes[starts], mask=codes[starts] == _NONE))
    first, last = groups.rows[starts], groups.rows[ends]
    return pa.RecordBatch.from_arrays(
        [
            pa.array(groups.threads[starts], pa.int32()),
            names.cast(pa.string()),
            *(pa.array(column) for column in (ids[first], ids[last], times[first], times[last])),
        ],
        schema=THREAD_NAME_SCHEMA,
    )


def _gathered(
    batches: Sequence[tuple[str, pa.RecordBatch]], name: str, data_type: type[np.int64]
) -> NDArray[np.int64]:
    return np.concatenate([np.asarray(batch[name]) for _, batch in batches]).astype(data_type)


def _filled(values: pa.Array) -> NDArray[np.int64]:
    return np.asarray(values.fill_null(0))
