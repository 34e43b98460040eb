"""Record batches of the events of one class: which field fills which column, and how."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from msgflow.trace.columns import first_inner_value, inner_matching, matching, to_array
from msgflow.trace.ctf.arrow import (
    declared_schema,
    list_array,
    number_array,
    scattered_array,
    text_array,
)
from msgflow.trace.ctf.event_body import Kind
from msgflow.trace.ctf.field_columns import FieldRows
from msgflow.trace.ctf.field_types import Scope, Structure, Type
from msgflow.trace.numpy_arrow import integers_to_arrow, texts_to_arrow, to_arrow, to_numpy
from msgflow.trace.schemas import COMMON_SCHEMA

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from msgflow.trace.ctf.event_order import Batch
    from msgflow.trace.ctf.field_reader import EventReader
    from msgflow.trace.ctf.packet_memory import Memory
    from msgflow.trace.ctf.stream_layout import ClassLayout, StreamLayout

CONTEXT_COLUMNS = ("vpid", "vtid", "procname", "pid_ns")

_WITHOUT_CONTEXT = {"vpid": -1, "vtid": -1}


@dataclass(frozen=True)
class Source:
    """The field that fills a column."""

    scope: Scope  # the structure that it is in
    name: str  # its name there
    type: Type
    number: int | None  # its place among the plain fields of the event, None if it is not plain


@dataclass(frozen=True)
class ClassPlan:
    """How batches of one event class are made."""

    layout: ClassLayout
    stream: StreamLayout
    schema: pa.Schema  # of the batches, the common columns first
    contexts: Mapping[str, Source]  # common column to field, where there is one
    payload: Mapping[str, Source]  # payload column to field, where there is one
    # Payload column to the names of the fields inside others that fill it.
    inner: Mapping[str, tuple[tuple[str, ...], ...]]

    @property
    def is_field_by_field(self) -> bool:
        """Its events are read field by field, as at least one wanted field is not plain."""
        body = self.layout.body
        if self.stream.header is None or body.fields is None:
            return True
        sources = [*self.contexts.values(), *self.payload.values()]
        paths = [path for paths in self.inner.values() for path in paths]
        return any(source.number is None for source in sources) or not all(
            body.variant is not None and path[0] == body.variant_name and body.variant.has(path[1:])
            for path in paths
        )


def make_plan(stream: StreamLayout, layout: ClassLayout, wanted: pa.Schema) -> ClassPlan:
    """Plan the batches of an event class whose payload columns are `wanted`."""
    columns = [field for field in COMMON_SCHEMA if field.name in CONTEXT_COLUMNS]
    contexts = _sources(layout, Scope.EVENT_CONTEXT, stream.stream.event_context, columns)
    missing = [column for column in columns if column.name not in contexts]
    specific = layout.event.specific_context
    contexts |= _sources(layout, Scope.SPECIFIC_CONTEXT, specific, missing)
    payload = _sources(layout, Scope.PAYLOAD, layout.event.payload, wanted)
    declared = declared_schema(layout.event.payload)
    inner = {
        column: paths
        for column, paths in inner_matching(wanted, declared).items()
        if column not in payload
    }
    schema = pa.schema([*COMMON_SCHEMA, *wanted])
    return ClassPlan(layout, stream, schema, contexts, payload, inner)


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
    count, packets = rows.size, batch.in_packet[rows]
    without_cpu = None if batch.has_cpu is None else ~batch.has_cpu[packets]
    columns = {
        "event_id": to_arrow(rows + first_id),
        "ts_ns": to_arrow(batch.ts_ns[rows]),
        "trace_index": to_arrow(np.full(count, plan.stream.trace_index, np.int32)),
        "cpu_id": to_arrow(batch.cpus[packets], without_cpu),
    }
    field_of: _GatheredColumns | _FieldByField
    if plan.is_field_by_field:
        at = map(reader_at, packets.tolist(), batch.positions[rows].tolist())
        field_of = _FieldByField([reader.event(bit) for reader, bit in at], names)
    else:
        field_of = _GatheredColumns(plan, batch.memory, batch.bodies[rows], names)
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


class _GatheredColumns:
    """Columns gathered from memory, for all events at once."""

    def __init__(
        self, plan: ClassPlan, memory: Memory, bodies: NDArray[np.int64], names: ThreadNames
    ) -> None:
        body = plan.layout.body
        sources = [*plan.contexts.values(), *plan.payload.values()]
        wanted = {source.number for source in sources if source.number is not None}
        self._fields = body.fields or ()
        self._names = names
        with_variant = bool(plan.inner)
        self._rows = FieldRows(body, memory, bodies, sorted(wanted), with_variant=with_variant)
        self._count = bodies.size

    def array(self, source: Source, data_type: pa.DataType) -> pa.Array:
        number = source.number
        assert number is not None
        field = self._fields[number]
        if pa.types.is_dictionary(data_type):
            return self._thread_names(number)
        if field.kind is Kind.NUMBER:
            return number_array(self._rows.numbers(number), data_type)
        if pa.types.is_string(data_type):
            return text_array(*self._rows.text(number))
        return list_array(*self._rows.elements(number), data_type)

    def inner_array(self, paths: Sequence[Sequence[str]], data_type: pa.DataType) -> pa.Array:
        found = [self._rows.in_variant(".".join(path)) for path in paths]
        present = [values for values in found if values is not None]
        return scattered_array(present, self._count, data_type)

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
        values: list[Any] = [event[source.scope][source.name] for event in self._events]
        if pa.types.is_dictionary(data_type):
            return self._names.array_of(values)
        return to_array(values, data_type)

    def inner_array(self, paths: Sequence[Sequence[str]], data_type: pa.DataType) -> pa.Array:
        """Return a column of fields inside others; of several fields, the first in each event."""
        return to_array(
            [first_inner_value(event[Scope.PAYLOAD], paths) for event in self._events], data_type
        )


def _sources(
    layout: ClassLayout, scope: Scope, structure: Structure, columns: Iterable[pa.Field]
) -> dict[str, Source]:
    types = {member.name: member.type for member in structure.members}
    numbers = {
        field.name: number
        for number, field in enumerate(layout.body.fields or ())
        if field.scope is scope
    }
    return {
        column: Source(scope, field.name, types[field.name], numbers.get(field.name))
        for column, field in matching(columns, declared_schema(structure)).items()
    }


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
