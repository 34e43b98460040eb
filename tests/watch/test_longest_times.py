"""How long windows wait: what was on the way longest, or has waited so far."""

from __future__ import annotations

import duckdb
import pytest

from msgflow.run.window import Window
from msgflow.watch.window_report import longest_times

LAST_STEP = Window(900, 1_000)
Message = tuple[int, int, str | None]


def found(
    *messages: Message, latency: int | None = None, wait: int | None = None
) -> tuple[int, int, int]:
    """Return the times of messages: subscription, start of the publication, reason if not taken."""
    with duckdb.connect() as con:
        con.execute(
            "CREATE TABLE main.stat_delivery (publication_id INT, subscription_id INT, reason TEXT)"
        )
        con.execute("CREATE TABLE main.publication (publication_id INT, start_ns BIGINT)")
        con.execute("CREATE TABLE main.link_transport AS SELECT ?::BIGINT AS latency_ns", [latency])
        con.execute("CREATE TABLE main.link_causal AS SELECT ?::BIGINT AS wait_ns", [wait])
        for number, (subscription, start_ns, reason) in enumerate(messages):
            con.execute("INSERT INTO main.publication VALUES (?, ?)", [number, start_ns])
            con.execute(
                "INSERT INTO main.stat_delivery VALUES (?, ?, ?)", [number, subscription, reason]
            )
        return longest_times(con, LAST_STEP)


def test_what_was_on_the_way_and_what_a_node_kept() -> None:
    assert found() == (0, 0, 0)
    assert found(latency=70, wait=400) == (70, 0, 400)


@pytest.mark.parametrize("reason", ["pending_at_end", "subscription_ended", "unknown"])
def test_a_message_that_waits_holds_up_what_was_taken_last(reason: str) -> None:
    taken = [(1, 100, None), (1, 600, None)]
    assert found(*taken, (1, 700, reason), latency=70) == (70, 400, 0)
    # Messages of the last step need not have been taken; earlier ones were lost.
    assert found(*taken, (1, 900, reason)) == (0, 0, 0)
    assert found(*taken, (1, 500, reason)) == (0, 0, 0)
    # Nothing says that the subscription is connected.
    assert found(*taken, (2, 700, reason)) == (0, 0, 0)


def test_the_subscription_that_has_waited_longest_counts() -> None:
    waits = "pending_at_end"
    messages = [(1, 600, None), (1, 700, waits), (2, 300, None), (2, 700, waits)]
    assert found(*messages) == (0, 700, 0)


@pytest.mark.parametrize("reason", ["overwritten", "lost_in_transport", "before_subscription"])
def test_what_is_known_to_be_missing_waits_for_nothing(reason: str) -> None:
    assert found((1, 600, None), (1, 700, reason)) == (0, 0, 0)
