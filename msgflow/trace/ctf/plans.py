"""Which field fills which column, for every event class that is wanted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from msgflow.trace.columns import inner_matching, matching
from msgflow.trace.ctf.arrow_types import declared_schema
from msgflow.trace.ctf.compiled_columns import Gatherer
from msgflow.trace.ctf.types import Scope, Structure, Type
from msgflow.trace.schemas import COMMON_SCHEMA

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from msgflow.trace.ctf.layout import ClassLayout, StreamLayout

CONTEXT_COLUMNS = ("vpid", "vtid", "procname", "pid_ns")


@dataclass(frozen=True)
class Source:
    """The field of a column: by name, and by its place among plain fields if it is one."""

    scope: Scope
    name: str
    type: Type
    number: int | None


@dataclass(frozen=True)
class ClassPlan:
    """How batches of one event class are made.

    Attributes:
        layout: the event class.
        stream: its stream class.
        schema: of the batches, the common columns first.
        contexts: common column to field, where there is one.
        payload: payload column to field, where there is one.
        inner: payload column to the names of the fields inside others that fill it.
    """

    layout: ClassLayout
    stream: StreamLayout
    schema: pa.Schema
    contexts: Mapping[str, Source]
    payload: Mapping[str, Source]
    inner: Mapping[str, tuple[tuple[str, ...], ...]]

    @cached_property
    def gatherer(self) -> Gatherer:
        """What of it the compiled kernel gathers."""
        wanted, text = [], None
        for position, column in enumerate(self.schema):
            is_common = position < len(COMMON_SCHEMA)
            source = (self.contexts if is_common else self.payload).get(column.name)
            if source is None or source.number is None:
                continue
            if pa.types.is_dictionary(column.type):
                text = source.number
            elif pa.types.is_integer(column.type) or pa.types.is_floating(column.type):
                wanted.append((source.number, np.dtype(column.type.to_pandas_dtype())))
        return Gatherer(self.layout.body, wanted, text)

    @property
    def is_slow(self) -> bool:
        """Its events are read field by field."""
        body = self.layout.body
        if self.stream.header is None or body.fields is None:
            return True
        sources = [*self.contexts.values(), *self.payload.values()]
        paths = [path for paths in self.inner.values() for path in paths]
        return any(source.number is None for source in sources) or not all(
            body.tail is not None and path[0] == body.tail_name and body.tail.has(path[1:])
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
