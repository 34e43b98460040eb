"""The macros that match messages by time and compare clocks, over tables of what they read."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest
from support.rules import derived

RULES = (
    "clock_limit",
    "stamped_ns",
    "agreed_difference",
    "clock_drift",
    "stamp_line",
    "followed_difference",
    "stamp_pair",
    "stamp_clock",
    "clock_step",
    "publication_beside_gap",
    "nearest_message",
)
# The input of the rules, without the tables that it comes from.
STAGE = """
CREATE TABLE published (run_id BIGINT DEFAULT 1, clock_id BIGINT DEFAULT 1,
    topic_name VARCHAR DEFAULT '/a', publisher_id BIGINT DEFAULT 1, thread_id BIGINT DEFAULT 1,
    publication_id BIGINT, written_ns BIGINT, closes_ns BIGINT, goes_on BOOLEAN DEFAULT true,
    last_seen_ns BIGINT DEFAULT 1_000_000_000_000_000);
CREATE TABLE message (run_id BIGINT DEFAULT 1, topic_name VARCHAR DEFAULT '/a',
    source_timestamp_ns BIGINT, only_subscription_id BIGINT DEFAULT 0, clock_id BIGINT DEFAULT 1,
    taken_ns BIGINT);
CREATE TABLE store.stamp_clock (run_id BIGINT DEFAULT 1, clock_id BIGINT DEFAULT 1,
    start_ns BIGINT, end_ns BIGINT, at_ns BIGINT DEFAULT 0, difference_ns BIGINT DEFAULT 0,
    drift_ppb BIGINT DEFAULT 0, slack_ns BIGINT DEFAULT 0);
CREATE TABLE derive.exposed_trace (trace_id BIGINT, recording_id BIGINT);
INSERT INTO derive.exposed_trace VALUES (1, 7);
CREATE TABLE derive.recording_gap (run_id BIGINT DEFAULT 1, recording_id BIGINT DEFAULT 7,
    start_ns BIGINT, covered_until_ns BIGINT);
CREATE VIEW store.publication AS
    SELECT publication_id, 1 AS trace_id, written_ns AS start_ns, written_ns AS end_ns,
        closes_ns AS next_event_ns FROM published;
CREATE MACRO derive.unstamped_publication(only_run) AS TABLE FROM published WHERE run_id = only_run;
CREATE MACRO derive.unstamped_message(only_run) AS TABLE FROM message WHERE run_id = only_run;
"""
# Likewise of what messages say of two clocks.
CLOCKS = ("clock_drift_limit", "clock_hull", "clock_line", "clock_line_error", "clock_pair")
CLOCK_STAGE = """
CREATE TABLE bound (clock_id BIGINT DEFAULT 2, other_clock_id BIGINT DEFAULT 1,
    is_packet BOOLEAN DEFAULT false, sense INTEGER, at_ns BIGINT, bound_ns BIGINT);
CREATE TABLE store.host (run_id BIGINT DEFAULT 1, host_id BIGINT, clock_id BIGINT);
CREATE TABLE store.trace (host_id BIGINT, start_ns BIGINT, end_ns BIGINT);
INSERT INTO store.host (host_id, clock_id) VALUES (1, 1), (2, 2);
CREATE MACRO derive.clock_bound(only_run) AS TABLE FROM bound;
"""


@pytest.fixture
def clocks() -> Iterator[duckdb.DuckDBPyConnection]:
    """How two clocks are compared, without a message between them."""
    with derived(CLOCK_STAGE, CLOCKS) as con:
        yield con


@pytest.fixture
def rules() -> Iterator[duckdb.DuckDBPyConnection]:
    """The macros alone, with nothing published or taken."""
    with derived(STAGE, RULES) as con:
        yield con
