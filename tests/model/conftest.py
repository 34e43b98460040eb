from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from ros_system import RosSystem
from staged_events import Analyse, Analysis, StagedEvents


@pytest.fixture
def system() -> RosSystem:
    """A system of which nothing is known yet."""
    return RosSystem()


@pytest.fixture
def analyse(empty_database: Path, tmp_path: Path) -> Iterator[Analyse]:
    """Builds the model of a system and derives its links."""
    opened: list[Analysis] = []

    def run(events: StagedEvents) -> Analysis:
        directory = tmp_path / str(len(opened))
        directory.mkdir()
        opened.append(Analysis(empty_database, directory, events))
        return opened[-1]

    yield run
    for analysis in opened:
        analysis.close()
