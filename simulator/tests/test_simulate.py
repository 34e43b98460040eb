"""The interface: what it returns, repeats and refuses."""

from __future__ import annotations

import hashlib
import json
import resource
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from support.thorough import SHOWN, few

from msgflow.errors import UsageError
from msgflow_sim import Host, Node, Process, Scenario, Subscription, Timer, scenarios, simulate


def _digest(directory):
    return {
        str(path.relative_to(directory)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(directory.rglob("*"))
        if path.is_file()
    }


@pytest.mark.parametrize("name", few(scenarios(), *SHOWN))
def test_same_seed_gives_the_same_bytes(tmp_path, name):
    for folder, seed in (("one", 7), ("two", 7), ("three", 8)):
        simulate(name, tmp_path / folder, factor=0.05, seed=seed)
    one, two, three = (_digest(tmp_path / folder) for folder in ("one", "two", "three"))
    assert one == two
    assert one.keys() == three.keys()
    # What a perfect recording declares and lacks does not depend on chance, nor do numbers of
    # calls.
    alike = {
        f"truth/{table}.parquet"
        for table in ("trace", "declared", "unrecorded", "dds_event", "link_call", "kernel_loss")
    }
    assert alike < one.keys()
    rows = json.loads((tmp_path / "one" / "truth" / "meta.json").read_text())["rows"]
    empty = {f"truth/{table}.parquet" for table, count in rows.items() if count == 0}
    changing = one.keys() - alike - empty
    assert not {one[name] for name in changing} & {three[name] for name in changing}


def test_result_names_what_was_written(tmp_path):
    simulation = simulate("two_hosts", tmp_path / "out", factor=0.05)
    assert simulation.directory == tmp_path / "out"
    assert simulation.trace_directories == tuple(
        tmp_path / "out" / host / "ust" / "uid" / "1000" / "64-bit" for host in ("alpha", "beta")
    )
    assert all((path / "metadata").is_file() for path in simulation.trace_directories)
    meta = json.loads(simulation.meta.read_text())
    assert meta["scenario"] == "two_hosts"
    assert simulation.event_count == sum(
        sum(host["events"].values()) for host in meta["hosts"].values()
    )
    rows = {name: pq.read_metadata(path).num_rows for name, path in simulation.truth.items()}
    assert rows == meta["rows"]
    written = {path for path in simulation.directory.rglob("*") if path.is_file()}
    assert {*simulation.truth.values(), simulation.meta} < written


@pytest.mark.thorough
def test_factor_multiplies_the_length(tmp_path):
    counts = {}
    for factor in (0.1, 0.2, 0.4):
        simulation = simulate("pipeline", tmp_path / str(factor), factor=factor)
        counts[factor] = simulation.event_count
        length = json.loads(simulation.meta.read_text())["length_ns"]
        assert length == pytest.approx(factor * 1e10, rel=0.03)
    first, second = counts[0.2] - counts[0.1], counts[0.4] - counts[0.2]
    assert second == pytest.approx(2 * first, rel=0.05)


def test_a_longer_run_begins_like_a_shorter_one(tmp_path):
    short, long = (
        pq.read_table(
            simulate("pipeline", tmp_path / str(factor), factor=factor).truth["take"]
        ).to_pylist()
        for factor in (0.1, 0.2)
    )
    assert len(long) > len(short) > 100
    assert long[: len(short)] == short


def test_many_rows_are_written_in_groups(tmp_path):
    simulation = simulate("pipeline", tmp_path / "out", factor=0.5)
    assert pq.read_metadata(simulation.truth["executor_state"]).num_row_groups > 1


@pytest.mark.thorough
def test_the_demonstration_is_worth_looking_at(recordings):
    paths = {
        tuple(path): (count, fastest, slowest)
        for path, count, fastest, slowest in recordings["demo"].truth(
            "SELECT path, count(*), min(latency_ns), max(latency_ns) FROM end_to_end GROUP BY path"
        )
    }
    camera = (
        "/camera/image",
        "/perception/detections",
        "/perception/objects",
        "/planning/trajectory",
        "/control/cmd",
    )
    lidar = ("/lidar/points", "/perception/obstacles", "/planning/trajectory", "/control/cmd")
    assert {camera, lidar, ("/imu/data", "/localization/odometry")} < set(paths)
    count, fastest, slowest = paths[camera]
    assert count > 20
    # Now and then the detector is slow.
    assert slowest - fastest > 20_000_000


def test_an_own_scenario_works(tmp_path):
    scenario = replace(scenarios()["pipeline"], name="mine", duration_ns=200_000_000)
    simulation = simulate(scenario, tmp_path / "out")
    assert json.loads(simulation.meta.read_text())["scenario"] == "mine"
    assert simulation.event_count > 1000


def test_a_scenario_without_messages_ends(tmp_path):
    node = Node("idle", timers=(Timer(50_000_000),))
    scenario = Scenario(
        "idle",
        "Nothing is sent.",
        (Host("alpha"),),
        (Process("idle", "alpha", 100, (node,)),),
        duration_ns=500_000_000,
    )
    simulation = simulate(scenario, tmp_path / "out")
    callbacks = pq.read_table(simulation.truth["callback_instance"], columns=["kind"]).to_pylist()
    assert 9 <= callbacks.count({"kind": "timer"}) <= 31


def test_refuses_an_unknown_scenario(tmp_path):
    with pytest.raises(UsageError, match="unknown scenario — nothing") as caught:
        simulate("nothing", tmp_path / "out")
    assert "pipeline" in (caught.value.hint or "")
    assert not (tmp_path / "out").exists()


def test_refuses_a_directory_with_something_in_it(tmp_path):
    (tmp_path / "precious").write_text("keep me")
    for directory in (tmp_path, tmp_path / "precious"):
        with pytest.raises(UsageError, match="not an empty directory"):
            simulate("pipeline", directory)
    assert [path.name for path in tmp_path.iterdir()] == ["precious"]
    assert (tmp_path / "precious").read_text() == "keep me"


@pytest.mark.parametrize("factor", [0.0, -1.0, float("nan"), float("inf")])
def test_refuses_a_factor_that_is_no_length(tmp_path, factor):
    with pytest.raises(UsageError, match="factor"):
        simulate("pipeline", tmp_path / "out", factor=factor)
    assert not (tmp_path / "out").exists()


def test_refuses_an_unknown_layout(tmp_path):
    with pytest.raises(UsageError, match="unknown layout — turtle"):
        simulate(replace(scenarios()["pipeline"], layout="turtle"), tmp_path / "out")


def _scenario(*processes, hosts=("alpha",)):
    return Scenario("wrong", "Wrong.", tuple(Host(name) for name in hosts), tuple(processes))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: _scenario(hosts=()), "distinct names"),
        (lambda: _scenario(hosts=("alpha", "alpha")), "distinct names"),
        (lambda: _scenario(hosts=("truth",)), "folder — truth"),
        (lambda: _scenario(hosts=("a/b",)), "folder — a/b"),
        (lambda: _scenario(Process("p", "beta", 1, ())), "unknown host beta"),
        (
            lambda: _scenario(Process("p", "alpha", 1, ()), Process("q", "alpha", 10, ())),
            "too close",
        ),
        (
            lambda: _scenario(
                Process("p", "alpha", 1, (Node("n", subscriptions=(Subscription("/a", ("/b",)),)),))
            ),
            "no publisher of /b — node /n",
        ),
        (lambda: Timer(0), "period"),
    ],
)
def test_refuses_a_system_that_cannot_be(make, message):
    with pytest.raises(UsageError, match=message):
        make()


@pytest.mark.parametrize("is_there", [False, True])
def test_where_nothing_can_be_written_no_part_stays(tmp_path: Path, is_there: bool) -> None:
    directory = tmp_path / "out"
    if is_there:
        directory.mkdir()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, hard))
    try:
        with pytest.raises(UsageError, match=r"cannot write the trace \(File too large\) — .*out"):
            simulate("pipeline", directory, factor=0.1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [*tmp_path.rglob("*")] == ([directory] if is_there else [])
