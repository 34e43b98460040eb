"""Sequences of events on threads: the thread of each event, and what it did before.

A *sequence* is a kind of events on one thread, such as begins and ends of callbacks; the catalogue
says which tracepoints belong to which. Only a reader has all events in hand in their total order:
looking for predecessors later would sort the largest tables there are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from msgflow.ingest.catalogue import Catalogue, Tracepoint
from msgflow.ingest.groups import NONE, Groups, Latest, Numbers, gathered, present
from msgflow.trace.columns import COMMON_SCHEMA
from msgflow.trace.numpy_arrow import is_valid, texts_to_arrow, to_arrow, to_numpy

Rows = tuple[str, pa.RecordBatch]  # of a table of `raw`

_LEADING = ("event_id", "ts_ns", "trace_index", "cpu_id")
_CONTEXTS = len(COMMON_SCHEMA)
# A thread that is made to change and to change back at once takes 22 us, and others do not come
# below 100 us, where that was measured.
_SHORTEST_RETURN_NS = 10_000


class Sequences:
    """State of all threads through the rounds of a reader, which must come in order."""

    def __init__(self, catalogue: Catalogue, hosts: Sequence[int]) -> None:
        """Start before the first event.

        `hosts` has a number for each trace index, which traces of the same host share.
        """
        self._labels = {label: number for number, label in enumerate(catalogue.labels)}
        self._label_texts = texts_to_arrow(catalogue.labels)
        self._bits = {name: 1 << bit for bit, name in enumerate(catalogue.sequences)}
        self._threads = _Threads(hosts)
        asked = {
            (before.sequence, before.origin)
            for tracepoint in catalogue.staged.values()
            for before in tracepoint.predecessors
        }
        self._latest = {
            name: Latest([origin for sequence, origin in asked if sequence == name])
            for name in catalogue.sequences
        }

    def place(self, batches: Sequence[tuple[Tracepoint, pa.RecordBatch]]) -> list[Rows]:
        """Return (table, rows) of the events of one round, with their threads and predecessors.

        `batches` has all wanted events of the round, in the order of the reader. What is new of
        threads comes with them.
        """
        sizes = [batch.num_rows for _, batch in batches]
        ends = np.cumsum([0, *sizes])
        known = self._threads.count
        ids = gathered(batches, "event_id")
        threads = self._threads.of(batches)
        groups = Groups(ids, threads)
        of_batches = [sum(self._bits[name] for name in each.sequences) for each, _ in batches]
        members = np.repeat(np.array(of_batches, np.uint8), sizes)[groups.rows]
        labels = [self._labels.get(each.label or "", NONE) for each, _ in batches]
        events = {
            "event_id": ids[groups.rows],
            "ts_ns": gathered(batches, "ts_ns")[groups.rows],
            "label": np.repeat(np.array(labels, np.int8), sizes)[groups.rows],
        }
        origins = {}
        for sequence, latest in self._latest.items():
            latest.grow(self._threads.count)
            origins[sequence] = latest.before(groups, members & self._bits[sequence], events)
        placed: list[Rows] = []
        for (tracepoint, batch), begin, end in zip(batches, ends[:-1], ends[1:], strict=True):
            columns = {column: batch[column] for column in _LEADING}
            columns["thread_index"] = to_arrow(threads[begin:end])
            for before in tracepoint.predecessors:
                values = origins[before.sequence][before.origin][groups.place[begin:end]]
                column = to_arrow(values, values == NONE)
                if before.origin == "label":
                    column = pa.DictionaryArray.from_arrays(column, self._label_texts)
                columns[before.column] = column
            for field in batch.schema.names[_CONTEXTS:]:
                columns[field] = batch[field]
            placed.append((tracepoint.table, pa.RecordBatch.from_pydict(columns)))
        return [
            *placed,
            *_new_threads(batches, threads, known),
            _names(batches, groups, events),
            *_cpu_returns(batches, groups, events),
        ]

    def place_readings(self, batches: Sequence[tuple[Tracepoint, pa.RecordBatch]]) -> list[Rows]:
        """Return (table, rows) of readings, with their threads; they begin and end no thread."""
        known = self._threads.count
        threads = self._threads.of(batches)
        ends = np.cumsum([0, *(batch.num_rows for _, batch in batches)])
        placed: list[Rows] = []
        for (tracepoint, batch), begin, end in zip(batches, ends[:-1], ends[1:], strict=True):
            columns = {column: batch[column] for column in _LEADING}
            columns["thread_index"] = to_arrow(threads[begin:end])
            columns |= {field: batch[field] for field in batch.schema.names[_CONTEXTS:]}
            placed.append((tracepoint.table, pa.RecordBatch.from_pydict(columns)))
        return [*placed, *_new_threads(batches, threads, known)]


class _Threads:
    """Numbers of threads, that is of (host, PID namespace, pid, tid), in order of appearance."""

    def __init__(self, hosts: Sequence[int]) -> None:
        self._hosts = np.asarray(hosts, np.int64)
        self._names, self._spaces, self._namespaces, self._threads = (Numbers() for _ in range(4))

    @property
    def count(self) -> int:
        return self._threads.count

    def of(self, batches: Sequence[tuple[Tracepoint, pa.RecordBatch]]) -> NDArray[np.int32]:
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
    batches: Sequence[tuple[Tracepoint, pa.RecordBatch]], threads: NDArray[np.int32], known: int
) -> Iterator[Rows]:
    """Yield the threads that were not there before, with a trace of their host."""
    fresh = np.flatnonzero(threads >= known)
    if fresh.size:
        found, first = np.unique(threads[fresh], return_index=True)
        rows = fresh[first]
        columns = {"thread_index": to_arrow(found)}
        for name in ("trace_index", "pid_ns", "vpid", "vtid"):
            is_missing = ~present(batches, name)[rows]
            columns[name] = to_arrow(gathered(batches, name)[rows], is_missing)
        yield "thread", pa.RecordBatch.from_pydict(columns)


def _names(
    batches: Sequence[tuple[Tracepoint, pa.RecordBatch]],
    groups: Groups,
    events: Mapping[str, NDArray[Any]],
) -> Rows:
    """Return the stretches of events of a thread under one name; several may follow each other."""
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
    names = to_arrow(codes[starts], codes[starts] == NONE)
    columns = {
        "thread_index": to_arrow(groups.groups[starts]),
        "procname": pa.DictionaryArray.from_arrays(names, encoded.chunks[0].dictionary),
        "first_event_id": to_arrow(events["event_id"][starts]),
        "last_event_id": to_arrow(events["event_id"][ends]),
        "first_seen_ns": to_arrow(events["ts_ns"][starts]),
        "last_seen_ns": to_arrow(events["ts_ns"][ends]),
    }
    return "thread_name", pa.RecordBatch.from_pydict(columns)


def _cpu_returns(
    batches: Sequence[tuple[Tracepoint, pa.RecordBatch]],
    groups: Groups,
    events: Mapping[str, NDArray[Any]],
) -> Iterator[Rows]:
    """Yield the events of a thread that changed its CPU twice faster than a thread can."""
    cpus = gathered(batches, "cpu_id")[groups.rows]
    is_change = np.append(False, cpus[1:] != cpus[:-1])
    is_change[groups.starts] = False
    changes = np.flatnonzero(is_change)
    first, second = changes[:-1], changes[1:]
    times = events["ts_ns"]
    is_fast = (groups.groups[first] == groups.groups[second]) & (
        times[second] - times[first - 1] < _SHORTEST_RETURN_NS
    )
    found = second[is_fast]
    if found.size:
        columns = {
            "thread_index": to_arrow(groups.groups[found]),
            "event_id": to_arrow(events["event_id"][found]),
        }
        yield "cpu_return", pa.RecordBatch.from_pydict(columns)
