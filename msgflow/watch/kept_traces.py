"""Chunks in memory as one set of traces, which an ingest reads like any other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from msgflow.trace import PACKET, EventBatch, TraceSet
from msgflow.trace.archive import Unpacked
from msgflow.trace.numpy_arrow import to_numpy
from msgflow.watch.kept_chunk import joined, placed, with_column

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.trace import TraceInfo
    from msgflow.trace.trace_set import Batches, Report, Wanted
    from msgflow.watch.kept_chunk import KeptChunk


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
        events: dict[str, list[pa.RecordBatch]] = {}
        for part, places, first in zip(self._parts, self._places, firsts[:-1], strict=True):
            for packets in part.packets:
                yield EventBatch(PACKET, placed(packets, places), 0)
            for name, batch in part.events.items():
                numbered = with_column(batch, "event_id", ids[first + to_numpy(batch["event_id"])])
                events.setdefault(name, []).append(placed(numbered, places))
        for name, batches in events.items():
            batch = joined(batches)
            by_id = np.argsort(to_numpy(batch["event_id"]), kind="stable")
            is_ordered = bool((by_id == np.arange(by_id.size)).all())
            yield EventBatch(name, batch if is_ordered else batch.take(by_id), 0)
