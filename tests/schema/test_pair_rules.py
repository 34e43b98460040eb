"""Which messages are laid beside which publications, each number of the rules from both sides."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import duckdb
import pytest

MILLISECOND = 1_000_000
SECOND = 1_000_000_000


def publish(con: duckdb.DuckDBPyConnection, *rows: tuple[int, int, int | None]) -> None:
    """Publications as (identity, time written, next event of the thread)."""
    con.executemany(
        "INSERT INTO published (publication_id, written_ns, next_event_ns) VALUES (?, ?, ?)", rows
    )


def pairs(con: duckdb.DuckDBPyConnection, columns: str) -> Sequence[tuple[Any, ...]]:
    return con.execute(f"SELECT {columns} FROM derive.stamp_pair(1) ORDER BY ALL").fetchall()


@pytest.mark.parametrize(
    ("next_event", "has_break", "closes"),
    [
        pytest.param(9_000_000, False, 9_000_000, id="seen_to_go_on"),
        pytest.param(9_000_000, True, 5_000_000, id="not_seen_for_a_while"),
        pytest.param(4_000_000, True, 4_000_000, id="nor_after_that"),
        pytest.param(None, False, 5_000_000, id="never"),
    ],
)
def test_how_long_a_message_is_written(
    rules: duckdb.DuckDBPyConnection, next_event: int | None, has_break: bool, closes: int
) -> None:
    publish(rules, (1, 0, next_event))
    rules.execute("UPDATE published SET has_break = ?", [has_break])
    rules.execute("INSERT INTO message (source_timestamp_ns, taken_ns) VALUES (100, 200)")
    assert pairs(rules, "least_ns, greatest_ns") == [(100 - closes, 100)]


@pytest.mark.parametrize(
    ("duration_ns", "messages", "count"),
    [
        pytest.param(10 * SECOND, 1_200, 20, id="half_a_second_each"),
        pytest.param(2 * SECOND, 1_200, 8, id="at_least_eight"),
        pytest.param(600 * SECOND, 12_000, 600, id="at_most_six_hundred"),
        pytest.param(10 * SECOND, 60, 5, id="a_dozen_messages_each"),
        pytest.param(10 * SECOND, 11, 1, id="one_of_few_messages"),
    ],
)
def test_stretches_of_time(
    rules: duckdb.DuckDBPyConnection, duration_ns: int, messages: int, count: int
) -> None:
    publish(rules, (1, 0, 1_000), (2, duration_ns, duration_ns + 1_000))
    rules.execute(
        "INSERT INTO message (source_timestamp_ns, taken_ns) "
        "SELECT n, n + 10 FROM range(?) AS r(n)",
        [messages],
    )
    assert pairs(rules, "DISTINCT stretch_ns") == [(1 + duration_ns // count,)]


def test_enough_messages_of_a_stretch_of_every_publisher(rules: duckdb.DuckDBPyConnection) -> None:
    for publisher, topic in ((1, "/a"), (2, "/b")):
        rules.execute(
            "INSERT INTO published (topic_name, publisher_id, publication_id, written_ns) "
            "SELECT ?, ?, n, n * 2000000000 FROM range(2) AS r(n)",
            [topic, publisher],
        )
        rules.execute(
            "INSERT INTO message SELECT 1, ?, ? + n * 10, 0, 1, 2000 FROM range(100) AS r(n)",
            [topic, publisher],
        )
    publishers = [publisher for (publisher, _) in pairs(rules, "publisher_id, greatest_ns")]
    assert publishers == [1] * 24 + [2] * 24


@pytest.mark.parametrize(("clock_id", "behind"), [(1, 0), (2, 24)])
def test_two_dozen_publications_of_a_message(
    rules: duckdb.DuckDBPyConnection, clock_id: int, behind: int
) -> None:
    """Before it was taken; of messages taken elsewhere, on either side of the stamp."""
    publish(rules, *((n, n * MILLISECOND, n * MILLISECOND + 1_000) for n in range(100)))
    taken_ns = 50 * MILLISECOND + 100
    rules.execute(
        "INSERT INTO message VALUES (1, '/a', ?, 0, ?, ?)", [taken_ns, clock_id, taken_ns]
    )
    found = pairs(rules, "written_ns // 1000000, is_latest, is_taken_here")
    assert [number for number, _, _ in found] == [*range(50 - 24, 50 + behind + 1)]
    assert {number for number, is_latest, _ in found if is_latest} == {50}
    assert {is_taken_here for _, _, is_taken_here in found} == {clock_id == 1}


def test_a_message_that_several_readers_took(rules: duckdb.DuckDBPyConnection) -> None:
    """The first take on the clock of its publisher counts. Another publisher has its own times."""
    publish(rules, *((n, n * MILLISECOND, n * MILLISECOND + 1_000) for n in range(100)))
    rules.execute(
        "INSERT INTO published (topic_name, publisher_id, publication_id, written_ns) "
        "VALUES ('/b', 2, 200, 50000100)"
    )
    for clock_id, taken_ns in ((2, 20), (1, 50), (1, 90)):
        rules.execute(
            "INSERT INTO message VALUES (1, '/a', 50000200, 0, ?, ?)",
            [clock_id, taken_ns * MILLISECOND + 300],
        )
    found = pairs(rules, "written_ns // 1000000, is_taken_here")
    assert found == [(n, True) for n in range(26, 51)]


HOUR_NS = 3_600 * SECOND


def test_each_clock_has_its_own_time(rules: duckdb.DuckDBPyConnection) -> None:
    """What is published on two of them is taken on two others; once the clock of stamps is set.

    One message waited. When the message with the strange stamp was first taken tells the rest.
    """
    for number, (topic, start_ns) in enumerate((("/a", 0), ("/b", -HOUR_NS)), 1):
        rules.execute(
            "INSERT INTO published (clock_id, topic_name, publisher_id, publication_id, "
            "written_ns, next_event_ns) SELECT $number, $topic, $number, n, "
            "$start + n * 1000000, $start + n * 1000000 + 2000 FROM range(200) AS r(n)",
            {"number": number, "topic": topic, "start": start_ns},
        )
    strange = 3 * HOUR_NS
    rules.execute(
        "INSERT INTO message (topic_name, source_timestamp_ns, clock_id, taken_ns) VALUES "
        "('/a', 500, 3, 200500), ('/a', 100000500, 3, 180200500), ('/a', 600, 4, $later), "
        "('/b', $earlier, 3, 200500), ('/a', $strange, 3, 50200500), "
        "('/a', $strange, 3, 150200500), ('/a', $strange + 7, 4, $later + 50000000)",
        {"later": HOUR_NS, "earlier": 500 - HOUR_NS, "strange": strange},
    )
    found = pairs(rules, "written_ns + greatest_ns AS stamp_ns, written_ns, clock_id")
    written: dict[tuple[int, int], list[int]] = {}
    for stamp_ns, written_ns, clock_id in found:
        written.setdefault((stamp_ns, clock_id), []).append(written_ns // MILLISECOND)
    assert written == {
        (500 - HOUR_NS, 2): [n - HOUR_NS // MILLISECOND for n in range(25)],
        (500, 1): [*range(25)],
        (600, 1): [*range(25)],
        (100_000_500, 1): [*range(76, 125), *range(156, 200)],
        (strange, 1): [*range(26, 75)],
        (strange + 7, 1): [*range(26, 75)],
    }


def test_a_stamp_from_before_the_first_publication(rules: duckdb.DuckDBPyConnection) -> None:
    """The clock was set back, but other topics of it were published by then."""
    for number, (topic, since) in enumerate((("/a", 0), ("/b", 100)), 1):
        rules.execute(
            "INSERT INTO published (topic_name, publisher_id, publication_id, written_ns) "
            "SELECT $topic, $number, n, n * 1000000 FROM range($since, 200) AS r(n)",
            {"number": number, "topic": topic, "since": since},
        )
    rules.execute(
        "INSERT INTO message (topic_name, source_timestamp_ns, taken_ns) "
        "VALUES ('/b', 50000000, 150200000)"
    )
    found = pairs(rules, "written_ns // 1000000")
    assert [place for (place,) in found] == [*range(126, 151)]


def test_the_time_that_a_publication_has(rules: duckdb.DuckDBPyConnection) -> None:
    """Until its thread goes on, or the next one is written; 5 ms where neither is known."""
    publish(
        rules,
        (1, 0, 1_000),
        (2, 5_000, 9_000),
        (3, 7_000, 9_000),
        (4, 20 * MILLISECOND, None),
    )
    stamp = 30 * MILLISECOND
    rules.execute("INSERT INTO message VALUES (1, '/a', ?, 0, 1, ?)", [stamp, stamp])
    assert pairs(rules, "written_ns, greatest_ns, least_ns") == [
        (0, stamp, stamp - 1_000),
        (5_000, stamp - 5_000, stamp - 7_000),
        (7_000, stamp - 7_000, stamp - 9_000),
        (20 * MILLISECOND, stamp - 20 * MILLISECOND, stamp - 25 * MILLISECOND),
    ]


def test_publications_of_one_moment_are_one(rules: duckdb.DuckDBPyConnection) -> None:
    """Which of them a message is of the difference of the clocks does not depend on."""
    publish(rules, (1, 0, 1_000), (2, 0, 1_000), (3, 2_000, 3_000))
    rules.execute("INSERT INTO message VALUES (1, '/a', 500, 0, 1, 4_000)")
    assert pairs(rules, "written_ns, greatest_ns, least_ns") == [
        (0, 500, -500),
        (2_000, -1_500, -2_500),
    ]


def test_a_publication_counts_once_at_a_difference(rules: duckdb.DuckDBPyConnection) -> None:
    """Only the first message that it may have sent counts; another publisher has its own."""
    for publisher, topic in ((1, "/a"), (2, "/b")):
        rules.execute(
            "INSERT INTO published (topic_name, publisher_id, publication_id, written_ns, "
            "next_event_ns) VALUES (?, ?, ?, 0, 1_000)",
            [topic, publisher, publisher],
        )
    rules.execute(
        "INSERT INTO message VALUES (1, '/a', 500, 0, 1, 9_000), (1, '/b', 600, 0, 1, 9_000), "
        "(1, '/a', 900, 0, 1, 9_000), (1, '/a', 5_000, 0, 1, 9_000)"
    )
    assert pairs(rules, "publisher_id, greatest_ns, least_ns") == [
        (1, 500, -500),
        (1, 900, 500),
        (1, 5_000, 4_000),
        (2, 600, -400),
    ]


def test_the_middle_of_a_stretch(rules: duckdb.DuckDBPyConnection) -> None:
    publish(rules, (1, 0, 1_000), (2, 999, 1_500))
    rules.execute("INSERT INTO message VALUES (1, '/a', 400, 0, 1, 500)")
    assert pairs(rules, "stretch, stretch_ns, beyond_middle_ns") == [(0, 1_000, -500)]
