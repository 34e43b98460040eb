"""Which callback a request called, each condition of the rule by itself."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest
from support.rules import modelled

STAGE = """
CREATE SCHEMA staging;
CREATE TABLE staging.service_event AS
    SELECT 10 AS event_id, true AS is_request, 1 AS service_event_id;
CREATE TABLE staging.callback_run AS
    SELECT 20 AS start_event_id, 1 AS process_id, 7 AS callback_handle, 10 AS previous_event_id,
        NULL::INTEGER AS previous_executor_event_id,
        false AS is_intra_process;
CREATE TABLE staging.callback_known AS
    SELECT 2 AS event_id, 1 AS process_id, 7 AS callback_handle, 'service' AS kind,
        1 AS service_event_id, NULL::INTEGER AS subscription_event_id;
CREATE TABLE staging.take_chain (start_event_id INTEGER, end_event_id INTEGER, method VARCHAR,
    subscription_event_id INTEGER);
CREATE TEMP TABLE callback_step (start_event_id INTEGER, request_event_id INTEGER,
    call_event_id INTEGER, response_event_id INTEGER, step_event_id INTEGER);
CREATE TEMP TABLE callback_feedback (start_event_id INTEGER, called_by_event_id INTEGER);
CREATE MACRO staging.with_latest(uses, objects) AS TABLE
    SELECT u.*, o.event_id AS object_event_id
    FROM query_table(uses) AS u
    LEFT JOIN query_table(objects) AS o USING (handle);
"""


@pytest.fixture
def staged() -> Iterator[duckdb.DuckDBPyConnection]:
    """One request, and directly behind it the run of a callback of its service."""
    with modelled(STAGE, "callback_binding", "bound") as con:
        yield con


@pytest.mark.parametrize(
    ("change", "is_called"),
    [
        ("callback_run SET previous_executor_event_id = 9", True),
        ("callback_run SET previous_executor_event_id = 11", False),
        ("callback_run SET previous_event_id = 11", False),
        ("callback_run SET is_intra_process = true", False),
        ("callback_known SET kind = 'unknown'", True),
        ("callback_known SET kind = NULL", True),
        ("callback_known SET kind = 'timer'", False),
        ("callback_known SET callback_handle = 8", True),
        ("callback_known SET service_event_id = NULL", True),
        ("callback_known SET service_event_id = 3", False),
        ("service_event SET service_event_id = NULL", True),
        # The response of an earlier request, which a callback published late.
        ("service_event SET is_request = false", False),
    ],
)
def test_a_callback_directly_behind_the_request_of_its_service(
    staged: duckdb.DuckDBPyConnection, change: str, *, is_called: bool
) -> None:
    asked = "SELECT request_event_id, start_event_id FROM bound WHERE request_event_id IS NOT NULL"
    assert staged.execute(asked).fetchall() == [(10, 20)]
    staged.execute(f"UPDATE staging.{change}")
    assert staged.execute(asked).fetchall() == [(10, 20)] * is_called
