"""Sequences of events on threads: the thread of each event, and what it did before.

A *sequence* is a kind of events on one thread, such as begins and ends of callbacks; the catalogue
says which tracepoints belong to which. Only a reader has all events in hand in their total order:
looking for predecessors later would sort the largest tables there are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from msgflow.ingest.catalogue import Origin
from msgflow.trace import COMMON_SCHEMA
from msgflow.trace.numpy_arrow import empty_batch, is_valid, texts_to_arrow, to_arrow, to_numpy

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from msgflow.ingest.catalogue import Catalogue

THREAD_SCHEMA = pa.schema(
    [
        pa.field("thread_index", pa.int32(), nullable=False),
        pa.field("trace_index", pa.int32(), nullable=False),
        pa.field("pid_ns", pa.int64()),
        pa.field("vpid", pa.int32(), nullable=False),
        pa.field("vtid", pa.int32(), nullable=False),
    ]
)
"""Threads as their events name them; `trace_index` is a trace of their host."""

THREAD_NAME_SCHEMA = pa.schema(
    [
        pa.field("thread_index", pa.int32(), nullable=False),
        pa.field("procname", pa.dictionary(pa.int32(), pa.string())),
        pa.field("first_event_id", pa.int64(), nullable=False),
        pa.field("last_event_id", pa.int64(), nullable=False),
        pa.field("first_seen_ns", pa.int64(), nullable=False),
        pa.field("last_seen_ns", pa.int64(), nullable=False),
    ]
)
"""Stretches of events of a thread under one name; several may follow each other."""

CPU_RETURN_SCHEMA = pa.schema(
    [
        pa.field("thread_index", pa.int32(), nullable=False),
        pa.field("event_id", pa.int64(), nullable=False),
    ]
)
"""Events of a thread that changed its CPU twice faster than a thread can."""

_LEADING = ("event_id", "ts_ns", "trace_index", "cpu_id")
_CONTEXTS = len(COMMON_SCHEMA)
# A thread that is made to change and to change back at once takes 22 us, and others do not come
# below 100 us, where that was measured.
_SHORTEST_RETURN_NS = 10_000
_NONE = -1


@dataclass(frozen=True)
class Placed:
    """Events of a round with their threads and predecessors.

    Attributes:
        batches: (event name, batch), with the columns of the staging tables.
        threads: rows of `THREAD_SCHEMA` that were not there before.
        thread_names: rows of `THREAD_NAME_SCHEMA`.
        cpu_returns: rows of `CPU_RETURN_SCHEMA`.
    """

    batches: tuple[tuple[str, pa.RecordBatch], ...]
    threads: pa.RecordBatch
    thread_names: pa.RecordBatch
    cpu_returns: pa.RecordBatch


class Sequences:
    """State of all threads through the rounds of a reader, which must come in order."""

    def __init__(self, catalogue: Catalogue, hosts: Sequence[int]) -> None:
        """Start before the first event.

        Args:
            catalogue: says which sequences and predecessors there are.
            hosts: trace index -> a number that traces of the same host share.
        """
        self._tracepoints = catalogue.staged
        self._labels = catalogue.labels
        self._label_texts = texts_to_arrow(catalogue.labels)
        self._label_of = {
            name: _NONE if t.label is None else self._labels.index(t.label)
            for name, t in catalogue.staged.items()
        }
        self._bits = {name: 1 << bit for bit, name in enumerate(catalogue.sequences)}
        self._threads = _Threads(hosts)
        asked = {
            (before.sequence, before.origin)
            for tracepoint in catalogue.staged.values()
            for before in tracepoint.predecessors
        }
        self._latest = {
            name: _Latest([origin for origin in Origin if (name, origin) in asked])
            for name in catalogue.sequences
        }

    def place(self, batches: Sequence[tuple[str, pa.RecordBatch]]) -> Placed:
        """Give the events of one round their threads and predecessors.

        Args:
            batches: (name in `Catalogue.staged`, batch) of all wanted events of the round, as the
                reader delivers them.
        """
        sizes = [batch.num_rows for _, batch in batches]
        ends = np.cumsum([0, *sizes])
        known = self._threads.count
        ids = _gathered(batches, "event_id")
        threads = self._threads.of(batches)
        groups = _Groups(ids, threads)
        members = np.repeat([self._memberships(name) for name, _ in batches], sizes)[groups.rows]
        events = {
            Origin.EVENT_ID: ids[groups.rows],
            Origin.TS_NS: _gathered(batches, "ts_ns")[groups.rows],
            Origin.LABEL: np.repeat(
                np.array([self._label_of[name] for name, _ in batches], np.int8), sizes
            )[groups.rows],
        }
        origins = {}
        for sequence, latest in self._latest.items():
            latest.grow(self._threads.count)
            origins[sequence] = latest.before(groups, members & self._bits[sequence], events)
        placed = tuple(
            (
                name,
                self._extended(
                    name,
                    batch,
                    threads[begin:end],
                    [
                        origins[each.sequence][each.origin][groups.place[begin:end]]
                        for each in self._tracepoints[name].predecessors
                    ],
                ),
            )
            for (name, batch), begin, end in zip(batches, ends[:-1], ends[1:], strict=True)
        )
        return Placed(
            placed,
            _new_threads(batches, threads, known),
            _names(batches, groups, events),
            _cpu_returns(batches, groups, events),
        )

    def _memberships(self, name: str) -> np.uint8:
        return np.uint8(sum(self._bits[sequence] for sequence in self._tracepoints[name].sequences))

    def _extended(
        self,
        name: str,
        batch: pa.RecordBatch,
        threads: NDArray[np.int32],
        predecessors: Sequence[NDArray[Any]],
    ) -> pa.RecordBatch:
        columns = {column: batch[column] for column in _LEADING}
        columns["thread_index"] = to_arrow(threads)
        for predecessor, values in zip(
            self._tracepoints[name].predecessors, predecessors, strict=True
        ):
            is_missing = values == _NONE
            column = to_arrow(values, is_missing)
            if predecessor.origin is Origin.LABEL:
                column = pa.DictionaryArray.from_arrays(column, self._label_texts)
            columns[predecessor.column] = column
        for field in batch.schema.names[_CONTEXTS:]:
            columns[field] = batch[field]
        return pa.RecordBatch.from_pydict(columns)


class _Threads:
    """Numbers of threads, that is of (host, PID namespace, pid, tid), in order of appearance."""

    def __init__(self, hosts: Sequence[int]) -> None:
        self._hosts = np.asarray(hosts, np.int64)
        self._names, self._spaces, self._namespaces, self._threads = (_Numbers() for _ in range(4))

    @property
    def count(self) -> int:
        return self._threads.count

    def of(self, batches: Sequence[tuple[str, pa.RecordBatch]]) -> NDArray[np.int32]:
        """Return the thread of each event, batch after batch."""
        pairs = np.concatenate(
            [
                np.column_stack((to_numpy(batch["vpid"]), to_numpy(batch["vtid"])))
                for _, batch in batches
            ]
        )
        names = self._names.of(pairs.view(np.int64).reshape(-1))
        has_namespaces = any(batch["pid_ns"].null_count < batch.num_rows for _, batch in batches)
        if self._hosts.max() == 0 and not has_namespaces and self._namespaces.count == 0:
            return self._threads.of(names)
        spaces = self._hosts[_gathered(batches, "trace_index")] << 32
        if has_namespaces:
            given = [batch["pid_ns"] for _, batch in batches]
            values = np.concatenate(
                [np.where(is_valid(column), to_numpy(column), 0) for column in given]
            )
            spaces |= np.where(_present(batches, "pid_ns"), self._namespaces.of(values) + 1, 0)
        return self._threads.of(names | (self._spaces.of(spaces).astype(np.int64) << 32))


class _Numbers:
    """Numbers of values from 0, in order of appearance."""

    def __init__(self) -> None:
        self._values = np.empty(0, np.int64)
        self._numbers = np.empty(0, np.int32)

    @property
    def count(self) -> int:
        return self._values.size

    def of(self, given: NDArray[Any]) -> NDArray[np.int32]:
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


class _Groups:
    """Events ordered by thread and number.

    Attributes:
        rows: the events, as rows of the batches one after the other.
        place: where each row went.
        threads: the thread of each.
        starts: where each thread begins.
        ends: where each thread's last event is.
        start_of: where the thread of each begins.
    """

    def __init__(self, ids: NDArray[np.int64], threads: NDArray[np.int32]) -> None:
        count = ids.size
        numbers = np.arange(count, dtype=np.int32)
        first = ids.min()
        by_id = np.full(ids.max() - first + 1, _NONE, np.int32)
        by_id[ids - first] = numbers
        order = by_id if by_id.size == count else by_id[by_id != _NONE]
        # Numbers of 16 bits are sorted in linear time.
        is_short = threads.max() < 1 << 16
        keys = threads[order].astype(np.uint16 if is_short else np.uint32)
        self.rows = order[np.argsort(keys, kind="stable")]
        self.place = np.empty(count, np.int32)
        self.place[self.rows] = numbers
        self.threads = threads[self.rows]
        is_start = np.append(True, self.threads[1:] != self.threads[:-1])
        self.starts = np.flatnonzero(is_start).astype(np.int32)
        self.ends = np.append(self.starts[1:], count).astype(np.int32) - 1
        self.start_of = np.repeat(self.starts, self.ends + 1 - self.starts)


class _Latest:
    """The latest event of a sequence on each thread."""

    def __init__(self, origins: Sequence[Origin]) -> None:
        self._values = {origin: np.empty(0, np.int64) for origin in origins}

    def grow(self, count: int) -> None:
        for origin, values in self._values.items():
            more = np.full(count - values.size, _NONE, np.int64)
            self._values[origin] = np.append(values, more)

    def before(
        self,
        groups: _Groups,
        is_member: NDArray[Any],
        events: Mapping[Origin, NDArray[Any]],
    ) -> dict[Origin, NDArray[Any]]:
        """Return the latest event before each one of `groups`; remember the last of the round."""
        places = np.arange(is_member.size, dtype=np.int32)
        places[is_member == 0] = _NONE
        until = np.maximum.accumulate(places, out=places)
        before = np.empty_like(until)
        before[:1] = _NONE
        before[1:] = until[:-1]
        earlier = np.flatnonzero(before < groups.start_of)
        last = until[groups.ends]
        is_new = last >= groups.starts
        latest, threads = last[is_new], groups.threads[groups.starts[is_new]]
        result = {}
        for origin, carried in self._values.items():
            values = events[origin][before]
            values[earlier] = carried[groups.threads[earlier]]
            result[origin] = values
            carried[threads] = events[origin][latest]
        return result


def _new_threads(
    batches: Sequence[tuple[str, pa.RecordBatch]], threads: NDArray[np.int32], known: int
) -> pa.RecordBatch:
    fresh = np.flatnonzero(threads >= known)
    if not fresh.size:
        return empty_batch(THREAD_SCHEMA)
    found, first = np.unique(threads[fresh], return_index=True)
    rows = fresh[first]
    columns = [
        to_arrow(_gathered(batches, name)[rows], ~_present(batches, name)[rows])
        for name in THREAD_SCHEMA.names[1:]
    ]
    return pa.RecordBatch.from_arrays([to_arrow(found), *columns], schema=THREAD_SCHEMA)


def _names(
    batches: Sequence[tuple[str, pa.RecordBatch]],
    groups: _Groups,
    events: Mapping[Origin, NDArray[Any]],
) -> pa.RecordBatch:
    encoded = pa.chunked_array([batch["procname"] for _, batch in batches]).unify_dictionaries()
    codes = np.concatenate(
        [
            np.where(is_valid(chunk.indices), to_numpy(chunk.indices), np.int32(_NONE))
            for chunk in encoded.chunks
        ]
    )[groups.rows]
    is_start = np.append(True, codes[1:] != codes[:-1])
    is_start[groups.starts] = True
    starts = np.flatnonzero(is_start)
    ends = np.append(starts[1:], codes.size) - 1
    names = codes[starts]
    return pa.RecordBatch.from_arrays(
        [
            to_arrow(groups.threads[starts]),
            pa.DictionaryArray.from_arrays(
                to_arrow(names, names == _NONE), encoded.chunks[0].dictionary
            ),
            *(
                to_arrow(events[origin][at])
                for origin in (Origin.EVENT_ID, Origin.TS_NS)
                for at in (starts, ends)
            ),
        ],
        schema=THREAD_NAME_SCHEMA,
    )


def _cpu_returns(
    batches: Sequence[tuple[str, pa.RecordBatch]],
    groups: _Groups,
    events: Mapping[Origin, NDArray[Any]],
) -> pa.RecordBatch:
    cpus = _gathered(batches, "cpu_id")[groups.rows]
    is_change = np.append(False, cpus[1:] != cpus[:-1])
    is_change[groups.starts] = False
    changes = np.flatnonzero(is_change)
    first, second = changes[:-1], changes[1:]
    times = events[Origin.TS_NS]
    is_fast = (groups.threads[first] == groups.threads[second]) & (
        times[second] - times[first - 1] < _SHORTEST_RETURN_NS
    )
    found = second[is_fast]
    return pa.RecordBatch.from_arrays(
        [to_arrow(groups.threads[found]), to_arrow(events[Origin.EVENT_ID][found])],
        schema=CPU_RETURN_SCHEMA,
    )


def _gathered(batches: Sequence[tuple[str, pa.RecordBatch]], name: str) -> NDArray[Any]:
    return np.concatenate([to_numpy(batch[name]) for _, batch in batches])


def _present(batches: Sequence[tuple[str, pa.RecordBatch]], name: str) -> NDArray[np.bool_]:
    return np.concatenate([is_valid(batch[name]) for _, batch in batches])
