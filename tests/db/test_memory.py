"""The memory limit grows where it may, and says so where it may not."""

from __future__ import annotations

import duckdb
import pytest

from msgflow.db.memory import Memory, set_memory_limit
from msgflow.errors import DatabaseError

# Holds all its rows in memory at once, whatever may spill.
HUNGRY = "SELECT len(list(range)) FROM range(20000000)"


def limit_of(con: duckdb.DuckDBPyConnection) -> str:
    return str(con.execute("SELECT current_setting('memory_limit')").fetchall()[0][0])


def threads_of(con: duckdb.DuckDBPyConnection) -> int:
    return int(con.execute("SELECT current_setting('threads')").fetchall()[0][0])


def test_a_statement_that_needs_more_gets_it() -> None:
    with duckdb.connect() as con:
        memory = Memory(con, None)
        con.execute("SET memory_limit = '40MB'")
        assert memory.run(lambda: con.execute(HUNGRY).fetchall()) == [(20_000_000,)]
        assert limit_of(con) != "38.1 MiB"


def test_a_limit_that_the_user_gave_is_kept() -> None:
    with duckdb.connect() as con:
        memory = Memory(con, "40MB")
        with pytest.raises(DatabaseError, match="need more memory than 40MB"):
            memory.run(lambda: con.execute(HUNGRY).fetchall())
        assert limit_of(con) == "38.1 MiB"


@pytest.mark.parametrize(
    ("limit", "what"),
    [
        ("plenty", "not an amount"),
        ("-1", "not an amount"),
        ("14MB", "too little memory"),
        ("1B", "too little memory"),
    ],
)
def test_a_limit_that_nothing_can_work_with(limit: str, what: str) -> None:
    with duckdb.connect() as con, pytest.raises(DatabaseError, match=f"{what}.* — {limit}"):
        set_memory_limit(con, limit)


def test_a_small_limit() -> None:
    with duckdb.connect() as con:
        set_memory_limit(con, "16MB")
        assert limit_of(con) == "15.2 MiB"


def test_less_while_traces_are_read() -> None:
    """The reader needs memory, too, and rows that are written are not needed again."""
    with duckdb.connect() as con:
        usual = limit_of(con)
        memory = Memory(con, None)
        before = limit_of(con)
        with memory.loading():
            assert limit_of(con) == "41.9 MiB"
        assert limit_of(con) == before != usual
        for given, loading in (("40MB", "38.1 MiB"), ("160MB", "41.9 MiB"), ("4GiB", "1.0 GiB")):
            memory = Memory(con, given)
            whole = limit_of(con)
            with memory.loading():
                assert limit_of(con) == loading
            assert limit_of(con) == whole
        with Memory(con, "none").loading():
            assert limit_of(con).endswith("PiB")


def test_less_for_large_recordings() -> None:
    """What DuckDB keeps beside its limit grows with them."""
    with duckdb.connect() as con:
        for events, limit in (
            (0, "185.9 MiB"),
            (30_000_000, "179.0 MiB"),
            (100_000_000, "164.0 MiB"),
            (10**12, "164.0 MiB"),
        ):
            Memory(con, None).make_room(events)
            assert limit_of(con) == limit
        for given in ("50MB", "200MB", "1GB", "none"):
            fixed = Memory(con, given)
            before = limit_of(con)
            fixed.make_room(100_000_000)
            assert limit_of(con) == before


def test_freed_blocks_are_kept() -> None:
    """More of them where there is room, which is not known while traces are read."""

    def kept(con: duckdb.DuckDBPyConnection) -> str:
        return str(con.execute("SELECT current_setting('block_allocator_memory')").fetchall()[0][0])

    for events, limit, blocks in (
        (None, None, "91.5 MiB"),
        (0, None, "183.1 MiB"),
        (40_000_000, None, "128.1 MiB"),
        (100_000_000, None, "91.5 MiB"),
        (10**12, None, "91.5 MiB"),
        (None, "50MB", "47.5 MiB"),
        (0, "150MB", "143.0 MiB"),
        (0, "1GB", "183.1 MiB"),
        (0, "none", "183.1 MiB"),
    ):
        with duckdb.connect() as con:
            memory = Memory(con, limit)
            memory.keep_freed(events)
            assert kept(con) == blocks
            # It cannot become less again.
            memory.keep_freed(100_000_000)
            assert kept(con) == blocks


def test_a_limit_that_grew_is_not_taken_back() -> None:
    """A larger one is what a statement was short of."""
    with duckdb.connect() as con:
        memory = Memory(con, None)
        memory.make_room(100_000_000)
        with memory.loading():
            pass
        assert limit_of(con) == "164.0 MiB"
        assert memory.grow(2)
        assert limit_of(con) == "328.0 MiB"


def test_fewer_threads() -> None:
    with duckdb.connect() as con:
        memory = Memory(con, None)
        con.execute("SET threads = 5")
        for count, left in ((1, 1), (2, 2), (9, 5)):
            with memory.threads(count):
                assert threads_of(con) == left
            assert threads_of(con) == 5


@pytest.mark.parametrize(
    ("limit", "most"),
    [
        (None, 2),
        ("40MB", 2),
        ("312MB", 2),
        ("313MB", 3),
        ("500MB", 4),
        ("1GB", 8),
        ("3GB", 16),
        ("none", 16),
    ],
)
def test_no_more_threads_than_the_memory_is_enough_for(limit: str | None, most: int) -> None:
    with duckdb.connect() as con:
        con.execute("SET threads = 16")
        Memory(con, limit)
        assert threads_of(con) == most
        con.execute("SET threads = 1")
        Memory(con, limit)
        assert threads_of(con) == 1


def test_too_little_to_read() -> None:
    with duckdb.connect() as con:
        usual = Memory(con, None)
        before = limit_of(con)
        with pytest.raises(DatabaseError, match="need more memory than 195MB"), usual.loading():
            con.execute(HUNGRY)
        assert limit_of(con) == before


def test_not_an_amount() -> None:
    with duckdb.connect() as con, pytest.raises(DatabaseError, match="not an amount of memory"):
        Memory(con, "much")
