"""The clock that stamps messages is set back, in Humble: what nobody can tell is not linked."""

from __future__ import annotations

from pathlib import Path

import pytest
from scoring import compare_simulated
from support.thorough import thorough

from msgflow.ingest import ingest
from msgflow_sim import Recording, simulate

MILLISECOND = 1_000_000


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("system", "factor", "at_ms", "linked", "told"),
    [
        # Topics have several publishers.
        thorough("rivals", 0.15, 100, 0.75, "clock_set"),
        # Hardly any message is on either side.
        ("pipeline", 0.01, 10, 0.0, "unmatched_take"),
    ],
)
def test_no_wrong_link_and_a_finding(
    tmp_path: Path, system: str, factor: float, at_ms: int, linked: float, told: str
) -> None:
    simulation = simulate(
        system,
        tmp_path / "trace",
        factor=factor,
        layout="humble",
        recording=Recording(realtime_steps=((at_ms * MILLISECOND, -40 * MILLISECOND),)),
    )
    database = tmp_path / "run.duckdb"
    findings = ingest([simulation.directory], database).findings
    (score,) = (
        each
        for each in compare_simulated(database, simulation.truth)[0]
        if each.kind == "transport"
    )
    assert (score.wrong, score.misguessed) == (0, 0)
    assert score.recall >= linked
    assert told in {finding.name for finding in findings}


def test_a_start_that_says_nothing_tells_of_no_step(tmp_path: Path) -> None:
    """While nodes start, another difference of the clocks explains as much: the one line holds."""
    simulation = simulate("host_chain", tmp_path / "trace", factor=1, layout="iron", seed=924454)
    database = tmp_path / "run.duckdb"
    findings = ingest([simulation.directory], database).findings
    (score,) = (
        each
        for each in compare_simulated(database, simulation.truth)[0]
        if each.kind == "transport"
    )
    assert (score.wrong, score.misguessed, score.recall) == (0, 0, 1)
    assert "clock_set" not in {finding.name for finding in findings}
