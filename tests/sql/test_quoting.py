"""Quoting: what is quoted comes back unchanged, whatever stands in it."""

from __future__ import annotations

import duckdb
import pytest

from msgflow.sql.quoting import identifier, literal


@pytest.mark.parametrize("text", ["", "a", "it's", 'a "b"', "''", '""', "a\\'b; --", "\n"])
def test_quoted_text_comes_back(text: str) -> None:
    name = text or "x"
    found = duckdb.sql(f"SELECT {literal(text)} AS {identifier(name)}")
    assert (found.columns, found.fetchall()) == ([name], [(text,)])
