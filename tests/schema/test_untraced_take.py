"""Which processes take messages without a trace of it, each condition of the rule by itself."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest
from support.rules import modelled

# Thread 1 serves a message, waits, and runs what would be a timer; then it serves another message.
# Callback 6 would be another timer, and is one unless takes are not traced.
STAGE = """
CREATE SCHEMA staging;
CREATE SCHEMA raw;
CREATE TEMP TABLE callback_announced AS
    SELECT 1 AS process_id, unnest([7, 6]) AS callback_event_id,
        unnest([70, 60]) AS handle, NULL::VARCHAR AS kind, unnest([100, 900]) AS start_event_id,
        NULL::INTEGER AS owner_event_id, false AS is_disputed, true AS has_takes,
        true AS has_executions, true AS has_requests;
CREATE TABLE staging.callback_known (event_id INTEGER, process_id INTEGER, callback_handle INTEGER,
    kind VARCHAR, service_event_id INTEGER, service_handle INTEGER);
CREATE TEMP TABLE callback_trigger AS
    SELECT 100 AS start_event_id, 1 AS process_id, 1 AS thread_id, 7 AS callback_event_id;
CREATE TABLE staging.callback_run (start_event_id INTEGER, callback_handle INTEGER,
    previous_event_id INTEGER, executor_event_id INTEGER, process_id INTEGER DEFAULT 1,
    thread_id INTEGER DEFAULT 1, depth INTEGER DEFAULT 1, is_intra_process BOOLEAN DEFAULT false);
INSERT INTO staging.callback_run (start_event_id, callback_handle, previous_event_id,
    executor_event_id) VALUES (50, 8, 45, 44), (100, 7, 80, 90), (200, 9, 195, 190);
CREATE TABLE staging.callback_binding AS SELECT *, NULL::INTEGER AS callback_event_id,
    NULL::INTEGER AS request_event_id
    FROM (VALUES (50, 'subscription', 45), (100, NULL, NULL), (200, 'subscription', 195))
        AS b (start_event_id, kind, take_event_id);
CREATE TABLE staging.near_gap (thread_id INTEGER, event_id INTEGER, sequence VARCHAR);
CREATE TABLE waited AS SELECT 1 AS process_id, 1 AS thread_id, 80 AS event_id;
CREATE TABLE raw.ros2_rclcpp_executor_execute AS FROM (VALUES (44), (90), (190)) AS e (event_id);
CREATE MACRO staging.located(tracepoint) AS TABLE FROM waited;
"""
NO_WAIT = "DELETE FROM waited"
NO_TAKE = "UPDATE staging.callback_binding SET take_event_id = NULL WHERE start_event_id = 200"
ANNOUNCED = "UPDATE callback_announced SET"
SERVED = "UPDATE staging.callback_run SET"


@pytest.fixture
def staged() -> Iterator[duckdb.DuckDBPyConnection]:
    with modelled(STAGE, "callback_owner", "owned") as con:
        yield con


@pytest.mark.parametrize(
    ("changes", "is_found"),
    [
        ([], False),
        # In the round of a message.
        ([NO_WAIT], True),
        (["UPDATE waited SET event_id = 40"], True),
        ([NO_WAIT, "INSERT INTO staging.near_gap VALUES (1, 60, 'call')"], False),
        ([NO_WAIT, "INSERT INTO staging.near_gap VALUES (1, 30, 'call')"], True),
        ([NO_WAIT, "INSERT INTO staging.near_gap VALUES (2, 60, 'call')"], True),
        ([NO_WAIT, "INSERT INTO staging.near_gap VALUES (1, 60, 'thread')"], True),
        ([NO_WAIT, f"{SERVED} depth = 2 WHERE start_event_id = 50"], False),
        ([NO_WAIT, f"{SERVED} thread_id = 2 WHERE start_event_id = 50"], False),
        (
            [NO_WAIT, "UPDATE staging.callback_binding SET take_event_id = NULL, kind = 'service'"],
            True,
        ),
        (
            [NO_WAIT, "UPDATE staging.callback_binding SET take_event_id = NULL, kind = 'timer'"],
            False,
        ),
        ([NO_WAIT, f"{ANNOUNCED} handle = NULL WHERE callback_event_id = 7"], False),
        ([NO_WAIT, f"{ANNOUNCED} kind = 'timer' WHERE callback_event_id = 7"], False),
        ([NO_WAIT, f"{ANNOUNCED} callback_event_id = 5 WHERE callback_event_id = 7"], False),
        (
            [
                NO_WAIT,
                "INSERT INTO staging.callback_run (start_event_id, callback_handle, thread_id) "
                "VALUES (300, 8, 2)",
                "INSERT INTO staging.callback_binding (start_event_id, kind, take_event_id) "
                "VALUES (300, 'subscription', 295)",
            ],
            False,
        ),
        # A subscription runs without a take.
        ([f"{ANNOUNCED} kind = 'subscription' WHERE callback_event_id = 7"], True),
        ([NO_TAKE, f"{SERVED} previous_event_id = 150 WHERE start_event_id = 200"], True),
        ([NO_TAKE, f"{SERVED} previous_event_id = NULL WHERE start_event_id = 200"], True),
        ([NO_TAKE], False),
        ([f"{SERVED} previous_event_id = 150 WHERE start_event_id = 200"], False),
        (
            [
                NO_TAKE,
                f"{SERVED} previous_event_id = 150, is_intra_process = true "
                "WHERE start_event_id = 200",
            ],
            False,
        ),
        (
            [
                NO_TAKE,
                f"{SERVED} previous_event_id = 150 WHERE start_event_id = 200",
                "UPDATE staging.callback_binding SET kind = 'timer' WHERE start_event_id = 200",
            ],
            False,
        ),
        (
            [
                NO_TAKE,
                f"{SERVED} previous_event_id = 150 WHERE start_event_id = 200",
                "DELETE FROM callback_trigger",
            ],
            False,
        ),
    ],
)
def test_messages_reach_callbacks_although_none_is_taken(
    staged: duckdb.DuckDBPyConnection, changes: list[str], *, is_found: bool
) -> None:
    for change in changes:
        staged.execute(change)
    timers = staged.execute(
        "SELECT process_id FROM owned WHERE callback_event_id = 6 AND kind = 'timer'"
    ).fetchall()
    assert timers == [(1,)] * (not is_found)
