"""Transactions: all changes of a block, or none."""

from __future__ import annotations

import duckdb
import pytest

from msgflow.db.transaction import transaction


@pytest.fixture
def con() -> duckdb.DuckDBPyConnection:
    con = duckdb.connect()
    con.execute("CREATE TABLE one (number INTEGER UNIQUE)")
    return con


def test_the_changes_of_a_block_stay(con: duckdb.DuckDBPyConnection) -> None:
    with transaction(con):
        con.execute("INSERT INTO one VALUES (1)")
    con.begin()
    con.rollback()
    assert con.execute("FROM one").fetchall() == [(1,)]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_error_takes_them_back(
    con: duckdb.DuckDBPyConnection, error: type[BaseException]
) -> None:
    def change() -> None:
        with transaction(con):
            con.execute("INSERT INTO one VALUES (1)")
            raise error

    with pytest.raises(error):
        change()
    assert con.execute("FROM one").fetchall() == []


def test_the_error_of_an_ended_transaction_comes_through(con: duckdb.DuckDBPyConnection) -> None:
    def change() -> None:
        with transaction(con):
            con.rollback()
            raise ValueError("mine")

    with pytest.raises(ValueError, match="mine"):
        change()
