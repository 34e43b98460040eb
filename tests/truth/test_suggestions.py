"""What `links suggest` finds of the indirect links that simulated nodes declare."""

from __future__ import annotations

from pathlib import Path

import pytest
from suggestions import compare, merges
from thorough import few

from msgflow.sim import simulate

# Links that cannot be seen: a single input is a direct link; messages that also lead elsewhere.
NOT_FOUND = {
    "periodic_async": {"/sharing": 3},
    "partial_sync": {"/partial_1_to_1": 1, "/partial_1_to_3": 3, "/both_kinds": 2},
    "reentrant": {},
    "merges": {},
}


@pytest.mark.parametrize("system", few(NOT_FOUND, "merges"))
def test_what_is_suggested_without_a_doubt_is_right(system: str, tmp_path: Path) -> None:
    scenario = merges() if system == "merges" else system
    done = simulate(scenario, tmp_path / "trace", factor=0.5)
    found = compare(done.directory, tmp_path)
    missing = {}
    for node, (declared, suggested, doubtful) in found.items():
        assert suggested - doubtful <= declared, node
        if declared - suggested:
            missing[node] = len(declared - suggested)
    assert missing == NOT_FOUND[system]
