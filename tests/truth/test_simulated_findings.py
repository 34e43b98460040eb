"""What is said about simulated systems that have what real ones have: true, and nothing missing."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from support.ingested import Ingested
from support.thorough import few

from msgflow import open_db

FINDINGS = "SELECT name, subject FROM finding WHERE name IN {} ORDER BY ALL"
ABOUT_PROCESSES = (
    "busy_waiting",
    "polled_executor",
    "process_fell_silent",
    "service_without_callbacks",
)
# Scenarios, and who has what.
EXPECTED = {
    "busy_waiting": [("busy_waiting", "crowded 1201 on alpha")],
    "calls": [],
    "multi_threaded": [],
    "polled": [("polled_executor", "relay 1201 on alpha")],
    # The others that ended were shut down.
    "restarts": [("process_fell_silent", "relay 1201 on alpha")],
    "services": [],
}


@pytest.mark.parametrize("name", few(EXPECTED, "services"))
def test_findings(simulations: Callable[[str], Ingested], name: str) -> None:
    assert simulations(name).rows(FINDINGS.format(ABOUT_PROCESSES)) == EXPECTED[name]


@pytest.mark.thorough
def test_which_process_fell_silent(simulations: Callable[[str], Ingested]) -> None:
    """The one that is killed after 2001 ms; what was sent to it later was not delivered."""
    recording = simulations("restarts")
    ((count,),) = recording.rows("SELECT count FROM finding WHERE name = 'process_fell_silent'")
    ((sent,),) = recording.rows(
        "SELECT count(*) FROM truth_undelivered AS u JOIN truth_subscription AS s "
        "USING (subscription_id) WHERE u.reason = 'subscription_ended' AND NOT u.is_internal "
        "AND s.created_ns = (SELECT max(created_ns) FROM truth_subscription "
        "WHERE node = '/relay' AND topic_name = '/data' AND ended_ns IS NOT NULL)"
    )
    assert count == sent > 0


@pytest.mark.thorough
def test_timers_off_their_grid(simulations: Callable[[str], Ingested]) -> None:
    """Neither the others of the process nor one that another callback delays are marked."""
    with open_db(simulations("timers").path) as database:
        rows = database.query("timers").to_arrow().to_pylist()
    assert {(row["node"], row["period_ns"] // 1_000_000): row["off_grid"] for row in rows} == {
        ("/late", 20): None,
        ("/late", 60): None,
        ("/node", 50): None,
        ("/node", 70): "clock",
        ("/node", 100): "reset",
    }
