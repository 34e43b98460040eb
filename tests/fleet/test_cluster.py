"""Two nodes of a Ray cluster and a store that refuses requests, while much goes wrong.

Nothing is lost, nothing is there twice, and nobody ever sees half a run.
"""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from support.fleet_cluster import (
    NODE,
    Watcher,
    parent_of,
    ray_cluster,
    read_part,
    row_counts,
    start_ingest,
    wait_for,
)
from support.object_store import KEYS, ObjectStore, object_store

from msgflow import Database
from msgflow.fleet.lake import Lake
from msgflow.fleet.part import write_part
from msgflow.fleet.workers import LOCAL, RayWorkers
from msgflow.ingest import ingest
from msgflow_sim import simulate

# Not imported to see: who runs a single test would wait for both.
pytestmark = pytest.mark.skipif(
    not (find_spec("ray") and find_spec("moto")), reason="ray or moto[server] is not installed"
)
LAKE = "s3://fleet/lake"
GOOD = 2
SOURCES = ("s3://fleet/night/*",)


@pytest.fixture(scope="module")
def bucket() -> Iterator[ObjectStore]:
    with pytest.MonkeyPatch.context() as patch, object_store(patch) as store:
        yield store


@pytest.fixture(scope="module")
def recordings(
    bucket: ObjectStore, empty_database: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Short recordings of robots, here and in the bucket, one of them broken."""
    folder = tmp_path_factory.mktemp("recordings")
    for number in range(GOOD):
        simulate("pipeline", folder / f"r{number}", factor=0.02, seed=number)
        shutil.rmtree(folder / f"r{number}" / "truth")
    (folder / "broken").mkdir()
    (folder / "broken" / "metadata").write_text("no metadata")
    for file in folder.rglob("*"):
        if file.is_file():
            bucket.put(f"fleet/night/{file.relative_to(folder).as_posix()}", file.read_bytes())
    return folder


@pytest.fixture(scope="module")
def cluster(bucket: ObjectStore) -> Iterator[Any]:
    """Two nodes with room for one recording each."""
    with ray_cluster(2) as made:
        yield made


@pytest.mark.thorough
def test_much_goes_wrong(
    bucket: ObjectStore, cluster: Any, recordings: Path, tmp_path: Path
) -> None:
    scratch = tmp_path / "scratch"
    bucket.refuse_every = 25
    with Watcher(LAKE) as watcher:
        driver = start_ingest(SOURCES, LAKE, cluster.address, scratch)
        # A worker in the middle of writing, with the process that does it.
        writing = wait_for("writing", scratch)
        os.kill(parent_of(writing), signal.SIGKILL)
        # A node, with all that it was doing.
        wait_for("ingesting", scratch)
        cluster.remove_node(sorted(cluster.worker_nodes, key=str)[0], allow_graceful=False)
        # The driver, once something went in.
        watcher.wait_until(1, driver)
        driver.kill()
        driver.communicate()
        cluster.add_node(**NODE)
        again = start_ingest(SOURCES, LAKE, cluster.address, scratch)
        _, said = again.communicate(timeout=300)
    bucket.refuse_every = 0
    assert again.returncode == 1, said
    assert "1 failed" in said
    assert bucket.refused > 5
    assert not watcher.errors, watcher.errors
    lake = Lake.open(LAKE)
    runs = lake.runs().to_pylist()
    assert sorted(run["name"] for run in runs) == [f"r{number}" for number in range(GOOD)]
    if [row["reason"] for row in lake.failures().to_pylist()] == ["unreachable"]:
        # Looking at it was refused too often: the next call looks again.
        start_ingest(SOURCES, LAKE, cluster.address, scratch).communicate(timeout=300)
    assert [row["reason"] for row in lake.failures().to_pylist()] == ["broken"]

    # Row for row what each gives alone, on this machine.
    other = Lake.open(tmp_path / "lake", create=True)
    for run in runs:
        database = tmp_path / f"{run['name']}.duckdb"
        ingest([recordings / run["name"]], database)
        with Database(database) as opened:
            part = write_part(
                opened.connection,
                database,
                other.store,
                tmp_path,
                database=False,
            )["part"]
        for table in ("flow", "callbacks", "topics_delivery", "distribution", "finding"):
            alone = read_part(other, table, part, run["run"])
            assert alone is not None
            assert read_part(lake, table, run["part"], run["run"]) == alone, table

    # All that anybody saw at any time was whole.
    assert watcher.polls > 3
    assert watcher.seen == {
        (run["run"], run["part"]): row_counts(lake, run["run"], run["part"]) for run in runs
    }
    assert not list(scratch.rglob("*.duckdb"))
    secret = KEYS["AWS_SECRET_ACCESS_KEY"].encode()
    for entry in lake.store.entries():
        assert secret not in (lake.store.read(entry.path) or b"")
    assert KEYS["AWS_SECRET_ACCESS_KEY"] not in said

    # Nothing is left to do: no worker is asked.
    last = start_ingest(SOURCES, LAKE, "127.0.0.1:1", scratch)
    assert last.communicate(timeout=60)[1].count(f"{GOOD} there before, 1 failed before") == 1


def test_local_is_no_cluster_that_the_environment_names(monkeypatch: pytest.MonkeyPatch) -> None:
    import ray

    asked: list[dict[str, Any]] = []
    monkeypatch.setenv("RAY_ADDRESS", "127.0.0.1:1")
    monkeypatch.setattr(ray, "is_initialized", lambda: False)
    monkeypatch.setattr(ray, "init", lambda **options: asked.append(options))
    RayWorkers(LOCAL)
    # The word keeps Ray from joining what runs already.
    assert [options["address"] for options in asked] == ["local"]


@pytest.mark.thorough
def test_a_cluster_of_its_own_beside_another(
    cluster: Any, recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RAY_ADDRESS", cluster.address)
    ingesting = start_ingest([str(recordings / "r0")], str(tmp_path / "lake"), "local", tmp_path)
    _, said = ingesting.communicate(timeout=120)
    assert ingesting.returncode == 0, said
    assert [run["name"] for run in Lake.open(str(tmp_path / "lake")).runs().to_pylist()] == ["r0"]
