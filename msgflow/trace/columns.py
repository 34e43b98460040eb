"""Columns of batches: those of every reader, which field fills which, and their Python values."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import pyarrow as pa

COMMON_SCHEMA: Final = pa.schema(
    [
        pa.field("event_id", pa.int64(), nullable=False),
        pa.field("ts_ns", pa.int64(), nullable=False),
        pa.field("trace_index", pa.int32(), nullable=False),
        pa.field("cpu_id", pa.int32()),
        pa.field("vpid", pa.int32(), nullable=False),
        pa.field("vtid", pa.int32(), nullable=False),
        pa.field("procname", pa.dictionary(pa.int32(), pa.string())),
        pa.field("pid_ns", pa.int64()),
    ]
)
"""First columns of every batch of events.

`event_id` counts all events of the set from 0 in the order (time, trace, stream, position in
stream), wanted or not. `vpid` and `vtid` are -1 where the trace has no such context, the nullable
columns are NULL there.
"""

PACKET_SCHEMA: Final = pa.schema(
    [
        pa.field("trace_index", pa.int32(), nullable=False),
        pa.field("stream_index", pa.int32(), nullable=False),
        pa.field("stream_class_id", pa.int64(), nullable=False),
        pa.field("stream_instance_id", pa.int64(), nullable=False),
        pa.field("cpu_id", pa.int32()),
        pa.field("position", pa.int64(), nullable=False),
        pa.field("begin_ns", pa.int64()),
        pa.field("end_ns", pa.int64()),
        pa.field("last_event_ns", pa.int64()),
        pa.field("event_count", pa.int64(), nullable=False),
        pa.field("discarded_event_count", pa.int64()),
        pa.field("lost_packet_count", pa.int64()),
        pa.field("is_numbered", pa.bool_(), nullable=False),
    ]
)
"""Columns of the batches of packets, one row per packet.

`stream_index` is dense within the trace, in the order (stream class, stream instance); `position`
is the place of the packet in its stream. `discarded_event_count` events were lost after
`last_event_ns` and before `end_ns`; `lost_packet_count` packets are missing right before this
one. Both are NULL where something was lost but the trace does not say how much. Where
`is_numbered`, packets have numbers that go on from one directory of a recording to the next. Else
nothing says how many packets are missing before the first one of a directory.
"""

ALIASES = b"aliases"
"""Key of a field's metadata: other names under which traces have it, comma separated."""

BASE = b"base"
"""Key of a field's metadata: the base in which to show an integer, or the elements of an array."""

CONTEXT = b"context"
"""Key of a field's metadata: the field is a context of the event, not a part of its payload."""

LABELS = b"labels"
"""Key of a field's metadata: of an enumeration, each label with its ranges of values, as JSON."""


def field_metadata(
    base: int | None, labels: Mapping[str, Iterable[tuple[int, int]]] | None
) -> dict[bytes, bytes]:
    """Return the metadata of a field.

    `base` is None if the field is no integer. An enumeration has `labels`, each with ranges of
    values. Both ends belong to a range.
    """
    found = {BASE: b"16"} if base == 16 else {}
    if labels:
        found[LABELS] = json.dumps(
            {label: list(ranges) for label, ranges in labels.items()}
        ).encode()
    return found


def is_of_context(field: pa.Field) -> bool:
    """Tell whether a context fills a column, and not the payload."""
    return CONTEXT in (field.metadata or {})


def labels_of(field: pa.Field) -> dict[str, list[tuple[int, int]]]:
    """Return the labels of an enumeration with their ranges of values, none of other fields."""
    found = json.loads((field.metadata or {}).get(LABELS, b"{}"))
    return {label: [(first, last) for first, last in ranges] for label, ranges in found.items()}


def _can_hold(wanted: pa.DataType, declared: pa.DataType | None) -> bool:
    """Tell whether values of a declared type can be delivered as the wanted type."""
    types = pa.types
    if declared is None:
        return False
    if types.is_integer(wanted):
        return bool(types.is_integer(declared))
    if types.is_floating(wanted):
        return bool(types.is_floating(declared) or types.is_integer(declared))
    if types.is_list(wanted):
        return bool(types.is_list(declared)) and _can_hold(wanted.value_type, declared.value_type)
    return bool(wanted.equals(declared))


def complete_schemas(
    wanted: Mapping[str, pa.Schema | None] | None, declared: Mapping[str, pa.Schema]
) -> Mapping[str, pa.Schema]:
    """Return the payload columns of each wanted event, all declared fields where none are named."""
    if wanted is None:
        return declared
    return {
        name: declared.get(name, pa.schema([])) if schema is None else schema
        for name, schema in wanted.items()
    }


def merged_schemas(declared: Iterable[tuple[str, pa.Schema]]) -> dict[str, pa.Schema]:
    """Return event name to payload columns, from one or more declarations of each event.

    Integers of different types become int64; a field of types that do not go together keeps
    the first one and is NULL where it is declared otherwise. The labels of all count.
    """
    events: dict[str, dict[str, pa.Field]] = {}
    for event, schema in declared:
        merged = events.setdefault(event, {})
        for field in schema:
            known = merged.setdefault(field.name, field)
            are_integers = pa.types.is_integer(known.type) and pa.types.is_integer(field.type)
            is_other = are_integers and known.type != field.type
            joint = pa.int64() if is_other else known.type
            merged[field.name] = pa.field(field.name, joint, metadata=_joined(known, field))
    return {event: pa.schema(list(merged.values())) for event, merged in events.items()}


def paths_of(
    columns: Iterable[pa.Field], fields: Iterable[pa.Field]
) -> list[tuple[tuple[str, ...], ...]]:
    """Return for each column the paths of the fields that fill it; none: no field does.

    A path has the names from the outermost structure, variant or option to the field itself. A
    field that has one of the names of a column fills it alone. Otherwise each of these names is a
    path, with dots in it. Options of one variant may fill the same column, each in its events.
    """
    types = {field.name: field.type for field in fields}
    found: list[tuple[tuple[str, ...], ...]] = []
    for column in columns:
        wanted = column.type.value_type if pa.types.is_dictionary(column.type) else column.type
        aliases = (column.metadata or {}).get(ALIASES, b"").decode()
        names = (column.name, *filter(None, aliases.split(",")))
        plain = next((name for name in names if _can_hold(wanted, types.get(name))), None)
        if plain is not None:
            found.append(((plain,),))
            continue
        inner = (tuple(name.split(".")) for name in names if "." in name)
        found.append(tuple(path for path in inner if _can_hold(wanted, _type_at(types, path))))
    return found


def first_inner_value(fields: Any, paths: Iterable[Sequence[str]]) -> Any:
    """Return what lies at the first of these paths of names that leads anywhere, else None."""
    for path in paths:
        value = fields
        for name in path:
            value = value.get(name) if isinstance(value, dict) else None
        if value is not None:
            return value
    return None


def _joined(known: pa.Field, field: pa.Field) -> dict[bytes, bytes]:
    labels = labels_of(known)
    for label, ranges in labels_of(field).items():
        labels[label] = labels.get(label, []) + ranges
    return {**(field.metadata or {}), **(known.metadata or {}), **field_metadata(None, labels)}


def _type_at(types: Mapping[str, pa.DataType], path: Sequence[str]) -> pa.DataType | None:
    found = types.get(path[0])
    for name in path[1:]:
        if found is None or not pa.types.is_struct(found):
            return None
        index = found.get_field_index(name)
        found = None if index < 0 else found.field(index).type
    return found


def to_array(values: Sequence[Any], data_type: pa.DataType) -> pa.Array:
    """Convert a column of Python values.

    Text that is not UTF-8 gets replacement characters; integers that do not fit are wrapped
    round as C would, so that a handle keeps its bits.
    """
    try:
        return pa.array(values, data_type)
    except UnicodeEncodeError:
        return pa.array([_valid_text(value) for value in values], data_type)
    except (OverflowError, pa.ArrowInvalid):
        return pa.array([_wrapped(value, data_type) for value in values], data_type)


def batch_of(rows: Sequence[Sequence[Any]], schema: pa.Schema) -> pa.RecordBatch:
    """Build a batch from one or more rows of Python values."""
    filled = zip(zip(*rows, strict=True), schema.types, strict=True)
    arrays = [to_array(values, data_type) for values, data_type in filled]
    return pa.RecordBatch.from_arrays(arrays, schema=schema)


def _valid_text(value: Any) -> Any:
    if isinstance(value, str):
        return value.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    if isinstance(value, list):
        return [_valid_text(element) for element in value]
    if isinstance(value, dict):
        return {name: _valid_text(element) for name, element in value.items()}
    return value


def _wrapped(value: Any, data_type: pa.DataType) -> Any:
    if isinstance(value, list):
        return [_wrapped(element, data_type.value_type) for element in value]
    if not isinstance(value, int) or not pa.types.is_integer(data_type):
        return value
    bits = data_type.bit_width
    low = value & ((1 << bits) - 1)
    return low - (1 << bits) if pa.types.is_signed_integer(data_type) and low >> (bits - 1) else low
