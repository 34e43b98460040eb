"""Values of parameters: written as a literal in a header, or as text on the command line."""

from __future__ import annotations

import re

Value = None | bool | int | float | str | list["Value"]

_INTEGER = re.compile(r"[+-]?\d+")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_WORDS: dict[str, Value] = {"null": None, "true": True, "false": False}
_INTEGER_TYPE = re.compile(r"U?(TINYINT|SMALLINT|INTEGER|BIGINT|HUGEINT)")
_REAL_TYPES = frozenset(("FLOAT", "DOUBLE"))
_YES = frozenset(("true", "yes", "on", "1"))
_NO = frozenset(("false", "no", "off", "0"))


def is_integer(type_name: str) -> bool:
    """Tell whether `type_name` is an integer type of DuckDB."""
    return _INTEGER_TYPE.fullmatch(type_name.upper()) is not None


def described_type(type_name: str) -> str:
    """Return a plain name for values of the DuckDB type `type_name`, such as 'a whole number'."""
    name = type_name.upper()
    if name.endswith("[]"):
        return "values separated by commas"
    if is_integer(name):
        return "a whole number"
    if name in _REAL_TYPES or name.startswith("DECIMAL"):
        return "a number"
    return "yes or no" if name == "BOOLEAN" else "text"


def parse_literal(text: str) -> Value:
    """Return the value of a literal in SQL: NULL, a truth value, number, string or list."""
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _NUMBER.fullmatch(text):
        return float(text)
    if len(text) > 1 and text[0] == text[-1] == "'":
        return text[1:-1].replace("''", "'")
    if text.startswith("[") and text.endswith("]"):
        return [parse_literal(part.strip()) for part in text[1:-1].split(",") if part.strip()]
    raise ValueError(f"{text!r} is not NULL, TRUE, FALSE, a number, a 'string' or a [list]")


def parse_text(text: str, type_name: str) -> Value:
    """Return the value of `text`, typed by a user, for a parameter of DuckDB type `type_name`.

    Integers may be hexadecimal (0x…, the form of handles); commas separate a list.
    """
    if type_name.endswith("[]"):
        return [parse_text(part.strip(), type_name[:-2]) for part in text.split(",") if part]
    if is_integer(type_name):
        return int(text, 0) if text.lower().startswith("0x") else int(text)
    name = type_name.upper()
    if name in _REAL_TYPES or name.startswith("DECIMAL"):
        return float(text)
    if name == "BOOLEAN":
        if text.lower() not in _YES | _NO:
            raise ValueError(text)
        return text.lower() in _YES
    return text
