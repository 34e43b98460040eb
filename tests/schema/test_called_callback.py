"""Which callback a request called, each condition of the rule by itself."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest
from rules import modelled

STAGE = """
CREATE SCHEMA staging;
CREATE TABLE staging.service_event AS
    SELECT 10 AS event_id, true AS is_request, 1 AS service_event_id;
CREATE TABLE staging.callback_pair AS
    SELECT 20 AS start_event_id, 10 AS previous_event_id,
        NULL::INTEGER AS previous_executor_event_id,
        false AS is_intra_process;
CREATE TABLE staging.callback_binding AS
    SELECT 20 AS start_event_id, 'service' AS kind, 2 AS callback_event_id;
CREATE TABLE staging.callback_known AS SELECT 2 AS event_id, 1 AS service_event_id;
"""


@pytest.fixture
def staged() -> Iterator[duckdb.DuckDBPyConnection]:
    """One request, and directly behind it the run of a callback of its service."""
    with modelled(STAGE, "request_callback", "called") as con:
        yield con


@pytest.mark.parametrize(
    ("change", "is_called"),
    [
        ("callback_pair SET previous_executor_event_id = 9", True),
        ("callback_pair SET previous_executor_event_id = 11", False),
        ("callback_pair SET previous_event_id = 11", False),
        ("callback_pair SET is_intra_process = true", False),
        ("callback_binding SET kind = 'unknown'", True),
        ("callback_binding SET kind = NULL", True),
        ("callback_binding SET kind = 'timer'", False),
        ("callback_binding SET callback_event_id = NULL", True),
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
    assert staged.execute("FROM called").fetchall() == [(10, 20)]
    staged.execute(f"UPDATE staging.{change}")
    assert staged.execute("FROM called").fetchall() == [(10, 20)] * is_called
