"""Messages that a latched publisher stored for a subscription that came later."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from support.ingested import Ingested

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query


@pytest.fixture
def overload(recordings: Callable[[str], Ingested]) -> Ingested:
    """Real ROS 2: `/late` joins 2 s after `/talker`, and reads the last five of `/map`."""
    return recordings("real_overload")


def rows(overload: Ingested, query: str, **given: Any) -> list[dict[str, Any]]:
    found = run_query(overload.connection, load_query(query), given).to_arrow().to_pylist()
    return [row for row in found if not row.get("is_internal")]


def test_stored_messages_are_counted_and_not_measured(overload: Ingested) -> None:
    paths = {row["path"]: row for row in rows(overload, "e2e-latency")}
    latched = paths.pop("/talker → /map → /late")
    assert (latched["reached"], latched["pairs"], latched["stored"]) == (5, 0, 5)
    assert latched["max_ns"] is None
    # The volatile topic of the same publisher: published before /late was found, but not stored.
    assert [(row["stored"], row["pairs"] == row["reached"]) for row in paths.values()] == [
        (0, True)
    ] * 3
    topics = {row["topic_name"]: row for row in rows(overload, "topics-latency")}
    assert {name: (row["linked"], row["stored"]) for name, row in topics.items()} == {
        "/fast": (186, 0),
        "/map": (5, 5),
        "/plain": (32, 0),
        "/sensor": (145, 0),
        "/slow_out": (100, 0),
    }
    assert topics["/map"]["max_ns"] is None


@pytest.mark.thorough
def test_the_time_up_to_the_subscription_is_a_part_of_its_own(overload: Ingested) -> None:
    """Of a flow that is asked for by its take."""
    stored = overload.rows("SELECT take_id FROM link_transport WHERE stored_ns IS NOT NULL")
    assert len(stored) == 5
    parts = [
        dict(
            overload.rows(
                "SELECT part, duration_ns FROM "
                f"end_to_end_part([1], to_topic := '/map', sink_take_id := {take_id})"
            )
        )
        for (take_id,) in stored
    ]
    # Published every 300 ms; the last one 650 ms before.
    assert max(part["stored"] for part in parts) == pytest.approx(1.85e9, rel=0.01)
    assert max(part["publish_to_take"] for part in parts) < 0.02e9


@pytest.mark.thorough
@pytest.mark.parametrize("query", ["path-breakdown", "critical-path"])
def test_flows_of_stored_messages_are_left_out_everywhere(overload: Ingested, query: str) -> None:
    """As their times are by e2e-latency."""
    assert rows(overload, query)
    assert rows(overload, query, **{"from": "/map", "to": "/map"}) == []
