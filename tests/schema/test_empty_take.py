"""Attempts to take that found nothing, outside of callbacks."""

from __future__ import annotations

import random

import duckdb
import pytest
from support.rules import derived
from support.thorough import few

TABLES = {
    "store.failed_take": "run_id, subscription_id, thread_id, failed_ns",
    "store.callback_instance": "run_id, callback_instance_id, thread_id, start_ns, end_ns",
}


@pytest.mark.parametrize("seed", few(range(3), 0))
def test_the_callback_counts_that_began_last_before_the_attempt(seed: int) -> None:
    chance = random.Random(seed)
    with derived("", ("empty_take",), TABLES) as con:
        callbacks = [
            (thread, start, None if chance.random() < 0.3 else start + chance.randrange(5))
            for thread in (1, 2)
            for start in chance.sample(range(500), 150)
        ]
        attempts = [(chance.choice([1, 2, 3]), at) for at in chance.sample(range(510), 50)]
        fill(con, callbacks, attempts)
        found = con.execute(
            "SELECT thread_id, failed_ns FROM derive.empty_take ORDER BY ALL"
        ).fetchall()
    assert 15 < len(found) < 45
    assert found == sorted(each for each in attempts if is_outside(callbacks, *each))


def fill(
    con: duckdb.DuckDBPyConnection,
    callbacks: list[tuple[int, int, int | None]],
    attempts: list[tuple[int, int]],
) -> None:
    con.executemany("INSERT INTO store.failed_take VALUES (1, 1, ?, ?)", attempts)
    con.executemany(
        "INSERT INTO store.callback_instance VALUES (1, ?, ?, ?, ?)",
        [(number, *callback) for number, callback in enumerate(callbacks)],
    )


def is_outside(callbacks: list[tuple[int, int, int | None]], thread: int, at: int) -> bool:
    before = [(start, end) for of, start, end in callbacks if of == thread and start <= at]
    if not before:
        return True
    _, end = max(before)
    return end is not None and end < at
