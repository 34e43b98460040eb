"""The memory limit: its default, what is refused, and how many threads it is enough for."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import duckdb
import pytest

from msgflow.db.memory import (
    default_limit,
    ingest_memory_errors,
    limit_threads,
    set_memory_limit,
)
from msgflow.errors import DatabaseError

# Holds all its rows in memory at once, whatever may spill.
HUNGRY = "SELECT len(list(range)) FROM range(20000000)"


def limit_of(con: duckdb.DuckDBPyConnection) -> str:
    return str(con.execute("SELECT current_setting('memory_limit')").fetchall()[0][0])


@pytest.mark.parametrize(
    ("machine", "limit"),
    [
        ("1GB", "0.5GB"),
        ("2GB", "0.5GB"),
        ("8GB", "2.0GB"),
        ("16GB", "4.0GB"),
        ("1TB", "4.0GB"),
    ],
)
def test_a_quarter_of_the_machine(
    machine: str, limit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    connect = duckdb.connect

    def connect_on_another_machine(*args: Any, **options: Any) -> duckdb.DuckDBPyConnection:
        con = connect(*args, **options)
        size = float(machine[:-2]) * {"GB": 1e9, "TB": 1e12}[machine[-2:]]
        con.execute(f"SET memory_limit = '{0.8 * size:.0f}B'")  # as DuckDB does by itself
        return con

    monkeypatch.setattr(duckdb, "connect", connect_on_another_machine)
    assert default_limit() == limit


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


@pytest.mark.parametrize(
    ("limit", "most"),
    [("40MB", 1), ("187MB", 1), ("188MB", 2), ("500MB", 4), ("3GB", 16), ("none", 16)],
)
def test_no_more_threads_than_the_memory_is_enough_for(limit: str, most: int) -> None:
    with duckdb.connect() as con:
        set_memory_limit(con, limit)
        for threads in (16, 1):
            con.execute(f"SET threads = {threads}")
            limit_threads(con)
            found = con.execute("SELECT current_setting('threads')").fetchone()
            assert found == (min(most, threads),)


def test_traces_that_need_more_memory_say_what_to_do() -> None:
    with duckdb.connect() as con:
        con.execute("SET memory_limit = '40MB'")
        with (
            pytest.raises(DatabaseError, match="need more memory than 40MB") as raised,
            ingest_memory_errors("40MB"),
        ):
            con.execute(HUNGRY)
    assert "--memory-limit" in str(raised.value.hint)


@pytest.mark.parametrize(("limit", "beside"), [(2_000_000_000, 500_000_000), (10**8, 1 << 28)])
def test_a_process_may_take_a_quarter_more_than_its_limit(limit: int, beside: int) -> None:
    code = (
        "import resource, duckdb\n"
        "from msgflow.db.memory import bound_process\n"
        "con = duckdb.connect()\n"
        f"con.execute('SET memory_limit = \"{limit}B\"')\n"
        "bound_process(con)\n"
        "used = int(open('/proc/self/statm').read().split()[5]) * resource.getpagesize()\n"
        "print(resource.getrlimit(resource.RLIMIT_DATA)[0] - used)\n"
        # A machine may give less: that stays.
        "resource.setrlimit(resource.RLIMIT_DATA, (1 << 40, 1 << 40))\n"
        "bound_process(con)\n"
        "assert resource.getrlimit(resource.RLIMIT_DATA)[1] == 1 << 40\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    # DuckDB says its limit with one decimal; the process goes on taking a little.
    assert int(done.stdout) == pytest.approx(limit + beside, rel=0.05)
