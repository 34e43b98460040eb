"""Which messages are laid beside which publications, each number of the rules from both sides."""

from __future__ import annotations

import duckdb
import pytest
from support.rules import insert

MILLISECOND = 1_000_000


def publish(con: duckdb.DuckDBPyConnection, *times: int, width: int = 1_000) -> None:
    rows = [(n, time, time + width) for n, time in enumerate(times)]
    insert(con, "published", "publication_id, written_ns, closes_ns", rows)


def take(con: duckdb.DuckDBPyConnection, *rows: tuple[int, int]) -> None:
    insert(con, "message", "source_timestamp_ns, taken_ns", rows)


def pairs(con: duckdb.DuckDBPyConnection) -> list[tuple[int, int, int]]:
    """(stamp, least difference, greatest difference)"""
    return con.execute(
        "SELECT source_timestamp_ns, least_ns, greatest_ns FROM derive.stamp_pair(1) ORDER BY ALL"
    ).fetchall()


@pytest.mark.parametrize(("taken", "count"), [(101, 49), (60, 35)])
def test_two_dozen_publications_on_either_side_that_were_written_before_the_take(
    rules: duckdb.DuckDBPyConnection, taken: int, count: int
) -> None:
    publish(rules, *(n * MILLISECOND for n in range(100)))
    take(rules, (50 * MILLISECOND, taken * MILLISECOND))
    found = [greatest // MILLISECOND for _, _, greatest in pairs(rules) if abs(greatest) < 25e6]
    assert len(found) == count


def test_a_take_tells_where_a_stamp_of_another_time_belongs(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    publish(rules, *(n * MILLISECOND for n in range(100)))
    take(rules, (-7 * MILLISECOND, 99 * MILLISECOND))
    assert len(pairs(rules)) == 25


def test_a_publication_has_the_time_until_the_next(rules: duckdb.DuckDBPyConnection) -> None:
    publish(rules, 0, 400, width=1_000)
    take(rules, (500, 10_000))
    assert pairs(rules) == [(500, -900, 100), (500, 100, 500)]


def test_of_two_messages_the_first_is_of_a_publication(rules: duckdb.DuckDBPyConnection) -> None:
    publish(rules, 0, width=1_000)
    take(rules, (300, 10_000), (500, 10_000))
    assert pairs(rules) == [(300, -700, 300), (500, 300, 500)]


def test_publications_of_one_moment_are_one(rules: duckdb.DuckDBPyConnection) -> None:
    publish(rules, 0, 0)
    take(rules, (500, 10_000))
    assert pairs(rules) == [(500, -500, 500)]


@pytest.mark.parametrize(("last_seen", "count"), [(10_000, 1), (9_999, 0)])
def test_what_came_behind_the_end_of_the_process_tells_nothing(
    rules: duckdb.DuckDBPyConnection, last_seen: int, count: int
) -> None:
    publish(rules, 0)
    rules.execute("UPDATE published SET last_seen_ns = ?", [last_seen])
    take(rules, (500, 10_000))
    assert len(pairs(rules)) == count


@pytest.mark.parametrize(
    ("count", "stretches"), [(47, 2), (48, 2), (49, 3), (400, 9), (960, 20), (19_200, 134)]
)
def test_how_many_stretches_a_recording_has(
    rules: duckdb.DuckDBPyConnection, count: int, stretches: int
) -> None:
    """Two dozen to four dozen messages each; of a long recording some stretches."""
    publish(rules, *(n * MILLISECOND for n in range(count)))
    take(rules, *((n * MILLISECOND + 500, n * MILLISECOND + 900) for n in range(count)))
    found = rules.sql("SELECT count(DISTINCT stretch) FROM derive.stamp_pair(1)").fetchall()
    assert found == [(stretches,)]
