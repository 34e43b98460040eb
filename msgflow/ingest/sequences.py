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
from msgflow.ingest.groups import NONE, Groups, Latest, Numbers, gathered, present
from msgflow.trace.columns import COMMON_SCHEMA
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


@dataclass(frozen=True)
class Placed:
    """Events of a round with their threads and predecessors."""

    # (event name, batch), with the columns of the staging tables.
    batches: tuple[tuple[str, pa.RecordBatch], ...]
    threads: pa.RecordBatch  # rows of `THREAD_SCHEMA` that were not there before
    thread_names: pa.RecordBatch  # rows of `THREAD_NAME_SCHEMA`
    cpu_returns: pa.RecordBatch  # rows of `CPU_RETURN_SCHEMA`


class Sequences:
    """State of all threads through the rounds of a reader, which must come in order."""

    def __init__(self, catalogue: Catalogue, hosts: Sequence[int]) -> None:
        """Start before the first event.

        `hosts` has a number for each trace index, which traces of the same host share.
        """
        self._tracepoints = catalogue.staged
        self._labels = catalogue.labels
        self._label_texts = texts_to_arrow(catalogue.labels)
        self._label_of = {
            name: NONE if t.label is None else self._labels.index(t.label)
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
            name: Latest([origin for origin in Origin if (name, origin) in asked])
            for name in catalogue.sequences
        }

    def place(self, batches: Sequence[tuple[str, pa.RecordBatch]]) -> Placed:
        """Give the events of one round their threads and predecessors.

        `batches` has all wanted events of the round, in the order of the reader, each batch with
        its name in `Catalogue.staged`.
        """
        sizes = [batch.num_rows for _, batch in batches]
        ends = np.cumsum([0, *sizes])
        known = self._threads.count
        ids = gathered(batches, "event_id")
        threads = self._threads.of(batches)
        groups = Groups(ids, threads)
        of_names = [sum(self._bits[s] for s in self._tracepoints[n].sequences) for n, _ in batches]
        members = np.repeat(np.array(of_names, np.uint8), sizes)[groups.rows]
        events = {
            Origin.EVENT_ID: ids[groups.rows],
            Origin.TS_NS: gathered(batches, "ts_ns")[groups.rows],
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
            is_missing = values == NONE
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
        self._names, self._spaces, self._namespaces, self._threads = (Numbers() for _ in range(4))

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
        spaces = self._hosts[gathered(batches, "trace_index")] << 32
        if has_namespaces:
            given = [batch["pid_ns"] for _, batch in batches]
            values = np.concatenate(
                [np.where(is_valid(column), to_numpy(column), 0) for column in given]
            )
            spaces |= np.where(present(batches, "pid_ns"), self._namespaces.of(values) + 1, 0)
        return self._threads.of(names | (self._spaces.of(spaces).astype(np.int64) << 32))


def _new_threads(
    batches: Sequence[tuple[str, pa.RecordBatch]], threads: NDArray[np.int32], known: int
) -> pa.RecordBatch:
    fresh = np.flatnonzero(threads >= known)
    if not fresh.size:
        return empty_batch(THREAD_SCHEMA)
    found, first = np.unique(threads[fresh], return_index=True)
    rows = fresh[first]
    columns = [
        to_arrow(gathered(batches, name)[rows], ~present(batches, name)[rows])
        for name in THREAD_SCHEMA.names[1:]
    ]
    return pa.RecordBatch.from_arrays([to_arrow(found), *columns], schema=THREAD_SCHEMA)


def _names(
    batches: Sequence[tuple[str, pa.RecordBatch]],
    groups: Groups,
    events: Mapping[Origin, NDArray[Any]],
) -> pa.RecordBatch:
    encoded = pa.chunked_array([batch["procname"] for _, batch in batches]).unify_dictionaries()
    codes = np.concatenate(
        [
            np.where(is_valid(chunk.indices), to_numpy(chunk.indices), np.int32(NONE))
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
            to_arrow(groups.groups[starts]),
            pa.DictionaryArray.from_arrays(
                to_arrow(names, names == NONE), encoded.chunks[0].dictionary
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
    groups: Groups,
    events: Mapping[Origin, NDArray[Any]],
) -> pa.RecordBatch:
    cpus = gathered(batches, "cpu_id")[groups.rows]
    is_change = np.append(False, cpus[1:] != cpus[:-1])
    is_change[groups.starts] = False
    changes = np.flatnonzero(is_change)
    first, second = changes[:-1], changes[1:]
    times = events[Origin.TS_NS]
    is_fast = (groups.groups[first] == groups.groups[second]) & (
        times[second] - times[first - 1] < _SHORTEST_RETURN_NS
    )
    found = second[is_fast]
    return pa.RecordBatch.from_arrays(
        [to_arrow(groups.groups[found]), to_arrow(events[Origin.EVENT_ID][found])],
        schema=CPU_RETURN_SCHEMA,
    )
