"""Record batches of the events of one class."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from msgflow.trace.columns import first_inner_value, to_array
from msgflow.trace.ctf.arrays import list_array, number_array, scattered_array, text_array
from msgflow.trace.ctf.event_body import Kind
from msgflow.trace.ctf.gather import FieldRows
from msgflow.trace.ctf.thread_names import ThreadNames, word_offsets
from msgflow.trace.ctf.types import Scope
from msgflow.trace.numpy_arrow import to_arrow
from msgflow.trace.schemas import COMMON_SCHEMA

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from msgflow.trace.ctf.memory import Memory
    from msgflow.trace.ctf.plans import ClassPlan, Source
    from msgflow.trace.ctf.slow import PacketWalk

_WITHOUT_CONTEXT = {"vpid": -1, "vtid": -1}


@dataclass(frozen=True)
class EventRows:
    """Events of one class, in order of `event_id`.

    Attributes:
        event_ids: their numbers.
        ts_ns: their times.
        cpus: the CPU of each.
        has_cpu: which have one; None if all have.
        bodies: where contexts and payload begin: bytes of memory.
        positions: where headers begin: bytes of memory, or for slow streams bits of the packet.
        packets: which packet of the batch each is in.
    """

    event_ids: NDArray[np.int64]
    ts_ns: NDArray[np.int64]
    cpus: NDArray[np.int32]
    has_cpu: NDArray[np.bool_] | None
    bodies: NDArray[np.int64]
    positions: NDArray[np.int64]
    packets: NDArray[np.int32]

    def part(self, rows: slice) -> EventRows:
        """Return some of them."""
        return EventRows(
            self.event_ids[rows],
            self.ts_ns[rows],
            self.cpus[rows],
            None if self.has_cpu is None else self.has_cpu[rows],
            self.bodies[rows],
            self.positions[rows],
            self.packets[rows],
        )


def build_batch(
    plan: ClassPlan,
    memory: Memory,
    rows: EventRows,
    names: ThreadNames,
    walk_at: Callable[[int, int], tuple[PacketWalk, int]],
) -> pa.RecordBatch:
    """Build a batch.

    Args:
        plan: which fields to read.
        memory: where the packets are.
        rows: the events.
        names: the thread names seen so far.
        walk_at: from packet of the batch and position to the slow path and the bit.
    """
    count = rows.event_ids.size
    columns = {
        "event_id": to_arrow(rows.event_ids),
        "ts_ns": to_arrow(rows.ts_ns),
        "trace_index": to_arrow(np.full(count, plan.stream.trace_index, np.int32)),
        "cpu_id": to_arrow(rows.cpus, None if rows.has_cpu is None else ~rows.has_cpu),
    }
    field_of: _FastFields | _SlowFields
    if plan.is_slow:
        field_of = _SlowFields(rows, names, walk_at)
    else:
        field_of = _FastFields(plan, memory, rows, names)
    arrays = []
    for position, field in enumerate(plan.schema):
        is_common = position < len(COMMON_SCHEMA)
        source = (plan.contexts if is_common else plan.payload).get(field.name)
        if is_common and field.name in columns:
            arrays.append(columns[field.name])
        elif source is not None:
            arrays.append(field_of.array(source, field.type))
        elif not is_common and field.name in plan.inner:
            arrays.append(field_of.inner_array(plan.inner[field.name], field.type))
        elif is_common and field.name in _WITHOUT_CONTEXT:
            arrays.append(to_arrow(np.full(count, _WITHOUT_CONTEXT[field.name], np.int32)))
        else:
            arrays.append(pa.nulls(count, field.type))
    return pa.RecordBatch.from_arrays(arrays, schema=plan.schema)


class _FastFields:
    def __init__(
        self, plan: ClassPlan, memory: Memory, rows: EventRows, names: ThreadNames
    ) -> None:
        body = plan.layout.body
        sources = [*plan.contexts.values(), *plan.payload.values()]
        wanted = {source.number for source in sources if source.number is not None}
        self._fields = body.fields or ()
        self._names = names
        self._gathered: dict[tuple[int, Any], NDArray[Any]] = {}
        self._text_numbers: NDArray[np.int32] | None = None
        self._gatherer = gatherer = plan.gatherer
        texts = None if gatherer.text is None else names.texts(gatherer.text_length)
        gathered = gatherer.gather(memory, rows.bodies, texts)
        if gathered is not None:
            numbers, self._text_numbers = gathered
            self._gathered = dict(zip(gatherer.numbers, numbers, strict=True))
            wanted -= {gatherer.text, *(number for number, _ in gatherer.numbers)}
        with_tail = bool(plan.inner)
        self._rows = FieldRows(body, memory, rows.bodies, sorted(wanted), with_tail=with_tail)
        self._count = rows.bodies.size

    def array(self, source: Source, data_type: pa.DataType) -> pa.Array:
        number = source.number
        assert number is not None
        field = self._fields[number]
        if pa.types.is_dictionary(data_type):
            return self._thread_names(number)
        if field.kind is Kind.NUMBER:
            if not pa.types.is_boolean(data_type):
                gathered = self._gathered.get((number, np.dtype(data_type.to_pandas_dtype())))
                if gathered is not None:
                    return to_arrow(gathered)
            return number_array(self._rows.numbers(number), data_type)
        if pa.types.is_string(data_type):
            return text_array(*self._rows.text(number))
        return list_array(*self._rows.elements(number), data_type)

    def inner_array(self, paths: Sequence[Sequence[str]], data_type: pa.DataType) -> pa.Array:
        """Return a column of fields of the tail."""
        found = [self._rows.in_tail(".".join(path)) for path in paths]
        present = [values for values in found if values is not None]
        return scattered_array(present, self._count, data_type)

    def _thread_names(self, number: int) -> pa.Array:
        field = self._fields[number]
        if field.kind is Kind.TEXT and field.count:
            if self._text_numbers is not None and number == self._gatherer.text:
                indexes = self._names.indexes_of_texts(field.count, self._text_numbers)
                return self._names.array(indexes)
            words = [
                self._rows.words(number, "<u8", offset) for offset in word_offsets(field.count)
            ]
            return self._names.array(self._names.indexes(words, field.count))
        texts = text_array(*self._rows.text(number))
        return self._names.array_of(texts.to_pylist())


class _SlowFields:
    def __init__(
        self,
        rows: EventRows,
        names: ThreadNames,
        walk_at: Callable[[int, int], tuple[PacketWalk, int]],
    ) -> None:
        self._names = names
        self._events = []
        for packet, position in zip(rows.packets.tolist(), rows.positions.tolist(), strict=True):
            walk, bit = walk_at(packet, position)
            self._events.append(walk.event(bit))

    def array(self, source: Source, data_type: pa.DataType) -> pa.Array:
        values: list[Any] = [event[source.scope][source.name] for event in self._events]
        if pa.types.is_dictionary(data_type):
            return self._names.array_of(values)
        return to_array(values, data_type)

    def inner_array(self, paths: Sequence[Sequence[str]], data_type: pa.DataType) -> pa.Array:
        """Return a column of fields inside others; of several the first that an event has."""
        return to_array(
            [first_inner_value(event[Scope.PAYLOAD], paths) for event in self._events], data_type
        )
