"""Messages told by time that were in a queue for longer than many others took to be published."""

from __future__ import annotations

from pathlib import Path

import pytest
from scoring import compare_simulated
from support.ingested import ingest_one
from support.thorough import thorough

from msgflow_sim import Host, Node, Process, Publisher, Scenario, Subscription, Timer, simulate
from msgflow_sim.entity import MILLISECOND, SECOND, Work


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("depth", "period", "work", "duration"),
    [
        thorough(100, 5 * MILLISECOND, Work(7 * MILLISECOND), 4 * SECOND),
        (50, MILLISECOND, Work(3 * MILLISECOND // 2, MILLISECOND // 4), 2 * SECOND),
    ],
)
def test_a_full_deep_queue_costs_no_link(
    tmp_path: Path, depth: int, period: int, work: Work, duration: int
) -> None:
    """The reader is too slow, so that each message waits for as many as the queue holds."""
    source = Node(
        "source", publishers=(Publisher("/points", depth),), timers=(Timer(period, ("/points",)),)
    )
    slow = Node("slow", subscriptions=(Subscription("/points", (), work, depth),))
    scenario = Scenario(
        name="deep",
        description="A slow reader with a deep queue.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            Process("slow", "alpha", 1201, (slow,), start_ns=3 * MILLISECOND),
        ),
        duration_ns=duration,
        overwrites=True,
    )
    simulation = simulate(scenario, tmp_path / "trace", layout="humble")
    path = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    transport = next(
        score for score in compare_simulated(path, simulation.truth)[0] if score.kind == "transport"
    )
    assert transport.wrong == 0
    assert transport.found > 500
    assert transport.missing <= 1
