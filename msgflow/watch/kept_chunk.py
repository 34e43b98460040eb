"""Chunks kept in memory as the reader delivered them, and read again as one set of traces."""

from __future__ import annotations

import os
import socket
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from msgflow import trace as trace_package
from msgflow.ingest.catalogue import load
from msgflow.ingest.load import wanted_events
from msgflow.ingest.readings import with_counters
from msgflow.trace import PACKET, Continuation, Damage, EventBatch, TraceInfo, TraceSet
from msgflow.trace.archive import Unpacked
from msgflow.trace.numpy_arrow import to_arrow, to_numpy
from msgflow.trace.trace_set import Batches, Report, Wanted
from msgflow.watch.chunk import Chunk

# The tracer of Python nodes says with it also what a callback took that has ended.
_REGISTERED = "ros2:rclcpp_callback_register"
_PAST = "^#msgflow (cpu|collect)"


@dataclass(frozen=True, eq=False)
class KeptChunk:
    """The content of a chunk."""

    source: Path  # the recording that it is a part of
    path: Path  # its directory, which need not exist any more
    traces: tuple[TraceInfo, ...]  # what its traces declare
    # By name, in order of `event_id`, which counts those that are kept from 0.
    events: Mapping[str, pa.RecordBatch]
    times_ns: NDArray[np.int64]  # of all events that are kept, by `event_id`
    packets: tuple[pa.RecordBatch, ...]
    # (trace index, event name) -> events read, kept or not.
    event_counts: Mapping[tuple[int, str], int]
    damages: tuple[Damage, ...]
    begin_ns: int  # when its first packet began
    end_ns: int  # when its last packet ended

    @property
    def last_event_ns(self) -> int:
        """When its last event happened; its end if it has none."""
        return int(self.times_ns[-1]) if self.times_ns.size else self.end_ns

    def lasting(self) -> KeptChunk | None:
        """Return what stays true when the chunk has passed: objects, names; else None.

        It has no packets: nothing of it tells what was lost.
        """
        catalogue = load().in_traces
        kept = {name: batch for name, batch in self.events.items() if catalogue[name].is_lasting}
        if not kept:
            return None
        if (registered := kept.get(_REGISTERED)) is not None:
            is_past = pc.match_substring_regex(registered["symbol"].cast(pa.string()), _PAST)
            kept[_REGISTERED] = registered.filter(pc.invert(is_past))
        return replace(self, packets=(), event_counts={}, damages=(), **_renumbered(kept))

    def followed_by(self, later: KeptChunk) -> KeptChunk:
        """Return what lasts of both, this and a later chunk of the same source."""
        traces = list(self.traces)
        indexes = {trace.identity: trace.index for trace in traces}
        for trace in later.traces:
            if trace.identity not in indexes:
                indexes[trace.identity] = len(traces)
                traces.append(replace(trace, index=len(traces)))
        places = [indexes[trace.identity] for trace in later.traces]
        events = {name: [batch] for name, batch in self.events.items()}
        for name, batch in later.events.items():
            ids = to_numpy(batch["event_id"]) + self.times_ns.size
            events.setdefault(name, []).append(
                _placed(_with_column(batch, "event_id", ids), places)
            )
        return replace(
            later,
            traces=tuple(traces),
            events={name: _joined(batches) for name, batches in events.items()},
            times_ns=np.concatenate([self.times_ns, later.times_ns]),
            begin_ns=self.begin_ns,
        )


class KeptTraces(TraceSet):
    """Chunks that follow each other, behind what lasts of earlier ones."""

    def __init__(self, lasting: Sequence[KeptChunk], chunks: Sequence[KeptChunk]) -> None:
        """Join them."""
        super().__init__(Unpacked([]))
        self._parts = (*lasting, *chunks)
        traces: list[TraceInfo] = []
        # Of each part: its trace index -> that in the set.
        self._places: list[list[int]] = []
        # One trace stands for all that is left of a recording.
        places: dict[str, int] = {}
        begin_ns = min(chunk.begin_ns for chunk in chunks)
        for part in lasting:
            own = []
            for trace in part.traces:
                place = places.setdefault(trace.identity, len(traces))
                if place == len(traces):
                    # The set begins with its packets, however long ago its objects were made.
                    short = replace(trace, index=place, begin_ns=begin_ns, end_ns=begin_ns)
                    traces.append(short)
                own.append(place)
            self._places.append(own)
        for chunk in chunks:
            self._places.append([len(traces) + trace.index for trace in chunk.traces])
            traces += [replace(trace, index=len(traces) + trace.index) for trace in chunk.traces]
        self.traces = tuple(traces)
        counts: Counter[tuple[int, str]] = Counter()
        for part, places_of_part in zip(self._parts, self._places, strict=True):
            for (index, name), count in part.event_counts.items():
                counts[places_of_part[index], name] += count
        self.event_counts = dict(counts)
        self.damages = [
            replace(damage, trace_index=places_of_part[damage.trace_index])
            for part, places_of_part in zip(self._parts, self._places, strict=True)
            for damage in part.damages
        ]

    def _batches(self, wanted: Wanted, progress: Report | None, batch_rows: int) -> Batches:
        # In one round. What is wanted was decided when the chunks were read.
        firsts = np.cumsum([0, *(part.times_ns.size for part in self._parts)])
        # Chunks overlap: the buffers of one CPU are exchanged after those of another.
        order = np.argsort(np.concatenate([part.times_ns for part in self._parts]), kind="stable")
        ids = np.empty_like(order)
        ids[order] = np.arange(order.size)
        # Sessions differ in the counters that they read.
        events: dict[tuple[str, tuple[str, ...]], list[pa.RecordBatch]] = {}
        for part, places, first in zip(self._parts, self._places, firsts[:-1], strict=True):
            for packets in part.packets:
                yield EventBatch(PACKET, _placed(packets, places), 0)
            for name, batch in part.events.items():
                numbered = _with_column(batch, "event_id", ids[first + to_numpy(batch["event_id"])])
                key = name, tuple(batch.schema.names)
                events.setdefault(key, []).append(_placed(numbered, places))
        for (name, _), batches in events.items():
            batch = _joined(batches)
            by_id = np.argsort(to_numpy(batch["event_id"]), kind="stable")
            is_ordered = bool((by_id == np.arange(by_id.size)).all())
            yield EventBatch(name, batch if is_ordered else batch.take(by_id), 0)


def read_chunk(chunk: Chunk, after: Continuation, *, without_own: bool = False) -> KeptChunk | None:
    """Read a chunk into memory; None if nothing was recorded in it.

    `after` holds the chunks read before, and takes this one in: a chunk can be read only once.
    `without_own` leaves out what this process did: it has a node.
    """
    # LTTng also cuts the time before the first program, into chunks without any file.
    if not any(path.is_file() for path in chunk.path.rglob("*")):
        return None
    events: dict[str, list[pa.RecordBatch]] = {}
    packets = []
    with trace_package.open([chunk.path], after=after) as traces:
        for batch in traces.batches(with_counters(wanted_events(), traces.traces)):
            if batch.name == PACKET:
                packets.append(batch.batch)
            else:
                rows = batch.batch
                if without_own:
                    rows = _of_others(rows, traces.traces)
                events.setdefault(batch.name, []).append(rows)
        begins = [trace.begin_ns for trace in traces.traces if trace.begin_ns is not None]
        ends = [trace.end_ns for trace in traces.traces if trace.end_ns is not None]
        if not begins or not ends:
            return None
        end_ns = max(ends)
        if packets:
            packets.append(_last_packets(packets, end_ns))
        return KeptChunk(
            source=chunk.source,
            path=chunk.path,
            traces=traces.traces,
            packets=tuple(packets),
            event_counts=dict(traces.event_counts),
            damages=tuple(traces.damages),
            begin_ns=min(begins),
            end_ns=end_ns,
            **_renumbered({name: _joined(batches) for name, batches in events.items()}),
        )


def _of_others(batch: pa.RecordBatch, traces: Sequence[TraceInfo]) -> pa.RecordBatch:
    """Return the events that this process did not record."""
    here = socket.gethostname()
    ours = [one.index for one in traces if one.domain == "ust" and one.hostname == here]
    is_own = pc.and_(
        pc.equal(batch["vpid"], os.getpid()),
        pc.is_in(batch["trace_index"], pa.array(ours, pa.int32())),
    )
    return batch.filter(pc.invert(is_own)) if pc.any(is_own).as_py() else batch


def _last_packets(packets: list[pa.RecordBatch], end_ns: int) -> pa.RecordBatch:
    """Return an empty packet to the end of the chunk for each stream that ends before.

    Stopping writes one into every stream, but a rotation does not where nothing happened: the
    stream of a CPU that was idle would seem to be lost.
    """
    streams = (
        pa.Table.from_batches(packets)
        .group_by(
            ["trace_index", "stream_index", "stream_class_id", "stream_instance_id", "cpu_id"]
        )
        .aggregate([("position", "max"), ("end_ns", "max"), ("is_numbered", "all")])
    )
    early = streams.filter(pc.field("end_ns_max") < end_ns)
    count = early.num_rows
    columns = {
        **{name: early[name] for name in early.column_names},
        "position": pc.add(early["position_max"], 1),
        "begin_ns": early["end_ns_max"],
        "end_ns": pa.repeat(end_ns, count),
        "last_event_ns": pa.nulls(count),
        "event_count": pa.repeat(0, count),
        "discarded_event_count": pa.repeat(0, count),
        "lost_packet_count": pa.repeat(0, count),
        "is_numbered": early["is_numbered_all"],
    }
    schema = packets[0].schema
    table = pa.table([columns[name] for name in schema.names], names=schema.names).cast(schema)
    return table.combine_chunks().to_batches()[0] if count else packets[0].slice(0, 0)


def _joined(batches: list[pa.RecordBatch]) -> pa.RecordBatch:
    """Return the rows of batches of one schema as one batch."""
    table = pa.Table.from_batches(batches).unify_dictionaries().combine_chunks()
    return table.to_batches()[0] if table.num_rows else batches[0]


def _placed(batch: pa.RecordBatch, places: Sequence[int]) -> pa.RecordBatch:
    """Return a batch with other indexes of traces: the place of each one so far."""
    indexes = to_numpy(batch["trace_index"])
    return _with_column(batch, "trace_index", np.asarray(places, np.int32)[indexes])


def _with_column(batch: pa.RecordBatch, name: str, values: NDArray[Any]) -> pa.RecordBatch:
    """Return a batch with other values in a column."""
    place = batch.schema.get_field_index(name)
    return batch.set_column(place, batch.schema.field(place), to_arrow(values))


def _renumbered(events: Mapping[str, pa.RecordBatch]) -> dict[str, Any]:
    """Return `events` and `times_ns` of a chunk that keeps these events."""
    nothing = np.empty(0, np.int64)
    ids = np.concatenate([nothing, *(to_numpy(batch["event_id"]) for batch in events.values())])
    times = np.concatenate([nothing, *(to_numpy(batch["ts_ns"]) for batch in events.values())])
    order = np.argsort(ids)
    ranks = np.empty_like(order)
    ranks[order] = np.arange(order.size)
    ends = np.cumsum([batch.num_rows for batch in events.values()])
    numbered = {
        name: _with_column(batch, "event_id", ranks[end - batch.num_rows : end])
        for (name, batch), end in zip(events.items(), ends, strict=True)
    }
    return {"events": numbered, "times_ns": times[order]}
