"""SQL expressions that turn values of any type into text.

Names of fields come from traces: they stand in SQL only as quoted literals.
"""

from __future__ import annotations

import pyarrow as pa

from msgflow.sql.json_fields import MOST_LAMBDAS, member
from msgflow.sql.quoting import literal

# Controls, characters without a shape, and line separators: no terminal may obey a trace.
_UNPRINTABLE = r"[\p{C}\p{Zl}\p{Zp}]"
_REPLACEMENT = "\N{REPLACEMENT CHARACTER}"


def printable(expression: str) -> str:
    """Return the SQL of a text without unprintable characters."""
    return f"regexp_replace({expression}, '{_UNPRINTABLE}', '{_REPLACEMENT}', 'g')"


def readable_text(expression: str) -> str:
    """Return the SQL of a text or of JSON as people read it: quoted as in JSON."""
    return printable(f"CAST(to_json({expression}) AS VARCHAR)")


def readable(
    expression: str, data_type: pa.DataType, *, is_hexadecimal: bool = False, lambdas: int = 0
) -> str:
    """Return the SQL of a value as people read it, never NULL.

    Text is quoted as in JSON, lists are `[1, 2]`, structures `{name=value, …}` without missing
    members. Values inside more than two lists are as in JSON.
    """
    types = pa.types
    is_deep = types.is_list(data_type) and lambdas == MOST_LAMBDAS
    if types.is_string(data_type) or is_deep:
        text = readable_text(expression)
    elif types.is_list(data_type):
        inner = data_type.value_type
        element = readable("element", inner, is_hexadecimal=is_hexadecimal, lambdas=lambdas + 1)
        elements = f"list_transform({expression}, lambda element: {element})"
        text = f"'[' || array_to_string({elements}, ', ') || ']'"
    elif types.is_struct(data_type):
        members = ", ".join(
            f"CASE WHEN {value} IS NOT NULL THEN {literal(f'{field.name}=')} || "
            f"{readable(value, field.type, lambdas=lambdas)} END"
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
