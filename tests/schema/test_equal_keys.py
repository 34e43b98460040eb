"""A damaged trace may give all messages one number, or one stamp: their links cost no square."""

from __future__ import annotations

import json

import pytest
from support.rules import derived

TABLES = """
CREATE TABLE store.host AS SELECT 1 AS host_id, 1 AS clock_id;
CREATE TABLE store.process AS SELECT 1 AS process_id, 1 AS host_id;
CREATE TABLE store.publisher AS
    SELECT
        1 AS publisher_id, '/a' AS topic_name, 0::BIGINT AS created_ns,
        false AS is_topic_learned, false AS is_topic_declared;
CREATE TABLE store.subscription AS
    SELECT
        1 AS subscription_id, '/a' AS topic_name,
        false AS is_topic_learned, false AS is_topic_declared;
CREATE TABLE store.publication AS
    SELECT
        1 AS run_id, range AS publication_id, 1 AS publisher_id, 1 AS process_id,
        range * 10 + 100 AS end_ns, 5 AS source_timestamp_ns, range * 2 AS start_event_id
    FROM range({number});
CREATE TABLE store.take AS
    SELECT
        1 AS run_id, range AS take_id, 1 AS subscription_id, 1 AS process_id,
        range * 10 + 103 AS taken_ns, 5 AS source_timestamp_ns, range * 2 + 1 AS start_event_id
    FROM range({number});
CREATE TABLE store.agnocast_entry AS
    SELECT 1 AS run_id, publication_id, NULL AS take_id, 7 AS entry_id FROM store.publication
    UNION ALL
    SELECT 1, NULL, take_id, 7 FROM store.take;
CREATE MACRO derive.topic_group(only_run) AS TABLE
    SELECT '' AS kind, 0 AS id, 0 AS group_id, '' AS topic_name WHERE false
"""
CALLS = {"agnocast": "link_transport_agnocast(1)", "exact": "link_transport_exact(1)"}


def linked(method: str, number: int) -> tuple[list[tuple[int, ...]], int]:
    """Return the links of messages with one key, and how many rows operators produced."""
    call = CALLS[method]
    with derived(TABLES.format(number=number), (call.partition("(")[0],)) as con:
        query = f"FROM derive.{call}"
        ((_, plan),) = con.execute(f"EXPLAIN (ANALYZE, FORMAT json) {query}").fetchall()
        found = con.execute(
            f"SELECT take_id, publication_id, candidate_count {query} ORDER BY take_id"
        )
        return found.fetchall(), sum(map(produced, json.loads(plan)["operator"]))


def produced(operator: dict) -> int:
    """Return how many rows an operator and those below it produced."""
    return operator["intermediate_rows"] + sum(map(produced, operator.get("children", ())))


@pytest.mark.parametrize("method", CALLS)
def test_each_take_has_one_of_equal_keys(method: str) -> None:
    assert linked(method, 3)[0] == [(0, 0, 3), (1, 1, 3), (2, 2, 3)]


def test_a_stamp_of_very_many_is_that_of_no_message() -> None:
    assert [len(linked("exact", number)[0]) for number in (64, 65)] == [64, 0]


@pytest.mark.parametrize("method", CALLS)
def test_equal_keys_cost_no_square(method: str) -> None:
    few, many = (linked(method, number)[1] for number in (1000, 100_000))
    assert few > 1000
    assert many <= few * 100 * 1.1
