"""Statements of the program, each parsed once per process: a seventh of what a small one takes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import duckdb

_KNOWN: dict[str, duckdb.Statement] = {}


def parsed(con: duckdb.DuckDBPyConnection, text: str) -> duckdb.Statement:
    """Return the one statement that a text of the program is; any connection can execute it.

    Args:
        con: any connection; it parses.
        text: its SQL. What a user writes does not belong here: it is kept as long as the process.

    Raises:
        ValueError: it is no statement, or more than one.
    """
    if text not in _KNOWN:
        (_KNOWN[text],) = con.extract_statements(text)
    return _KNOWN[text]
