"""Record batches of the events of one class: which field fills which column, and how."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from msgflow.trace.columns import (
    COMMON_SCHEMA,
    first_inner_value,
    is_of_context,
    paths_of,
    to_array,
)
from msgflow.trace.ctf import arrow
from msgflow.trace.ctf.event_body import Kind
from msgflow.trace.ctf.event_order import Batch
from msgflow.trace.ctf.field_columns import FieldRows
from msgflow.trace.ctf.field_reader import EventReader
from msgflow.trace.ctf.field_types import Scope, Structure
from msgflow.trace.ctf.packet_memory import Memory
from msgflow.trace.ctf.stream_layout import ClassLayout, StreamLayout
from msgflow.trace.numpy_arrow import Integers, Values, texts_to_arrow, to_arrow, to_numpy

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
        others = [source for source in self.sources if source is not None and source.number is None]
        return not all(
            body.variant is not None and body.variant.has(path)
            for source in others
            for path in source.paths
        )


def make_plan(stream: StreamLayout, layout: ClassLayout, wanted: pa.Schema) -> ClassPlan:
    """Plan the batches of an event class whose payload columns are `wanted`."""
    columns = [*list(COMMON_SCHEMA)[_LEADING:], *wanted]
    common = _sources(layout, Scope.EVENT_CONTEXT, stream.stream.event_context, columns)
    specific = layout.event.specific_context
    of_class = _sources(layout, Scope.SPECIFIC_CONTEXT, specific, columns)
    payload = _sources(layout, Scope.PAYLOAD, layout.event.payload, columns)
    is_context = [*[True] * (len(columns) - len(wanted)), *map(is_of_context, wanted)]
    sources = tuple(
        (first or second) if is_first else third
        for first, second, third, is_first in zip(
            common, of_class, payload, is_context, strict=True
        )
    )
    return ClassPlan(layout, stream, pa.schema([*COMMON_SCHEMA, *wanted]), sources)


def build_batch(
    plan: ClassPlan,
    batch: Batch,
    rows: Integers,
    first_id: int,
    reader_at: Callable[[int, int], tuple[EventReader, int]],
) -> pa.RecordBatch:
    """Build a batch of events of one class, rows of `batch` in their order.

    `first_id` is the number of the first event of `batch`. `reader_at` takes a packet of the batch
    and the position of an event. It returns what reads the packet field by field, and the bit at
    which the event begins.
    """
    count, events, at = rows.size, batch.events, batch.rows[rows]
    packets = events.packets[at]
    without_cpu = None if batch.has_cpu is None else ~batch.has_cpu[packets]
    arrays = [
        to_arrow(rows + first_id),
        to_arrow(events.ts_ns[at]),
        to_arrow(np.full(count, plan.stream.trace_index, np.int32)),
        to_arrow(batch.cpus[packets], without_cpu),
    ]
    if plan.is_field_by_field:
        places = map(reader_at, packets.tolist(), events.positions[at].tolist())
        array = _field_by_field([reader.event(bit) for reader, bit in places])
    else:
        array = _gathered(plan, batch.memory, events.bodies[at])
    for field, source in zip(list(plan.schema)[_LEADING:], plan.sources, strict=True):
        if source is not None:
            arrays.append(array(source, field.type))
        elif field.nullable:
            arrays.append(pa.nulls(count, field.type))
        else:
            arrays.append(to_arrow(np.full(count, -1, np.int32)))
    return pa.RecordBatch.from_arrays(arrays, schema=plan.schema)


def _gathered(
    plan: ClassPlan, memory: Memory, bodies: Integers
) -> Callable[[Source, pa.DataType], pa.Array]:
    """Return what gathers a column from memory, for all events at once."""
    fields = plan.layout.body.fields or ()
    numbers = {source.number for source in plan.sources if source is not None}
    wanted = sorted(number for number in numbers if number is not None)
    rows = FieldRows(plan.layout.body, memory, bodies, wanted, with_variant=None in numbers)

    def array(source: Source, data_type: pa.DataType) -> pa.Array:
        number = source.number
        if number is None:
            found = map(rows.in_variant, source.paths)
            present = [values for values in found if values is not None]
            return arrow.scattered_array(present, bodies.size, data_type)
        field = fields[number]
        if pa.types.is_dictionary(data_type) and field.kind is Kind.TEXT and field.count:
            return _short_names(rows.words(number, f"V{field.count}"))
        if field.kind is Kind.NUMBER:
            return arrow.number_array(rows.numbers(number), data_type)
        if pa.types.is_list(data_type):
            return arrow.list_array(*rows.elements(number), data_type)
        texts = arrow.text_array(*rows.text(number))
        return texts.dictionary_encode() if pa.types.is_dictionary(data_type) else texts

    return array


def _short_names(content: Values) -> pa.Array:
    """Return names that end at their first NUL; few of them differ.

    `content` has the bytes of each name as one item of numpy's type `V`.
    """
    size, count = content.dtype.itemsize, content.size
    buffer = pa.py_buffer(np.ascontiguousarray(content))
    encoded = pa.Array.from_buffers(pa.binary(size), count, [None, buffer]).dictionary_encode()
    names = [
        name.partition(b"\0")[0].decode("utf-8", "replace")
        for name in encoded.dictionary.to_pylist()
    ]
    # Names may differ in what is behind the NUL alone.
    distinct = texts_to_arrow(names).dictionary_encode()
    indices = to_numpy(distinct.indices)[to_numpy(encoded.indices)]
    return pa.DictionaryArray.from_arrays(to_arrow(indices), distinct.dictionary)


def _field_by_field(
    events: Sequence[Mapping[Scope, Mapping[str, Any]]],
) -> Callable[[Source, pa.DataType], pa.Array]:
    """Return what makes a column of events that were read field by field."""

    def array(source: Source, data_type: pa.DataType) -> pa.Array:
        values = [first_inner_value(event[source.scope], source.paths) for event in events]
        if pa.types.is_dictionary(data_type):
            return texts_to_arrow(values).dictionary_encode()
        return to_array(values, data_type)

    return array


def _sources(
    layout: ClassLayout, scope: Scope, structure: Structure, columns: Iterable[pa.Field]
) -> list[Source | None]:
    numbers: dict[tuple[str, ...], int] = {
        field.path: number
        for number, field in enumerate(layout.body.fields or ())
        if field.scope is scope
    }
    return [
        Source(scope, paths, numbers.get(paths[0])) if paths else None
        for paths in paths_of(columns, arrow.declared_schema(structure))
    ]
