"""JSON values: what JSON and CSV can hold, with every digit of integers."""

from __future__ import annotations

import json
import math
from datetime import date, datetime, time
from decimal import Decimal
from typing import Any


def json_value(value: Any) -> Any:
    """Return a value made of None, bool, int, float, str, list and dict only.

    Bytes become hexadecimal text, whole decimals become integers, NaN and infinities become None,
    and the pairs that Arrow makes of a map become a dict.
    """
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, bytes):
        return value.hex()
    if isinstance(value, Decimal):
        return int(value) if value == value.to_integral_value() else float(value)
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    if isinstance(value, dict):
        return {str(key): json_value(item) for key, item in value.items()}
    if is_map(value):
        return {str(key): json_value(item) for key, item in value}
    if isinstance(value, list | tuple):
        return [json_value(item) for item in value]
    return str(value)


def is_map(value: Any) -> bool:
    """Tell whether a value is a map with entries, as Arrow returns it: a list of pairs."""
    return (
        isinstance(value, list) and bool(value) and all(isinstance(item, tuple) for item in value)
    )


def json_text(value: Any) -> str | None:
    """Return a value as text: JSON, unless it is a text itself, or missing."""
    simple = json_value(value)
    if simple is None or isinstance(simple, str):
        return simple
    return json.dumps(simple, ensure_ascii=False)
