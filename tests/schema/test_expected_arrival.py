"""When messages can be received at the earliest, on the clock of those who subscribe."""

from __future__ import annotations

import pytest
from rules import derived

# Two processes with clocks of their own; the first one publishes, both subscribe.
STAGE = """
CREATE SCHEMA derive;
CREATE SCHEMA store;
CREATE TABLE derive.process_clock AS FROM (VALUES (1, 1), (2, 2)) AS p(process_id, clock_id);
CREATE TABLE store.clock AS FROM (
    VALUES (1, NULL, 0, 0, 0), (2, NULL, 0, 0, 0)
) AS c(clock_id, reference_clock_id, offset_ns, drift_ppb, reference_ns);
CREATE TABLE derive.clock_shift AS FROM (
    VALUES (1, 1, 2, 100, 7), (1, 1, 2, 200, 8)
) AS s(run_id, from_clock_id, to_clock_id, from_ns, shift_ns);
CREATE TABLE store.subscription AS FROM (
    VALUES (1, '/a', 1), (1, '/a', 2)
) AS s(run_id, topic_name, process_id);
CREATE TABLE store.publisher AS FROM (VALUES (1, 1, '/a', 1))
AS p(run_id, publisher_id, topic_name, process_id);
CREATE TABLE store.publication (run_id INTEGER, publication_id INTEGER, publisher_id INTEGER,
    intra_ns INTEGER, end_ns INTEGER, source_timestamp_ns INTEGER);
CREATE MACRO derive.corrected_ns(ns, offset_ns, drift_ppb, reference_ns) AS ns + offset_ns;
CREATE MACRO derive.recorded_ns(ns, offset_ns, drift_ppb, reference_ns) AS ns - offset_ns;
"""
RULES = ("expected_arrival",)


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
        rows = con.execute(
            "SELECT clock_id, arrival_ns, has_one_clock FROM derive.expected_arrival ORDER BY ALL"
        ).fetchall()
    assert rows == [(1, here, True), (2, there, False)]
