"""What is read of each event class, and where the rows go."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.trace.columns import (
    first_inner_value,
    inner_matching,
    matching,
    record_batch,
    renumber,
)
from msgflow.trace.schemas import COMMON_SCHEMA

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from msgflow.trace.bt2_fields import FieldReader
    from msgflow.trace.bt2_library import Bt2Library

Getter = tuple[int, "Callable[[Any], Any]"]

_ROW_HEAD = ("event_id", "ts_ns", "trace_index", "cpu_id")
_CONTEXT_COLUMNS = ("vpid", "vtid", "procname", "pid_ns")
_WITHOUT_CONTEXT = {"vpid": -1, "vtid": -1}


@dataclass
class RowStore:
    """Rows of one event name and one layout, in order of arrival.

    Attributes:
        columns: what they hold.
        inner: column to the paths of the fields inside others that fill it.
        rows: the values.
    """

    columns: tuple[str, ...]
    inner: Mapping[str, tuple[tuple[str, ...], ...]] = field(default_factory=dict)
    rows: list[list[Any]] = field(default_factory=list)

    def take(self, schema: pa.Schema, new_ids: Mapping[int, int]) -> pa.RecordBatch:
        """Empty the store into a batch."""
        rows = renumber(self.rows, new_ids) if new_ids else self.rows
        columns = dict(zip(self.columns, zip(*rows, strict=True), strict=True))
        for column, paths in self.inner.items():
            # All paths of a column begin with fields that are held whole.
            names = {path[0] for path in paths}
            held = [columns[_whole(name)] for name in names]
            columns[_distinct(column)] = tuple(
                first_inner_value(dict(zip(names, values, strict=True)), paths)
                for values in zip(*held, strict=True)
            )
        payload = list(schema)[len(COMMON_SCHEMA) :]
        distinct = pa.schema([*COMMON_SCHEMA, *(f.with_name(_distinct(f.name)) for f in payload)])
        batch = record_batch(distinct, columns, _WITHOUT_CONTEXT, len(rows))
        self.rows.clear()
        return pa.RecordBatch.from_arrays(batch.columns, schema=schema)


@dataclass(slots=True)
class ClassPlan:
    """How one event class is read.

    `append` is None where the event is not wanted: then it is only counted.
    """

    trace_index: int
    name: str
    append: Callable[[list[Any]], None] | None
    common: list[Getter]
    specific: list[Getter]
    payload: list[Getter]
    count: int = 0


class Planner:
    """Makes the plans and keeps the rows of all events."""

    def __init__(
        self,
        library: Bt2Library,
        fields: FieldReader,
        schemas: Mapping[str, pa.Schema],
    ) -> None:
        self._native = library.native
        self._fields = fields
        self._schemas = {
            name: pa.schema([*COMMON_SCHEMA, *schema]) for name, schema in schemas.items()
        }
        self._payloads = schemas
        self._stores: dict[str, dict[tuple[Any, ...], RowStore]] = {}

    def plan(self, event_class: Any, trace_index: int) -> ClassPlan:
        """Make the plan of the event class at this pointer."""
        native = self._native
        name = native.event_class_get_name(event_class) or ""
        payload_schema = self._payloads.get(name)
        if payload_schema is None:
            return ClassPlan(trace_index, name, None, [], [], [])
        stream_class = native.event_class_borrow_stream_class_const(event_class)
        common = self._fields.members(
            native.stream_class_borrow_event_common_context_field_class_const(stream_class)
        )
        specific = self._fields.members(
            native.event_class_borrow_specific_context_field_class_const(event_class)
        )
        payload = self._fields.members(
            native.event_class_borrow_payload_field_class_const(event_class)
        )
        contexts = [field for field in COMMON_SCHEMA if field.name in _CONTEXT_COLUMNS]
        from_common = matching(contexts, common)
        missing = [field for field in contexts if field.name not in from_common]
        from_specific = matching(missing, specific)
        from_payload = matching(payload_schema, payload)
        inner = {
            column: tuple(field.path for field in fields)
            for column, fields in inner_matching(payload_schema, payload).items()
            if column not in from_payload
        }
        outer = {path[0] for paths in inner.values() for path in paths}
        whole = [member for member in payload if member.name in outer]
        columns = (
            *_ROW_HEAD,
            *from_common,
            *from_specific,
            *map(_distinct, from_payload),
            *(_whole(member.name) for member in whole),
        )
        stores = self._stores.setdefault(name, {})
        store = stores.setdefault((columns, *inner.items()), RowStore(columns, inner))
        return ClassPlan(
            trace_index,
            name,
            store.rows.append,
            [(member.index, member.get) for member in from_common.values()],
            [(member.index, member.get) for member in from_specific.values()],
            [(member.index, member.get) for member in (*from_payload.values(), *whole)],
        )

    def take(self, new_ids: Mapping[int, int]) -> Iterable[tuple[str, pa.RecordBatch]]:
        """Empty all stores into one batch per event name, in order of `event_id`."""
        for name, stores in self._stores.items():
            schema = self._schemas[name]
            batches = [store.take(schema, new_ids) for store in stores.values() if store.rows]
            if len(batches) == 1:
                yield name, batches[0]
            elif batches:
                table = pa.Table.from_batches(batches).unify_dictionaries().sort_by("event_id")
                yield name, table.combine_chunks().to_batches()[0]


def _whole(name: str) -> str:
    """Return a name for a field that is held for what is inside it."""
    return f"whole {name}"


def _distinct(name: str) -> str:
    """Return a name for a payload column that no common column has."""
    return f"payload {name}"
