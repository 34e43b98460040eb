"""Statements of the program are parsed once."""

from __future__ import annotations

import duckdb
import pytest

from msgflow.sql.parsed import parsed


def test_any_connection_executes_what_another_has_parsed() -> None:
    with duckdb.connect() as first:
        statement = parsed(first, "SELECT $number + 1")
        assert first.execute(statement, {"number": 1}).fetchall() == [(2,)]
    with duckdb.connect() as second:
        assert parsed(second, "SELECT $number + 1") is statement
        assert second.execute(statement, {"number": 2}).fetchall() == [(3,)]


@pytest.mark.parametrize("text", ["", "SELECT 1; SELECT 2"])
def test_a_text_is_one_statement(text: str) -> None:
    with duckdb.connect() as connection, pytest.raises(ValueError, match="unpack"):
        parsed(connection, text)
