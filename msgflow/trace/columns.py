"""Rows of Python values to Arrow record batches."""

from __future__ import annotations

from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import pyarrow as pa

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence


class Field(Protocol):
    """A field that a trace declares: its name, and the Arrow type that holds its values."""

    @property
    def name(self) -> str:
        """As declared."""

    @property
    def type(self) -> pa.DataType:
        """The Arrow type."""


AnyField = TypeVar("AnyField", bound=Field)


@dataclass(frozen=True)
class InnerField:
    """A field inside a structure or variant: names from the outermost on, and Arrow type."""

    path: tuple[str, ...]
    type: pa.DataType

    @property
    def name(self) -> str:
        """The names with dots in between."""
        return ".".join(self.path)


ALIASES = b"aliases"
"""Key of a field's metadata: other names under which traces have it, comma separated."""

BASE = b"base"
"""Key of a field's metadata: the base in which to show an integer, or the elements of an array."""


def names_of(field: pa.Field) -> tuple[str, ...]:
    """Return the names under which a trace may have this field, the preferred one first."""
    metadata = field.metadata or {}
    aliases = metadata.get(ALIASES, b"").decode()
    return (field.name, *(alias for alias in aliases.split(",") if alias))


def can_hold(wanted: pa.DataType, declared: pa.DataType) -> bool:
    """Tell whether values of a declared type can be delivered as the wanted type."""
    types = pa.types
    if types.is_integer(wanted):
        return bool(types.is_integer(declared))
    if types.is_floating(wanted):
        return bool(types.is_floating(declared) or types.is_integer(declared))
    if types.is_list(wanted):
        return bool(types.is_list(declared)) and can_hold(wanted.value_type, declared.value_type)
    return bool(wanted.equals(declared))


def union_type(first: pa.DataType, second: pa.DataType) -> pa.DataType | None:
    """Return the type that holds values of both, None if there is none."""
    if first.equals(second):
        return first
    if pa.types.is_integer(first) and pa.types.is_integer(second):
        return pa.int64()
    return None


def in_hexadecimal(schema: pa.Schema, names: Collection[str]) -> pa.Schema:
    """Return the schema with these columns marked as to be shown in base 16."""
    return pa.schema(
        [
            field.with_metadata({**(field.metadata or {}), BASE: b"16"})
            if field.name in names
            else field
            for field in schema
        ]
    )


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


def merged_schema(declared: Iterable[Iterable[Field]]) -> pa.Schema:
    """Return the payload columns of several declarations of one event.

    Integers of different types become int64; a field of types that do not go together keeps
    the first one and is NULL where it is declared otherwise.
    """
    types: dict[str, pa.DataType] = {}
    for fields in declared:
        for field in fields:
            known = types.setdefault(field.name, field.type)
            types[field.name] = union_type(known, field.type) or known
    return pa.schema(list(types.items()))


def matching(columns: Iterable[pa.Field], fields: Iterable[AnyField]) -> dict[str, AnyField]:
    """Return column to the field that fills it, for those columns that a field can fill."""
    by_name = {field.name: field for field in fields}
    found = {}
    for column in columns:
        for name in names_of(column):
            field = by_name.get(name)
            if field is not None and can_hold(_plain(column.type), field.type):
                found[column.name] = field
                break
    return found


def inner_matching(
    columns: Iterable[pa.Field], fields: Iterable[Field]
) -> dict[str, tuple[InnerField, ...]]:
    """Return column to the fields inside others that fill it, for columns named by such.

    The name of such a field has dots: those of the structures, variants and options around it come
    before its own. Options of one variant may fill the same column, each in the events that have
    it.
    """
    by_name = {field.name: field.type for field in fields}
    found = {}
    for column in columns:
        inner = []
        for name in names_of(column):
            path = tuple(name.split("."))
            declared = by_name.get(path[0]) if len(path) > 1 else None
            for member in path[1:]:
                declared = _member_type(declared, member)
            if declared is not None and can_hold(column.type, declared):
                inner.append(InnerField(path, declared))
        if inner:
            found[column.name] = tuple(inner)
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


def _member_type(declared: pa.DataType | None, name: str) -> pa.DataType | None:
    if declared is None or not pa.types.is_struct(declared):
        return None
    index = declared.get_field_index(name)
    return None if index < 0 else declared.field(index).type


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


def record_batch(
    schema: pa.Schema,
    columns: Mapping[str, Sequence[Any]],
    constants: Mapping[str, Any],
    row_count: int,
) -> pa.RecordBatch:
    """Build a batch; a column that is neither given nor constant is NULL."""
    arrays = []
    for field in schema:
        if field.name in columns:
            arrays.append(to_array(columns[field.name], field.type))
        elif constants.get(field.name) is not None:
            arrays.append(pa.repeat(pa.scalar(constants[field.name], field.type), row_count))
        else:
            arrays.append(pa.nulls(row_count, field.type))
    return pa.RecordBatch.from_arrays(arrays, schema=schema)


def renumber(rows: list[list[Any]], new_ids: Mapping[int, int]) -> list[list[Any]]:
    """Replace the first value of each row by its new number and sort by it."""
    changed = [[new_ids.get(row[0], row[0]), *row[1:]] for row in rows]
    changed.sort(key=itemgetter(0))
    return changed


def _plain(data_type: pa.DataType) -> pa.DataType:
    return data_type.value_type if pa.types.is_dictionary(data_type) else data_type


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
