"""What `make truth` simulates on a day."""

from __future__ import annotations

from collections import defaultdict

import pytest
from truth import QUICK, RECORDINGS, Case, sample

from msgflow_sim import scenarios

SYSTEMS = ("pipeline", "bursts", "losses")


def _possible() -> list[Case]:
    return [
        Case(system, layout, recording, scenarios()[system], 0.1, 0)
        for system in SYSTEMS
        for _, layout in QUICK
        for recording in RECORDINGS
    ]


@pytest.mark.thorough
def test_each_system_is_sampled_with_several_seeds_short_and_long() -> None:
    lengths = defaultdict(list)
    for case in sample(_possible(), 20260131):
        lengths[case.system, case.seed].append(case.factor)
    for system in SYSTEMS:
        of_seed = [sorted(lengths[key]) for key in lengths if key[0] == system]
        assert of_seed == [[0.1, 1]] * 3


@pytest.mark.thorough
def test_a_day_is_repeated_and_another_differs() -> None:
    possible = _possible()
    drawn = list(sample(possible, 20260131))
    assert drawn == list(sample(possible, 20260131))
    assert drawn != list(sample(possible, 20260201))
    only = [case for case in possible if case.system == "bursts"]
    assert list(sample(only, 20260131)) == [case for case in drawn if case.system == "bursts"]
