"""Record batches of the events of one class: which field fills which column, and how."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from msgflow.trace.columns import COMMON_SCHEMA, first_inner_value, paths_of, to_array
from msgflow.trace.ctf.arrow import (
    declared_schema,
    list_array,
    number_array,
    scattered_array,
    text_array,
)
from msgflow.trace.ctf.event_body import Kind
from msgflow.trace.ctf.field_columns import FieldRows
from msgflow.trace.ctf.field_types import Scope, Structure
from msgflow.trace.numpy_arrow import integers_to_arrow, texts_to_arrow, to_arrow, to_numpy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from msgflow.trace.ctf.event_order import Batch
    from msgflow.trace.ctf.field_reader import EventReader
    from msgflow.trace.ctf.packet_memory import Memory
    from msgflow.trace.ctf.stream_layout import ClassLayout, StreamLayout

_LEADING = 4
"""So many columns are not read from fields: id, time, trace and CPU."""


@dataclass(frozen=True)
class Source:
    """The field that fills a column, or fields inside others, each in the events that have it."""

    scope: Scope  # the structure that it is in
    paths: tuple[tuple[str, ...], ...]  # names from the member of that structure to the field
    number: int | None  # its place among the plain fields of the event, None if it is not plain


@dataclass(frozen=True)
class ClassPlan:
    """How batches of one event class are made."""

    layout: ClassLayout
    stream: StreamLayout
    schema: pa.Schema  # of the batches, the common columns first
    sources: tuple[Source | None, ...]  # of the columns behind the leading ones; None: no field

    @property
    def is_field_by_field(self) -> bool:
        """Its events are read field by field, as at least one wanted field is not plain."""
        body = self.layout.body
        if self.stream.header is None or body.fields is None:
            return True
        paths = [
            path
            for source in self.sources
            if source is not None and source.number is None
            for path in source.paths
        ]
        return not all(
            body.variant is not None
            and path[0] == body.variant_name
            and len(path) > 1
            and body.variant.has(path[1:])
            for path in paths
        )


def make_plan(stream: StreamLayout, layout: ClassLayout, wanted: pa.Schema) -> ClassPlan:
    """Plan the batches of an event class whose payload columns are `wanted`."""
    columns = list(COMMON_SCHEMA)[_LEADING:]
    common = _sources(layout, Scope.EVENT_CONTEXT, stream.stream.event_context, columns)
    specific = layout.event.specific_context
    of_class = _sources(layout, Scope.SPECIFIC_CONTEXT, specific, columns)
    contexts = [first or second for first, second in zip(common, of_class, strict=True)]
    payload = _sources(layout, Scope.PAYLOAD, layout.event.payload, wanted)
    schema = pa.schema([*COMMON_SCHEMA, *wanted])
    return ClassPlan(layout, stream, schema, (*contexts, *payload))


def build_batch(
    plan: ClassPlan,
    batch: Batch,
    rows: NDArray[np.int64],
    first_id: int,
    names: ThreadNames,
    reader_at: Callable[[int, int], tuple[EventReader, int]],
) -> pa.RecordBatch:
    """Build a batch of events of one class, rows of `batch` in their order.

    `first_id` is the number of the first event of `batch`, `names` are the thread names seen so
    far. `reader_at` takes a packet of the batch and the position of an event. It returns what reads
    the packet field by field, and the bit at which the event begins.
    """
    count, events = rows.size, batch.events
    packets = events.packets[rows]
    without_cpu = None if batch.has_cpu is None else ~batch.has_cpu[packets]
    arrays = [
        to_arrow(rows + first_id),
        to_arrow(events.ts_ns[rows]),
        to_arrow(np.full(count, plan.stream.trace_index, np.int32)),
        to_arrow(batch.cpus[packets], without_cpu),
    ]
    field_of: _GatheredColumns | _FieldByField
    if plan.is_field_by_field:
        at = map(reader_at, packets.tolist(), events.positions[rows].tolist())
        field_of = _FieldByField([reader.event(bit) for reader, bit in at], names)
    else:
        field_of = _GatheredColumns(plan, batch.memory, events.bodies[rows], names)
    for field, source in zip(list(plan.schema)[_LEADING:], plan.sources, strict=True):
        if source is not None:
            arrays.append(field_of.array(source, field.type))
        elif field.nullable:
            arrays.append(pa.nulls(count, field.type))
        else:
            arrays.append(to_arrow(np.full(count, -1, np.int32)))
    return pa.RecordBatch.from_arrays(arrays, schema=plan.schema)


class _GatheredColumns:
    """Columns gathered from memory, for all events at once."""

    def __init__(
        self, plan: ClassPlan, memory: Memory, bodies: NDArray[np.int64], names: ThreadNames
    ) -> None:
        body = plan.layout.body
        numbers = {source.number for source in plan.sources if source is not None}
        wanted = sorted(number for number in numbers if number is not None)
        self._fields = body.fields or ()
        self._names = names
        self._rows = FieldRows(body, memory, bodies, wanted, with_variant=None in numbers)
        self._count = bodies.size

    def array(self, source: Source, data_type: pa.DataType) -> pa.Array:
        number = source.number
        if number is None:
            found = map(self._rows.in_variant, source.paths)
            present = [values for values in found if values is not None]
            return scattered_array(present, self._count, data_type)
        field = self._fields[number]
        if pa.types.is_dictionary(data_type):
            return self._thread_names(number)
        if field.kind is Kind.NUMBER:
            return number_array(self._rows.numbers(number), data_type)
        if pa.types.is_string(data_type):
            return text_array(*self._rows.text(number))
        return list_array(*self._rows.elements(number), data_type)

    def _thread_names(self, number: int) -> pa.Array:
        field = self._fields[number]
        if field.kind is Kind.TEXT and field.count:
            return self._names.array_of_bytes(self._rows.words(number, f"V{field.count}"))
        return self._names.array_of(text_array(*self._rows.text(number)).to_pylist())


class _FieldByField:
    """Columns of events that are read field by field: slower, but any layout will do."""

    def __init__(
        self, events: Sequence[Mapping[Scope, Mapping[str, Any]]], names: ThreadNames
    ) -> None:
        self._events = events
        self._names = names

    def array(self, source: Source, data_type: pa.DataType) -> pa.Array:
        values = [first_inner_value(event[source.scope], source.paths) for event in self._events]
        if pa.types.is_dictionary(data_type):
            return self._names.array_of(values)
        return to_array(values, data_type)


def _sources(
    layout: ClassLayout, scope: Scope, structure: Structure, columns: Iterable[pa.Field]
) -> list[Source | None]:
    numbers: dict[tuple[str, ...], int] = {
        (field.name,): number
        for number, field in enumerate(layout.body.fields or ())
        if field.scope is scope
    }
    return [
        Source(scope, paths, numbers.get(paths[0])) if paths else None
        for paths in paths_of(columns, declared_schema(structure))
    ]


class ThreadNames:
    """Names of threads seen so far: one dictionary for all batches, as few names repeat."""

    def __init__(self) -> None:
        self._index_of_name: dict[str, int] = {}
        self._dictionary = texts_to_arrow([])

    def array_of(self, names: Iterable[str | None]) -> pa.Array:
        """Return an array of names given one by one."""
        indexes = [None if name is None else self._index_of(name) for name in names]
        return self._array(integers_to_arrow(indexes, pa.int32()))

    def array_of_bytes(self, content: NDArray[Any]) -> pa.Array:
        """Return an array of names that end at their first NUL.

        `content` has the bytes of each name as one item of numpy's type `V`.
        """
        size, count = content.dtype.itemsize, content.size
        buffer = pa.py_buffer(np.ascontiguousarray(content))
        encoded = pa.Array.from_buffers(pa.binary(size), count, [None, buffer]).dictionary_encode()
        indexes = [
            self._index_of(name.partition(b"\0")[0].decode("utf-8", "replace"))
            for name in encoded.dictionary.to_pylist()
        ]
        return self._array(to_arrow(np.array(indexes, np.int32)[to_numpy(encoded.indices)]))

    def _index_of(self, name: str) -> int:
        return self._index_of_name.setdefault(name, len(self._index_of_name))

    def _array(self, indexes: pa.Array) -> pa.Array:
        if len(self._dictionary) < len(self._index_of_name):
            self._dictionary = texts_to_arrow(list(self._index_of_name))
        return pa.DictionaryArray.from_arrays(indexes, self._dictionary)
