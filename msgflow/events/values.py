"""SQL expressions that turn values of any type into text or JSON.

Names of fields come from traces: they stand in SQL only as quoted literals.
"""

from __future__ import annotations

import pyarrow as pa

from msgflow.sql.quoting import literal

# Controls, characters without a shape, and line separators: no terminal may obey a trace.
_UNPRINTABLE = r"[\p{C}\p{Zl}\p{Zp}]"
# DuckDB needs ten times as long to bind each further lambda inside a lambda.
_MOST_LAMBDAS = 2
_REPLACEMENT = "\N{REPLACEMENT CHARACTER}"


def printable(expression: str) -> str:
    """Return the SQL of a text without unprintable characters."""
    return f"regexp_replace({expression}, '{_UNPRINTABLE}', '{_REPLACEMENT}', 'g')"


def exact(expression: str, data_type: pa.DataType, lambdas: int = 0) -> str:
    """Return the SQL of a value that JSON can hold: NaN and infinities become NULL.

    Arrays of arrays of arrays of floating point numbers become text.

    Args:
        expression: SQL of the value.
        data_type: of the value.
        lambdas: lists around the value.
    """
    types = pa.types
    if not _has_floats(data_type):
        return expression
    if types.is_floating(data_type):
        return f"CASE WHEN isfinite({expression}) THEN {expression} END"
    if types.is_list(data_type):
        if lambdas == _MOST_LAMBDAS:
            return f"CAST({expression} AS VARCHAR)"
        element = exact("element", data_type.value_type, lambdas + 1)
        return f"list_transform({expression}, lambda element: {element})"
    members = ", ".join(
        f"{literal(field.name)}, {exact(_member(expression, field), field.type, lambdas)}"
        for field in data_type
    )
    return f"CASE WHEN {expression} IS NOT NULL THEN json_object({members}) END"


def readable(
    expression: str, data_type: pa.DataType, *, is_hexadecimal: bool = False, lambdas: int = 0
) -> str:
    """Return the SQL of a value as people read it, never NULL.

    Text is quoted as in JSON, lists are `[1, 2]`, structures `{name=value, …}` without missing
    members. Values inside more than two lists are as in JSON.

    Args:
        expression: SQL of the value.
        data_type: of the value.
        is_hexadecimal: show unsigned integers in base 16.
        lambdas: lists around the value.
    """
    types = pa.types
    is_deep = types.is_list(data_type) and lambdas == _MOST_LAMBDAS
    if types.is_string(data_type) or is_deep:
        text = printable(f"CAST(to_json({expression}) AS VARCHAR)")
    elif types.is_list(data_type):
        inner = data_type.value_type
        element = readable("element", inner, is_hexadecimal=is_hexadecimal, lambdas=lambdas + 1)
        elements = f"list_transform({expression}, lambda element: {element})"
        text = f"'[' || array_to_string({elements}, ', ') || ']'"
    elif types.is_struct(data_type):
        members = ", ".join(
            f"CASE WHEN {member} IS NOT NULL THEN {literal(f'{field.name}=')} || "
            f"{readable(member, field.type, lambdas=lambdas)} END"
            for field in data_type
            for member in [_member(expression, field)]
        )
        joined = f"concat_ws(', ', {members})" if members else "''"
        text = f"'{{' || {joined} || '}}'"
        text = f"CASE WHEN {expression} IS NOT NULL THEN {text} END"
    elif is_hexadecimal and types.is_unsigned_integer(data_type):
        text = f"format('0x{{:x}}', {expression})"
    else:
        text = f"CAST({expression} AS VARCHAR)"
    return f"coalesce({text}, 'null')"


def _member(expression: str, field: pa.Field) -> str:
    return f"struct_extract({expression}, {literal(field.name)})"


def _has_floats(data_type: pa.DataType) -> bool:
    if pa.types.is_list(data_type):
        return _has_floats(data_type.value_type)
    if pa.types.is_struct(data_type):
        return any(_has_floats(field.type) for field in data_type)
    return bool(pa.types.is_floating(data_type))
