"""Recordings of two hosts: truth within the bound, and the bound no wider than it has to be."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.clock_bounds import judge
from support.thorough import few

from msgflow import open_db
from msgflow_sim import simulate
from msgflow_sim.scenario.traffic import TRAFFIC


@pytest.mark.thorough
@pytest.mark.parametrize("kind", few(TRAFFIC, *list(TRAFFIC)[:1]))
def test_truth_lies_within_the_bound_that_messages_allow(kind: str, tmp_path: Path) -> None:
    outcome = judge(kind, 7, tmp_path)
    assert outcome.is_good, outcome


@pytest.mark.thorough
def test_three_hosts_in_a_chain(tmp_path: Path) -> None:
    """The third is brought to the first through the second; the bounds of both steps add up."""
    done = simulate("host_chain", tmp_path / "traces", factor=0.5)
    with open_db(tmp_path / "msgflow.duckdb") as database:
        database.ingest(done.directory, clock_sync="messages")
        rows = {row["hosts"]: row for row in database.query("clocks").to_arrow().to_pylist()}
        wrong = database.sql(
            "SELECT count(*), max(uncertainty_ns), min(latency_ns) FROM remote_latency "
            "WHERE uncertainty_ns IS NULL OR latency_ns + uncertainty_ns < 200_000"
        ).to_arrow()
        notes = database.query("topics-latency", internal=True).notes
    assert {row["reference"] for row in rows.values()} == {"alpha"}
    own = {"alpha": 0.0, "beta": 90e-6, "gamma": -70e-6}
    for name, row in rows.items():
        drift = (1 / (1 + own[name]) - 1) * 1e9
        assert abs(row["drift_ppb"] - drift) <= row["drift_uncertainty_ppb"] + 1
    assert rows["gamma"]["greatest_uncertainty_ns"] > 1.5 * rows["beta"]["greatest_uncertainty_ns"]
    # No way between hosts takes less than 220 us.
    assert wrong.columns[0][0].as_py() == 0
    assert [note.partition(" are known")[0] for note in notes] == [
        "times between alpha and beta",
        "times between alpha and gamma",
    ]
