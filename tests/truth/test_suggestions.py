"""What `suggest links` finds of the indirect links that simulated nodes declare."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.suggestions import compare, merges
from support.thorough import few

from msgflow_sim import simulate

# Pairs of topics with links that cannot be seen: their messages also lead elsewhere.
NOT_FOUND = {
    "periodic_async": {"/sharing": 1},
    "partial_sync": {"/both_kinds": 2},
    "reentrant": {},
    "merges": {},
}
# Nodes whose candidates are all in doubt: several outputs, of which not each may use each input.
IN_DOUBT = {
    "periodic_async": {"/sharing"},
    "partial_sync": {"/partial_2_to_2", "/partial_3_to_3", "/spinning"},
    "reentrant": set(),
    "merges": {"/four_to_four", "/kept", "/two_pairs"},
}


@pytest.mark.thorough
@pytest.mark.parametrize("system", few(NOT_FOUND, "merges"))
def test_what_is_suggested_without_a_doubt_is_right(system: str, tmp_path: Path) -> None:
    scenario = merges() if system == "merges" else system
    done = simulate(scenario, tmp_path / "trace", factor=0.5)
    compared = compare(done.directory, tmp_path)
    assert sum(each.wrong for each in compared.values()) == 0
    assert {node for node, each in compared.items() if not each.found} == IN_DOUBT[system]
    missing = {node: each.missing for node, each in compared.items() if each.missing}
    assert missing == NOT_FOUND[system]
