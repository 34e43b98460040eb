"""When messages can be received at the earliest, on the clock of those who subscribe."""

from __future__ import annotations

import pytest
from support.rules import derived

# Each process has a clock of its own. Process 1 publishes on /a; processes 1 and 2 subscribe to it.
# From 100 on messages tell how far their clocks are apart. Process 3 has another topic. Process 4
# belongs to another run. /c has no subscription.
STAGE = """
CREATE TABLE derive.process_clock AS FROM (
    VALUES (1, 1), (2, 2), (3, 3), (4, 4)
) AS p(process_id, clock_id);
CREATE TABLE store.clock AS FROM (
    VALUES (1, 9, 5, 0, 0), (2, 9, 2, 0, 0), (3, 9, 40, 0, 0), (4, 9, 50, 0, 0)
) AS c(clock_id, reference_clock_id, offset_ns, drift_ppb, reference_ns);
CREATE TABLE derive.clock_shift AS FROM (
    VALUES (1, 1, 2, 100, 7), (1, 1, 2, 200, 8),
    (1, 3, 2, 150, 96), (1, 1, 3, 150, 97), (1, 2, 1, 150, 98), (2, 1, 2, 150, 99)
) AS s(run_id, from_clock_id, to_clock_id, from_ns, shift_ns);
CREATE TABLE store.subscription AS FROM (
    VALUES (1, '/a', 1, false), (1, '/a', 2, false), (1, '/a', 2, false), (1, '/b', 3, false),
        (2, '/a', 4, false), (1, '/a', 3, true)
) AS s(run_id, topic_name, process_id, is_agnocast);
CREATE TABLE store.publisher AS FROM (
    VALUES (1, 1, '/a', 1, false), (1, 2, '/c', 1, false), (1, 3, '/a', 1, true),
        (1, 4, '/a', 3, true)
) AS p(run_id, publisher_id, topic_name, process_id, is_agnocast);
CREATE TABLE store.publication (run_id INTEGER, publication_id INTEGER, publisher_id INTEGER,
    intra_ns INTEGER, end_ns INTEGER, source_timestamp_ns INTEGER);
"""
RULES = ("corrected_ns", "recorded_ns", "own_topic", "expected_arrival")
ARRIVALS = "SELECT clock_id, arrival_ns, has_one_clock FROM derive.expected_arrival ORDER BY ALL"


@pytest.mark.parametrize(
    ("intra", "here", "there"),
    [
        pytest.param(None, 203, 211, id="middleware"),
        pytest.param(198, 198, 211, id="ring_buffer"),
    ],
)
def test_a_ring_buffer_has_a_message_before_publish_returns(
    intra: int | None, here: int, there: int
) -> None:
    """What another clock's host gets comes through the middleware."""
    with derived(STAGE, RULES) as con:
        con.execute("INSERT INTO store.publication VALUES (1, 1, 1, ?, 203, 203)", [intra])
        rows = con.execute(ARRIVALS).fetchall()
    assert rows == [(1, here, True), (2, there, False)]


@pytest.mark.parametrize(
    ("end", "there"),
    [
        pytest.param(199, 206, id="first"),
        pytest.param(200, 208, id="second"),
        pytest.param(50, 53, id="corrections"),
    ],
)
def test_the_last_shift_counts_else_both_corrections(end: int, there: int) -> None:
    with derived(STAGE, RULES) as con:
        con.execute("INSERT INTO store.publication VALUES (1, 1, 1, NULL, ?, ?)", [end, end])
        rows = con.execute(ARRIVALS).fetchall()
    assert rows == [(1, end, True), (2, there, False)]


@pytest.mark.parametrize("reference", [None, 8])
def test_corrections_need_a_common_reference(reference: int | None) -> None:
    with derived(STAGE, RULES) as con:
        con.execute("UPDATE store.clock SET reference_clock_id = ? WHERE clock_id = 2", [reference])
        con.execute("INSERT INTO store.publication VALUES (1, 1, 1, NULL, 50, 50)")
        rows = con.execute(ARRIVALS).fetchall()
    assert rows == [(1, 50, True), (2, None, False)]


def test_nothing_arrives_without_a_subscription() -> None:
    with derived(STAGE, RULES) as con:
        con.execute("INSERT INTO store.publication VALUES (1, 1, 2, NULL, 203, 203)")
        assert con.execute(ARRIVALS).fetchall() == []


@pytest.mark.parametrize(("publisher", "rows"), [(3, []), (4, [(3, 203, True)])])
def test_agnocast_ends_at_the_kernel(publisher: int, rows: list[object]) -> None:
    """Its topic is another one than that of ROS 2 with its name."""
    with derived(STAGE, RULES) as con:
        con.execute("INSERT INTO store.publication VALUES (1, 1, ?, NULL, 203, NULL)", [publisher])
        assert con.execute(ARRIVALS).fetchall() == rows
