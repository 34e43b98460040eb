"""Values as people read them: durations, cells of tables, titles of columns, printable text.

Tables and Markdown use them; all other formats are exact.
"""

from __future__ import annotations

import re
from typing import Any

from msgflow.run.window import format_epoch
from msgflow.text.json_value import is_map, json_value

ARROW = " → "
"""Between the steps of a path."""

# `module:function`, as the tracer of Python nodes has it.
_PYTHON = re.compile(r"[^\s:(<]+:[^:]")
_BOUND = re.compile(r"std::_Bind<[^(]*\((?P<owner>[\w:]+)::\*")

NULL = "-"
DURATION = "ns"
SHARE = "share"
MOMENT = "epoch ns"


def format_duration(duration_ns: float) -> str:
    """Return a duration with the unit that fits: '812 ns', '562.411 µs', '45.602 ms', '1.250 s'."""
    whole = round(duration_ns)
    sign, size = ("-", -whole) if whole < 0 else ("", whole)
    if size < 1_000:
        return f"{sign}{size} ns"
    thousandths, unit = size, "µs"
    if size >= 1_000_000:
        thousandths, unit = (size + 500) // 1_000, "ms"
    if thousandths >= 1_000_000:
        thousandths, unit = (size + 500_000) // 1_000_000, "s"
    return f"{sign}{thousandths // 1_000}.{thousandths % 1_000:03d} {unit}"


def format_cell(value: Any, unit: str | None = None, *, is_handle: bool = False) -> str:
    """Return one cell of a table.

    Its unit is 'ns' for durations, 'epoch ns' for points in time, or 'share' for parts of 1. A
    handle is an address, shown in hexadecimal.
    """
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return _number(value, unit, is_handle)
    if is_map(value):
        # Counts of words are read as a sentence is, labels as they are given.
        return ", ".join(
            f"{format_cell(key)}{' ' if isinstance(item, int) else '='}{format_cell(item)}"
            for key, item in value
        )
    value = json_value(value)
    if value is None:
        return NULL
    if isinstance(value, int | float):
        return _number(value, unit, is_handle)
    if isinstance(value, list):
        return ", ".join(format_cell(item, unit, is_handle=is_handle) for item in value)
    return printable(str(value))


def short_symbol(symbol: str) -> str:
    """Return the name of a function without arguments and template parameters.

    For a bound method, C++ keeps only the class: `Camera::*`.
    """
    if _PYTHON.match(symbol):
        return symbol.replace(".<locals>", "")
    if bound := _BOUND.match(symbol):
        return f"{bound['owner']}::*"
    depth = 0
    name = ""
    for character in symbol:
        depth += character in "(<"
        name += "" if depth else character
        depth -= character in ")>" and depth > 0
    return name.strip() or symbol


def column_title(name: str, unit: str | None, names: tuple[str, ...]) -> str:
    """Return the title of a column, without `_ns` if its cells have units."""
    short = name.removesuffix("_ns")
    if unit in (DURATION, MOMENT) and short and (short == name or short not in names):
        return printable(short)
    return printable(name)


def _number(value: float, unit: str | None, is_handle: bool) -> str:
    if unit == DURATION:
        return format_duration(value)
    if isinstance(value, int):
        if unit == MOMENT:
            return format_epoch(value)
        return f"0x{value:x}" if is_handle else str(value)
    if value == 0 or abs(value) >= 0.001 or unit == SHARE:
        return f"{value:.3f}"
    return f"{value:.3g}"


def count(number: int, thing: str) -> str:
    """Return '1 row', '1,234 rows'."""
    return f"{number:,} {thing}" if number == 1 else f"{number:,} {thing}s"


def printable(text: str, keep: str = "") -> str:
    """Return text with control characters escaped as in Python.

    Names come from traces: no terminal may obey what is in them.
    """
    if text.isprintable():
        return text
    return "".join(
        character if character.isprintable() or character in keep else repr(character)[1:-1]
        for character in text
    )
