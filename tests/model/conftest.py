from __future__ import annotations

import pytest
from analysis import Analyse, Analysis
from ros_system import RosSystem


@pytest.fixture
def system() -> RosSystem:
    """A system without any object yet."""
    return RosSystem()


@pytest.fixture
def analyse(analysis: Analysis) -> Analyse:
    """Builds the model of a system and derives its links."""
    return analysis.build
