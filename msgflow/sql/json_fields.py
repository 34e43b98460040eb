"""SQL expressions that turn the fields of events into JSON.

Names of fields come from traces: they stand in SQL only as quoted literals.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

import pyarrow as pa

from msgflow.sql.quoting import literal
from msgflow.trace.columns import labels_of

MOST_LAMBDAS = 2
"""DuckDB needs ten times as long to bind each further lambda inside a lambda."""


def column_name(position: int) -> str:
    """Return the name in SQL of the payload column at this position."""
    return f"payload_{position}"


def json_fields(payload: pa.Schema) -> str:
    """Return the SQL of a JSON object with all fields; an enumeration is its only label."""
    members = (
        f"{literal(field.name)}, {_labelled(column_name(position), field)}"
        for position, field in enumerate(payload)
    )
    return f"json_object({', '.join(members)})"


def label_of(expression: str, field: pa.Field) -> str | None:
    """Return the SQL of the only label of a value, NULL where none or several belong to it.

    The result is None if no value of the field has such a label, as when it is no enumeration.
    """
    choices = " ".join(
        f"WHEN {expression} BETWEEN {first} AND {last} THEN {literal(label)}"
        for first, last, label in _single(labels_of(field))
    )
    return f"CASE {choices} END" if choices else None


def exact(expression: str, data_type: pa.DataType, lambdas: int = 0) -> str:
    """Return the SQL of a value that JSON can hold: NaN and infinities become NULL.

    Arrays of arrays of arrays of floating point numbers become text.
    """
    types = pa.types
    if not _has_floats(data_type):
        return expression
    if types.is_floating(data_type):
        return f"CASE WHEN isfinite({expression}) THEN {expression} END"
    if types.is_list(data_type):
        if lambdas == MOST_LAMBDAS:
            return f"CAST({expression} AS VARCHAR)"
        element = exact("element", data_type.value_type, lambdas + 1)
        return f"list_transform({expression}, lambda element: {element})"
    members = ", ".join(
        f"{literal(field.name)}, {exact(member(expression, place), field.type, lambdas)}"
        for place, field in enumerate(data_type)
    )
    return f"CASE WHEN {expression} IS NOT NULL THEN json_object({members}) END"


def _labelled(expression: str, field: pa.Field) -> str:
    label = label_of(expression, field)
    value = exact(expression, field.type)
    return value if label is None else f"coalesce(to_json({label}), to_json({value}))"


def _single(labels: Mapping[str, list[tuple[int, int]]]) -> Iterator[tuple[int, int, str]]:
    """Yield (first, last, label) of the stretches of values with exactly one label."""
    changes = sorted(
        change
        for label, ranges in labels.items()
        for first, last in ranges
        if first <= last
        for change in ((first, label, 1), (last + 1, label, -1))
    )
    open_labels: Counter[str] = Counter()
    begin = 0
    for value, label, change in changes:
        if len(open_labels) == 1:
            yield begin, value - 1, next(iter(open_labels))
        open_labels[label] += change
        if not open_labels[label]:
            del open_labels[label]
        begin = value


def member(expression: str, place: int) -> str:
    """Return the SQL of a member of a structure; names may differ in case alone."""
    return f"struct_extract_at({expression}, {place + 1})"


def _has_floats(data_type: pa.DataType) -> bool:
    if pa.types.is_list(data_type):
        return _has_floats(data_type.value_type)
    if pa.types.is_struct(data_type):
        return any(_has_floats(field.type) for field in data_type)
    return bool(pa.types.is_floating(data_type))
