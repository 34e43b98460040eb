"""When a clock was set, by what one subscription took: each number of the rule from both sides."""

from __future__ import annotations

from collections.abc import Sequence

import duckdb
import pytest

MILLISECOND = 1_000_000
SECOND = 1_000_000_000
PERIOD = 10 * MILLISECOND
BEFORE = 20
FIRST = -9_223_372_036_854_775_807


def record(
    con: duckdb.DuckDBPyConnection,
    ways: Sequence[int],
    *,
    topic: str = "/a",
    publisher: int = 1,
    published: int = 100,
) -> None:
    """Messages that are taken one period apart, and were stamped so long before."""
    con.execute(
        "INSERT INTO published (publication_id, topic_name, publisher_id, written_ns) "
        "SELECT n, ?, ?, n FROM range(?) AS r(n)",
        [topic, publisher, published],
    )
    con.executemany(
        "INSERT INTO message (topic_name, source_timestamp_ns, taken_ns, clock_id) "
        "VALUES (?, ?, ?, 2)",
        [(topic, n * PERIOD - way, n * PERIOD) for n, way in enumerate(ways)],
    )


def found(con: duckdb.DuckDBPyConnection) -> list[tuple[int, int]]:
    """By how much the clock was set in all, and since when."""
    rows = con.execute(
        "SELECT setting, set_ns, since_ns, until_ns "
        "FROM derive.clock_setting('published', 'received') ORDER BY setting"
    ).fetchall()
    assert [setting for setting, *_ in rows] == list(range(len(rows)))
    assert rows[0][1:3] == (0, FIRST)
    assert [since for _, _, since, _ in rows[1:]] == [until for *_, until in rows[:-1]]
    return [(by, since) for _, by, since, _ in rows[1:]]


def test_it_was_set_between_two_messages(rules: duckdb.DuckDBPyConnection) -> None:
    """The time is that of the clock as if it had not been set."""
    record(rules, [MILLISECOND] * BEFORE + [MILLISECOND + SECOND] * BEFORE)
    middle = BEFORE * PERIOD - MILLISECOND - PERIOD // 2
    assert found(rules) == [(-SECOND, middle)]


@pytest.mark.parametrize(("by", "is_found"), [(-15_000_001, True), (-15_000_000, False)])
def test_stamps_go_back_by_five_milliseconds(
    rules: duckdb.DuckDBPyConnection, by: int, *, is_found: bool
) -> None:
    """Threads of one subscription may be held up between two messages."""
    record(rules, [0] * BEFORE + [-by] * BEFORE)
    assert [by for by, _ in found(rules)] == [by] * is_found


@pytest.mark.parametrize(("by", "is_found"), [(-5_000_001, True), (-5_000_000, False)])
def test_all_that_follow_are_longer_on_their_way(
    rules: duckdb.DuckDBPyConnection, by: int, *, is_found: bool
) -> None:
    """One message alone was overtaken."""
    record(rules, [0] * BEFORE + [SECOND] + [-by] * BEFORE)
    assert [by for by, _ in found(rules)] == [by] * is_found


@pytest.mark.parametrize("by", [-SECOND, SECOND])
@pytest.mark.parametrize(
    ("before", "behind", "is_found"), [(8, 8, True), (7, 8, False), (8, 7, False)]
)
def test_eight_messages_before_and_behind(
    rules: duckdb.DuckDBPyConnection, by: int, before: int, behind: int, *, is_found: bool
) -> None:
    record(rules, [SECOND] * before + [SECOND - by] * behind)
    assert [by for by, _ in found(rules)] == [by] * is_found


@pytest.mark.parametrize(("by", "is_found"), [(100_000_001, True), (100_000_000, False)])
def test_it_was_set_forward_by_more_than_a_tenth_of_a_second(
    rules: duckdb.DuckDBPyConnection, by: int, *, is_found: bool
) -> None:
    record(rules, [by] * BEFORE + [0] * BEFORE)
    assert [by for by, _ in found(rules)] == [by] * is_found


@pytest.mark.parametrize(("first", "is_found"), [(SECOND // 2 - 1, True), (SECOND // 2, False)])
def test_more_than_half_of_it_between_two_messages(
    rules: duckdb.DuckDBPyConnection, first: int, *, is_found: bool
) -> None:
    """Those that waited in a queue come sooner and sooner."""
    record(rules, [SECOND] * BEFORE + [first] + [0] * BEFORE)
    assert [by for by, _ in found(rules)] == [SECOND] * is_found


@pytest.mark.parametrize(("more", "is_found"), [(SECOND // 2, True), (SECOND // 2 + 1, False)])
def test_messages_before_it_were_about_equally_long_on_their_way(
    rules: duckdb.DuckDBPyConnection, more: int, *, is_found: bool
) -> None:
    """Those that waited in a queue were not."""
    record(rules, [SECOND] * BEFORE + [SECOND + more] + [SECOND] * 7 + [0] * BEFORE)
    assert [by for by, _ in found(rules)] == [SECOND] * is_found


@pytest.mark.parametrize(("least", "is_found"), [(SECOND // 2 + 1, True), (SECOND // 2, False)])
def test_none_before_was_as_short_on_its_way(
    rules: duckdb.DuckDBPyConnection, least: int, *, is_found: bool
) -> None:
    slower = range(least, SECOND, PERIOD)
    record(rules, [*slower, *[SECOND] * BEFORE, *[0] * BEFORE])
    assert [by for by, _ in found(rules)] == [SECOND] * is_found


def test_a_clock_that_is_set_back_and_forward_again(rules: duckdb.DuckDBPyConnection) -> None:
    """No message since it was set back was as short on its way."""
    record(rules, [0] * BEFORE + [SECOND] * BEFORE + [0] * BEFORE)
    assert [by for by, _ in found(rules)] == [-SECOND, 0]


@pytest.mark.parametrize(("published", "is_found"), [(33, True), (32, False)])
def test_who_took_eight_messages_more_than_were_published_took_those_of_strangers(
    rules: duckdb.DuckDBPyConnection, published: int, *, is_found: bool
) -> None:
    record(rules, [0] * 20 + [SECOND] * 20, published=published)
    assert bool(found(rules)) is is_found


def test_nor_do_messages_of_two_publishers_tell(rules: duckdb.DuckDBPyConnection) -> None:
    record(rules, [0] * BEFORE + [SECOND] * BEFORE)
    rules.execute("UPDATE published SET publisher_id = 2 WHERE publication_id = 50")
    assert found(rules) == []


@pytest.mark.parametrize(("count", "is_found"), [(39, True), (41, False)])
def test_the_subscription_that_took_most_tells(
    rules: duckdb.DuckDBPyConnection, count: int, *, is_found: bool
) -> None:
    record(rules, [0] * BEFORE + [SECOND] * BEFORE)
    record(rules, [0] * count, topic="/b", publisher=2)
    assert bool(found(rules)) is is_found


def test_messages_count_in_the_order_in_which_they_were_taken(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    ways = [0] * BEFORE + [SECOND] * BEFORE
    rows = [(n * PERIOD - way, n * PERIOD) for n, way in enumerate(ways)]
    rules.execute(
        "INSERT INTO published (publication_id, written_ns) SELECT n, n FROM range(99) AS r(n)"
    )
    rules.executemany(
        "INSERT INTO message (source_timestamp_ns, taken_ns) VALUES (?, ?)", rows[::-1]
    )
    assert [by for by, _ in found(rules)] == [-SECOND]
