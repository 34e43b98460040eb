"""Sequence of events of different names, each rendered as text, JSON or columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

import duckdb
import pyarrow as pa

from msgflow.sql.json_fields import MOST_LAMBDAS, column_name, json_fields, label_of, member
from msgflow.sql.quoting import literal
from msgflow.sql.statement import registered
from msgflow.trace.columns import BASE, COMMON_SCHEMA

if TYPE_CHECKING:
    from msgflow.trace import EventBatch, TraceInfo

Rendering = Callable[[str, pa.Schema], str]
"""From an event's name and payload columns to the SQL of its row, over `COLUMNS` and `hostname`,
`thread` and the payload as `column_name` gives it."""

COLUMNS = {
    "event_id": pa.int64(),
    "ts_ns": pa.int64(),
    "trace_index": pa.int32(),
    "hostname": pa.string(),
    "name": pa.string(),
    "cpu_id": pa.int32(),
    "vpid": pa.int32(),
    "vtid": pa.int32(),
    "procname": pa.string(),
    "pid_ns": pa.int64(),
}
"""The columns that events of every name have, where a format has columns, with their types."""

_WITHOUT = -1
# Controls, characters without a shape, and line separators: no terminal may obey a trace.
_UNPRINTABLE = r"[\p{C}\p{Zl}\p{Zp}]"
_REPLACEMENT = "\N{REPLACEMENT CHARACTER}"


class Sequencer(AbstractContextManager["Sequencer"]):
    """Renders rounds of events; a context manager."""

    def __init__(self, traces: Sequence[TraceInfo], rendering: Rendering) -> None:
        self._rendering = rendering
        timeless = [str(trace.index) for trace in traces if not trace.has_time]
        self._time = "ts_ns"
        if timeless:
            self._time = f"CASE WHEN trace_index NOT IN ({', '.join(timeless)}) THEN ts_ns END"
        self._connection = duckdb.connect(
            config={"autoinstall_known_extensions": False, "autoload_known_extensions": False}
        )
        hosts = pa.table(
            {
                "trace_index": pa.array([trace.index for trace in traces], "int32"),
                "hostname": pa.array([trace.hostname for trace in traces], "string"),
            }
        )
        self._connection.register("host", hosts)

    def __exit__(self, *exception: object) -> None:
        self._connection.close()

    def rows(self, events: Sequence[EventBatch]) -> pa.Table:
        """Return one row per event, in order of `event_id`."""
        batches, parts = {}, []
        for position, item in enumerate(events):
            payload = pa.schema(list(item.batch.schema)[len(COMMON_SCHEMA) :])
            columns = [*COMMON_SCHEMA.names, *map(column_name, range(len(payload)))]
            batches[f"batch_{position}"] = item.batch.rename_columns(columns)
            parts.append(self._select(f"batch_{position}", item.name, payload))
        with registered(self._connection, **batches):
            return self._connection.sql(
                f"SELECT * EXCLUDE (event_order) FROM ({' UNION ALL '.join(parts)}) "
                "ORDER BY event_order"
            ).to_arrow_table()

    def _select(self, batch: str, name: str, payload: pa.Schema) -> str:
        return f"""
SELECT event_id AS event_order, {self._rendering(name, payload)}
FROM (
    SELECT * REPLACE (
        {self._time} AS ts_ns, nullif(vpid, {_WITHOUT}) AS vpid, nullif(vtid, {_WITHOUT}) AS vtid
    )
    FROM {batch}
)
LEFT JOIN host USING (trace_index)"""


def text_line(name: str, payload: pa.Schema) -> str:
    """Render an event as a line: time, host, process and thread, CPU, name, fields."""
    # No chain of ||, which goes as deep as there are fields.
    fields = "".join(
        f", {literal(f' {field.name}=')}, {_readable(column_name(position), field)}"
        for position, field in enumerate(payload)
    )
    process = _printable("nullif(procname, '')")
    return f"""
    concat(
        coalesce(
            strftime(make_timestamp(ts_ns // 1000), '%Y-%m-%dT%H:%M:%S.%f')
            || format('{{:03d}}Z', ts_ns % 1000),
            '-'
        ),
        ' ', coalesce({_printable("hostname")}, '-'), ' ',
        coalesce({process}, '-'), '/', coalesce(CAST(vpid AS VARCHAR), '-'),
        '/', coalesce(CAST(vtid AS VARCHAR), '-'),
        ' [', coalesce(CAST(cpu_id AS VARCHAR), '-'), '] ',
        {_printable(literal(name))}{fields}
    ) AS line"""


def json_line(name: str, payload: pa.Schema) -> str:
    """Render an event as a JSON object."""
    members = ", ".join(f"'{column}', {_common(column, name)}" for column in COLUMNS)
    return f"CAST(json_object({members}, 'fields', {json_fields(payload)}) AS VARCHAR) AS line"


def json_column(name: str, payload: pa.Schema) -> str:
    """Render an event as `COLUMNS` and its fields as one column of JSON."""
    return f"{common_columns(name)}, CAST({json_fields(payload)} AS VARCHAR) AS fields"


def common_columns(name: str) -> str:
    """Return the SQL of `COLUMNS` for an event of this name."""
    return ", ".join(f"{_common(column, name)} AS {column}" for column in COLUMNS)


def _common(column: str, name: str) -> str:
    return literal(name) if column == "name" else column


def _readable(expression: str, field: pa.Field) -> str:
    is_hexadecimal = (field.metadata or {}).get(BASE) == b"16"
    value = _value(expression, field.type, is_hexadecimal=is_hexadecimal)
    label = label_of(expression, field)
    return value if label is None else f"coalesce({_readable_text(label)}, {value})"


def _printable(expression: str) -> str:
    """Return the SQL of a text without unprintable characters."""
    return f"regexp_replace({expression}, '{_UNPRINTABLE}', '{_REPLACEMENT}', 'g')"


def _readable_text(expression: str) -> str:
    """Return the SQL of a text or of JSON as people read it: quoted as in JSON."""
    return _printable(f"CAST(to_json({expression}) AS VARCHAR)")


def _value(
    expression: str, data_type: pa.DataType, *, is_hexadecimal: bool = False, lambdas: int = 0
) -> str:
    """Return the SQL of a value as people read it, never NULL.

    Text is quoted as in JSON, lists are `[1, 2]`, structures `{name=value, …}` without missing
    members. Values inside more than two lists are as in JSON.
    """
    types = pa.types
    is_deep = types.is_list(data_type) and lambdas == MOST_LAMBDAS
    if types.is_string(data_type) or is_deep:
        text = _readable_text(expression)
    elif types.is_list(data_type):
        inner = data_type.value_type
        element = _value("element", inner, is_hexadecimal=is_hexadecimal, lambdas=lambdas + 1)
        elements = f"list_transform({expression}, lambda element: {element})"
        text = f"'[' || array_to_string({elements}, ', ') || ']'"
    elif types.is_struct(data_type):
        members = ", ".join(
            f"CASE WHEN {value} IS NOT NULL THEN {literal(f'{field.name}=')} || "
            f"{_value(value, field.type, lambdas=lambdas)} END"
            for place, field in enumerate(data_type)
            for value in [member(expression, place)]
        )
        joined = f"concat_ws(', ', {members})" if members else "''"
        text = f"'{{' || {joined} || '}}'"
        text = f"CASE WHEN {expression} IS NOT NULL THEN {text} END"
    elif is_hexadecimal and types.is_unsigned_integer(data_type):
        text = f"format('0x{{:x}}', {expression})"
    else:
        text = f"CAST({expression} AS VARCHAR)"
    return f"coalesce({text}, 'null')"
