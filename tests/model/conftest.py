from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from analysis import Analyse, Analysis
from ros_system import RosSystem


@pytest.fixture
def system() -> RosSystem:
    """A system without any object yet."""
    return RosSystem()


@pytest.fixture(scope="session")
def analysis(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Analysis]:
    """A database for one system after the other."""
    bench = Analysis(empty_database, tmp_path_factory.mktemp("analysis"))
    yield bench
    bench.close()


@pytest.fixture
def analyse(analysis: Analysis) -> Analyse:
    """Builds the model of a system and derives its links."""
    return analysis.build
