"""Containers whose processes have equal ids: told apart, or said to be mixed up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import duckdb
import pytest
from scoring import compare_simulated
from support.thorough import few

from msgflow.ingest import ingest
from msgflow_sim import scenarios, simulate


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name", few(["containers_one_daemon", "containers_one_hostname"], "containers_one_hostname")
)
def test_processes_with_equal_ids_are_told_apart(tmp_path: Path, name: str) -> None:
    simulation = simulate(name, tmp_path / "trace", factor=0.1)
    report = ingest([simulation.directory], tmp_path / "run.duckdb")
    scores, drops = compare_simulated(tmp_path / "run.duckdb", simulation.truth)
    assert {
        score.kind: (score.wrong, score.misguessed, score.missing, score.doubted)
        for score in scores
        if score.kind != "excused"
    } == dict.fromkeys(
        (
            "callback_instance",
            "callback_run",
            "called_with",
            "direct",
            "executor_state",
            "kind",
            "publication",
            "take",
            "transport",
        ),
        (0, 0, 0, 0),
    )
    assert all(drop.is_right or drop.undecided for drop in drops or [])
    assert [finding.severity for finding in report.findings if "ids" in finding.name] == ["info"]


@pytest.mark.thorough
@pytest.mark.parametrize("cpu_count", [4, pytest.param(1, marks=pytest.mark.thorough)])
def test_links_of_processes_that_cannot_be_told_apart_are_marked(
    tmp_path: Path, cpu_count: int
) -> None:
    """Programs of one name: nothing in the trace says which of them an event is of."""
    scenario = scenarios()["containers_one_daemon"]
    mixture = replace(
        scenario,
        hosts=tuple(replace(host, cpu_count=cpu_count) for host in scenario.hosts),
        processes=tuple(replace(process, name="component") for process in scenario.processes),
    )
    simulation = simulate(mixture, tmp_path / "trace", factor=0.1)
    report = ingest([simulation.directory], tmp_path / "run.duckdb")
    (mixed,) = (finding for finding in report.findings if finding.name == "mixed_processes")
    assert mixed.severity == "error"
    assert mixed.detail.endswith("component 7 on alpha")
    scores, _ = compare_simulated(tmp_path / "run.duckdb", simulation.truth)
    links = {score.kind: score for score in scores if score.kind in {"direct", "transport"}}
    # On one CPU, no simulated thread interrupts the callback of another.
    assert (links["direct"].misguessed > 0) == (cpu_count > 1)
    assert [score.wrong for score in links.values()] == [0, 0]
    with duckdb.connect(str(tmp_path / "run.duckdb"), read_only=True) as con:
        for view in ("link_transport", "link_causal"):
            counts = con.execute(
                f"SELECT count(*) FILTER (candidate_count > 1), count(*) FROM {view}"
            ).fetchall()
            assert counts[0][0] == counts[0][1] > 100, view
