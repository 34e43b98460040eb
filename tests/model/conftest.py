from __future__ import annotations

import pytest
from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem


@pytest.fixture
def system() -> RosSystem:
    """A system without any object yet."""
    return RosSystem()


@pytest.fixture
def analyse(analysis: Analysis) -> Analyse:
    """Builds the model of a system and derives its links."""
    return analysis.build
