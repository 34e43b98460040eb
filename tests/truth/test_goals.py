"""Goals of actions: a simulated system, and real nodes of rclpy that were recorded once."""

from __future__ import annotations

from pathlib import Path

import pytest
from scoring import Score, compare_real, compare_simulated
from support.ingested import ingest_one
from support.thorough import few

from msgflow.ingest import ingest
from msgflow_sim import simulate

# Kilted, Fast DDS: a server with some threads executes goals of two actions of one client.
REAL = Path(__file__).parent / "real_actions"
# The same system. Its processes were stopped at random: goals pile up, and more of them overlap.
STALLED = Path(__file__).parent / "real_actions_stalled"
KINDS = {"goal_accepted", "goal_rejected", "goal_result", "goal_message"}


@pytest.mark.thorough
def test_goals_of_a_simulation(tmp_path: Path) -> None:
    simulation = simulate("actions", tmp_path / "trace", factor=0.25)
    ingest([simulation.directory], tmp_path / "run.duckdb")
    scores, _ = compare_simulated(tmp_path / "run.duckdb", simulation.truth)
    assert_right(scores)


@pytest.mark.thorough
def test_goals_of_real_nodes(tmp_path: Path) -> None:
    ingest([REAL / "trace.tar.xz"], tmp_path / "run.duckdb")
    assert_right(compare_real(tmp_path / "run.duckdb", REAL / "truth.jsonl.gz"))


def assert_right(scores: list[Score]) -> None:
    by_kind = {score.kind: score for score in scores}
    assert by_kind.keys() >= KINDS
    assert all(by_kind[kind].found > 5 for kind in KINDS)
    assert not [score for score in scores if score.wrong or score.missing or score.doubted]


@pytest.mark.thorough
def test_goals_of_real_nodes_that_stand_still_at_times(tmp_path: Path) -> None:
    """A thread rejects a goal of /dock, waits, and publishes the status of the next one.

    Nothing in the trace tells it from an accepted one. So all that the client asks for afterwards
    may be of it.
    """
    ingested = ingest_one(STALLED / "trace.tar.xz", tmp_path / "run.duckdb")
    decided = ingested.rows(
        "SELECT action_name, is_accepted, count(*) FROM goal WHERE answer_taken_ns IS NOT NULL "
        "GROUP BY ALL ORDER BY ALL"
    )
    ingested.connection.close()
    assert decided == [
        ("/dock", False, 7),
        ("/dock", True, 16),
        ("/dock", None, 18),
        ("/move", False, 6),
        ("/move", True, 28),
    ]
    assert_right(compare_real(tmp_path / "run.duckdb", STALLED / "truth.jsonl.gz"))


@pytest.mark.thorough
def test_what_is_known_of_goals_before_kilted(tmp_path: Path) -> None:
    simulation = simulate("actions", tmp_path / "trace", factor=0.1, layout="jazzy")
    ingested = ingest_one(simulation.directory, tmp_path / "run.duckdb")
    assert ingested.rows("FROM goal") == []
    assert ingested.rows(
        "SELECT action_name, goal_count, feedback_count > 0, status_count > 0 FROM action_server "
        "ORDER BY ALL"
    ) == [("/dock", None, True, True), ("/move", None, True, True)]
    assert ingested.rows("SELECT DISTINCT goal_count FROM action_client") == [(None,)]
    assert ingested.rows("SELECT subject FROM finding WHERE name = 'missing_layer'") == [("goals",)]
    ingested.connection.close()


@pytest.mark.parametrize(
    ("layout", "count"),
    few([("rolling", 0), ("kilted", 0), ("jazzy", None)], ("rolling", 0)),
)
def test_no_goal_is_known_where_the_trace_would_show_it(
    tmp_path: Path, layout: str, count: int | None
) -> None:
    """All is over before the first goal is sent."""
    simulation = simulate("actions", tmp_path / "trace", factor=0.025, layout=layout)
    ingested = ingest_one(simulation.directory, tmp_path / "run.duckdb")
    assert ingested.rows("SELECT count(*) FROM request") == [(0,)]
    for kind in ("server", "client"):
        assert ingested.rows(f"SELECT DISTINCT goal_count FROM action_{kind}") == [(count,)]
    ingested.connection.close()
