"""The Autoware reference system: what a lidar message becomes, as it really was; and compared."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from support import autoware

import msgflow
from msgflow_sim import Simulation, simulate
from msgflow_sim.entity import SECOND

pytestmark = pytest.mark.thorough
_MARGIN_NS = SECOND


@pytest.fixture(scope="module")
def runs(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[msgflow.Database, dict[int, Simulation]]]:
    """One database with both variants, four seconds each, and the simulations by run."""
    directory = tmp_path_factory.mktemp("autoware")
    with msgflow.open_db(directory / "autoware.duckdb") as database:
        simulations = {}
        for name in autoware.NAMES:
            simulation = simulate(name, directory / name, factor=0.2)
            simulations[database.ingest(simulation.directory, name=name).run_id] = simulation
        yield database, simulations


def test_each_lidar_message_becomes_as_many_commands_as_it_really_did(runs: Any) -> None:
    database, simulations = runs
    measured = autoware.measure(database, list(simulations), _MARGIN_NS)
    assert [each.name for each in measured] == list(autoware.NAMES)
    for each, simulation in zip(measured, simulations.values(), strict=True):
        truth = autoware.true_messages(simulation.truth, each)
        assert truth[True] == (each.roots, each.messages)
        assert max(each.messages) == 3
        # Fewer where messages are not used again.
        emptied = truth[False][1]
        assert sum(n * k for n, k in emptied.items()) < sum(n * k for n, k in each.messages.items())
        # What comes later comes by other topics, one cycle of 100 ms apart.
        assert each.last_ns[1] - each.first_ns[1] > 90_000_000
        assert "|" in each.usual_branches


def test_two_threads_do_what_one_did_one_after_the_other(runs: Any) -> None:
    database, _ = runs
    comparison = database.compare(
        *autoware.NAMES, what="topics", skip_first=1.0, case="first", resamples=400
    )
    rows = {
        row["subject"]: row
        for row in comparison.result.to_arrow().to_pylist()
        if row["statistic"] == "median"
    }
    # The second subscription of /PointCloudFusion had to wait for the callback of the first.
    waited = rows["/PointCloudFusion → /VoxelGridDownsampler"]
    assert waited["a_ns"] > 20_000_000
    assert waited["b_ns"] < 1_000_000
    # Every cycle is like the one before: that makes few values that tell something new.
    assert waited["verdict"] == "too few independent values"
    # What does not depend on that process takes as long as before.
    unrelated = rows["/Lanelet2MapLoader → /LanePlanner"]
    assert abs(unrelated["difference_ns"]) < 0.01 * unrelated["a_ns"]
