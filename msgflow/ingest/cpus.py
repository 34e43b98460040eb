"""What ran on each CPU: which thread had it when the kernel emitted an event, and what interrupts.

Only a reader has all events in hand in their total order: to find out in SQL what ran on a CPU
would sort the largest tables there are. Interrupts are not staged one event by the other, as there
are many of them: a waking says in which one it came, and those that interrupted a thread are rows
of `raw.interrupt`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from msgflow.ingest.catalogue import Catalogue, CpuRole, Tracepoint
from msgflow.ingest.groups import NONE, Groups, Latest, Numbers, gathered
from msgflow.trace.numpy_arrow import texts_to_arrow, to_arrow, to_numpy

# Table of `raw`: interrupts that were handled while a thread had the CPU.
INTERRUPT = "interrupt"

_SWITCH = ("event_id", "ts_ns", "tid", "number")
_HANDLING = ("event_id", "ts_ns", "is_open")


class Cpus:
    """State of all CPUs through the rounds of a reader, which must come in order."""

    def __init__(self, catalogue: Catalogue) -> None:
        """Start before the first event; the catalogue says which interrupts there are."""
        self._cpus = Numbers()
        self._counts = np.empty(0, np.int64)
        self._switches = Latest(_SWITCH)
        self._kinds = catalogue.interrupts
        self._handlings = [Latest(_HANDLING) for _ in self._kinds]

    def place(
        self, batches: Sequence[tuple[Tracepoint, pa.RecordBatch]]
    ) -> list[tuple[str, pa.RecordBatch]]:
        """Return (table, rows) of the events of one round that have a role on their CPU."""
        traces = gathered(batches, "trace_index").astype(np.int64)
        cpus = self._cpus.of(traces << 32 | gathered(batches, "cpu_id"))
        groups = Groups(gathered(batches, "event_id"), cpus)
        events = self._events(batches, groups)
        for latest in (self._switches, *self._handlings):
            latest.grow(self._cpus.count)
        switch = self._switches.before(groups, _has_role(batches, groups, "switch"), events)
        of_kinds = ([one.interrupt == kind for one, _ in batches] for kind in self._kinds)
        handlings = [
            latest.before(groups, _repeated(batches, groups, is_of), events)
            for is_of, latest in zip(of_kinds, self._handlings, strict=True)
        ]
        # An interrupt is being handled if it has begun behind the latest switch, and not ended.
        is_open = np.array(
            [(one["is_open"] == 1) & (one["event_id"] > switch["event_id"]) for one in handlings]
        ).reshape(len(handlings), -1)
        # Of several, the one that began last.
        innermost = np.where(is_open, [one["event_id"] for one in handlings], NONE)
        interrupt = np.where(is_open.any(axis=0), innermost.argmax(axis=0), NONE).astype(np.int32)
        ends = np.cumsum([0, *(batch.num_rows for _, batch in batches)])
        placed = []
        for (tracepoint, batch), begin, end in zip(batches, ends[:-1], ends[1:], strict=True):
            at = groups.place[begin:end]
            match tracepoint.role:
                case "switch":
                    is_known = switch["tid"][at] == to_numpy(batch["prev_tid"])
                    found = {
                        "run_start_ns": to_arrow(switch["ts_ns"][at], ~is_known),
                        "switch_number": to_arrow(events["number"][at]),
                    }
                    placed.append((tracepoint.table, _staged(tracepoint, batch, found)))
                case "waking":
                    before = switch["event_id"][at]
                    found = {
                        "switch_event_id": to_arrow(before, before == NONE),
                        "interrupt": self._named(interrupt[at]),
                    }
                    placed.append((tracepoint.table, _staged(tracepoint, batch, found)))
                case "end":
                    kind = self._kinds.index(tracepoint.interrupt or "")
                    is_whole = is_open[kind][at] & (switch["tid"][at] > 0)
                    start_ns = handlings[kind]["ts_ns"][at]
                    rows = self._interrupts(batch, kind, start_ns, switch["tid"][at], is_whole)
                    placed.append((INTERRUPT, rows))
        return placed

    def _events(
        self, batches: Sequence[tuple[Tracepoint, pa.RecordBatch]], groups: Groups
    ) -> Mapping[str, NDArray[np.int64]]:
        is_switch = _has_role(batches, groups, "switch")
        tids = [
            to_numpy(batch["next_tid"])
            if tracepoint.role == "switch"
            else np.zeros(batch.num_rows, np.int32)
            for tracepoint, batch in batches
        ]
        count: NDArray[np.int64] = np.cumsum(is_switch)
        earlier: NDArray[np.int64] = count[groups.starts] - is_switch[groups.starts]
        more = np.zeros(self._cpus.count - self._counts.size, np.int64)
        self._counts = np.append(self._counts, more)
        of_group = groups.groups[groups.starts]
        base = np.repeat(self._counts[of_group] - earlier, groups.ends + 1 - groups.starts)
        self._counts[of_group] += count[groups.ends] - earlier
        return {
            "event_id": gathered(batches, "event_id")[groups.rows],
            "ts_ns": gathered(batches, "ts_ns")[groups.rows],
            "tid": np.concatenate(tids).astype(np.int64)[groups.rows],
            "number": base + count - 1,
            "is_open": _has_role(batches, groups, "begin").astype(np.int64),
        }

    def _named(self, kinds: NDArray[np.int32]) -> pa.Array:
        indexes = to_arrow(kinds, kinds == NONE)
        return pa.DictionaryArray.from_arrays(indexes, texts_to_arrow(self._kinds))

    def _interrupts(
        self,
        batch: pa.RecordBatch,
        kind: int,
        start_ns: NDArray[np.int64],
        tids: NDArray[np.int64],
        is_whole: NDArray[np.bool_],
    ) -> pa.RecordBatch:
        chosen = np.flatnonzero(is_whole)
        return pa.RecordBatch.from_pydict(
            {
                "trace_index": to_arrow(to_numpy(batch["trace_index"])[chosen]),
                "kind": self._named(np.full(chosen.size, kind, np.int32)),
                "start_ns": to_arrow(start_ns[chosen]),
                "end_ns": to_arrow(to_numpy(batch["ts_ns"])[chosen]),
                "tid": to_arrow(tids[chosen].astype(np.int32)),
            }
        )


def _staged(
    tracepoint: Tracepoint, batch: pa.RecordBatch, found: Mapping[str, pa.Array]
) -> pa.RecordBatch:
    columns = {name: batch[name] for name, _ in tracepoint.common_columns}
    fields = {field.name: batch[field.name] for field in tracepoint.fields}
    return pa.RecordBatch.from_pydict({**columns, **found, **fields})


def _has_role(
    batches: Sequence[tuple[Tracepoint, pa.RecordBatch]], groups: Groups, role: CpuRole
) -> NDArray[np.bool_]:
    return _repeated(batches, groups, [tracepoint.role == role for tracepoint, _ in batches])


def _repeated(
    batches: Sequence[tuple[Any, pa.RecordBatch]], groups: Groups, values: Sequence[bool]
) -> NDArray[np.bool_]:
    sizes = [batch.num_rows for _, batch in batches]
    repeated: NDArray[np.bool_] = np.repeat(np.array(values, np.bool_), sizes)[groups.rows]
    return repeated
