"""Real ROS 2: nodes of rclpy, recorded with LTTng, and what they wrote down themselves."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from recording.recorder import NotPossibleError, record, require, systems
from scoring import Score, compare_real
from support.thorough import few

from msgflow.ingest import ingest

# `make` installs the wheels of ROS 2 there.
ROS = Path(sys.prefix) / "ros" / "bin" / "python"
SECONDS = 3

Recorded = Callable[[str], dict[str, Score]]


@pytest.fixture
def ros() -> Path:
    """Python with rclpy."""
    try:
        require(ROS)
    except NotPossibleError as error:
        pytest.skip(f"cannot record: {error}")
    return ROS


@pytest.fixture
def recorded(ros: Path, tmp_path: Path) -> Recorded:
    """Records a system and returns the score of each kind of link."""

    def scores(system: str) -> dict[str, Score]:
        trace, truth = record(ros, system, SECONDS, tmp_path / system)
        ingest([trace], tmp_path / "run.duckdb")
        return {one.kind: one for one in compare_real(tmp_path / "run.duckdb", truth)}

    return scores


@pytest.mark.thorough
@pytest.mark.parametrize("system", few(["pipeline", "services"], "services"))
def test_links_of_a_robot_are_right(recorded: Recorded, system: str) -> None:
    scores = recorded(system)
    assert scores["transport"].found > 0
    assert all(not one.wrong and not one.missing for one in scores.values()), scores


def test_python_may_be_named_from_here(ros: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`make real` names it by a relative path."""
    monkeypatch.chdir(ros.parents[1])
    assert "services" in systems(ros.relative_to(ros.parents[1]))
