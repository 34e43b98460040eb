"""Three nodes of a Ray cluster and a store that refuses requests, while much goes wrong.

Nothing is lost, nothing is there twice, and nobody ever sees half a run.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from object_store import KEYS, ObjectStore, object_store

from msgflow import Database
from msgflow.fleet.failure import read_failures
from msgflow.fleet.lake import Lake
from msgflow.fleet.part import Content, write_part
from msgflow.fleet.store import Store
from msgflow.ingest import ingest
from msgflow.sim import simulate

pytest.importorskip("ray", reason="ray is not installed")
pytest.importorskip("moto.moto_server", reason="moto[server] is not installed")

LAKE = "s3://fleet/lake"
GOOD = 3
# Two answers of each run: whoever sees one has to see the other.
WATCHED = ("flow", "callback_duration")


@pytest.fixture(scope="module")
def bucket() -> Iterator[ObjectStore]:
    with pytest.MonkeyPatch.context() as patch, object_store(patch) as store:
        yield store


@pytest.fixture(scope="module")
def recordings(bucket: ObjectStore, tmp_path_factory: pytest.TempPathFactory) -> Path:
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
    """Three nodes with room for one recording each."""
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    from ray.cluster_utils import Cluster

    node = {"num_cpus": 1, "memory": 3_000_000_000, "object_store_memory": 80_000_000}
    made = Cluster(initialize_head=True, head_node_args={**node, "include_dashboard": False})
    try:
        for _ in range(2):
            made.add_node(**node)
        yield made
    finally:
        made.shutdown()


def start(address: str, scratch: Path, *more: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "msgflow", "fleet", "ingest", "s3://fleet/night/*"]
    command += ["--lake", LAKE, "--ray", address, "--scratch", str(scratch), "--tries", "5"]
    return subprocess.Popen(
        [*command, "--no-views", "--no-database", *more], stderr=subprocess.PIPE, text=True
    )


class Watcher:
    """Reads the lake again and again, as anybody might."""

    def __init__(self) -> None:
        self.seen: list[dict[str, tuple[int, ...]]] = []
        self.errors: list[BaseException] = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Watcher:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        try:
            while not self._ended.wait(0.3):
                if Store(LAKE).read("lake.json") is not None:
                    self.seen.append(counts())
        except BaseException as error:
            self.errors.append(error)


def counts() -> dict[str, tuple[int, ...]]:
    """Return of each visible run how many rows its answers have; -1: there is no such file."""
    lake = Lake.open(LAKE)
    found = {}
    for run in lake.runs().to_pylist():
        tables = [read_part(lake, table, run["part"], run["run"]) for table in WATCHED]
        found[run["run"]] = tuple(-1 if table is None else len(table) for table in tables)
    return found


def read_part(lake: Lake, table: str, part: str, run: str) -> pa.Table | None:
    content = lake.store.read(f"{table}/part={part}/data.parquet")
    if content is None:
        return None
    read = pq.read_table(pa.BufferReader(content))
    return read.filter(pa.compute.equal(read["run"], run))


def children(scratch: Path) -> dict[int, str]:
    """Return the processes that do recordings in this folder, and what each is doing."""
    found = {}
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, IndexError):
            words = (entry / "cmdline").read_bytes().split(b"\0")
            if b"msgflow.fleet.child" in words:
                directory = Path(words[words.index(b"msgflow.fleet.child") + 1].decode())
                if scratch in directory.parents:  # not those of other tests
                    found[int(entry.name)] = (directory / "stage").read_text()
    return found


def wait_for(what: str, scratch: Path, seconds: float = 120) -> int:
    """Return a process that does that in this folder just now."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for process, stage in children(scratch).items():
            if stage == what:
                return process
        time.sleep(0.02)
    raise TimeoutError(what)


def parent_of(process: int) -> int:
    return int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])


def test_much_goes_wrong(
    bucket: ObjectStore, cluster: Any, recordings: Path, tmp_path: Path
) -> None:
    scratch = tmp_path / "scratch"
    bucket.refuse_every = 10
    with Watcher() as watcher:
        driver = start(cluster.address, scratch)
        # A worker in the middle of writing, with the process that does it.
        writing = wait_for("writing", scratch)
        os.kill(parent_of(writing), signal.SIGKILL)
        # A node, with all that it was doing.
        wait_for("ingesting", scratch)
        cluster.remove_node(sorted(cluster.worker_nodes, key=str)[0], allow_graceful=False)
        # The driver, once something went in.
        end = time.monotonic() + 120
        while not any(watcher.seen) and time.monotonic() < end and driver.poll() is None:
            time.sleep(0.05)
        driver.kill()
        driver.communicate()
        cluster.add_node(num_cpus=1, memory=3_000_000_000, object_store_memory=80_000_000)
        again = start(cluster.address, scratch)
        _, said = again.communicate(timeout=300)
    bucket.refuse_every = 0
    assert again.returncode == 1, said
    assert "1 failed" in said
    assert bucket.refused > 10
    assert not watcher.errors
    lake = Lake.open(LAKE)
    runs = lake.runs().to_pylist()
    assert sorted(run["name"] for run in runs) == [f"r{number}" for number in range(GOOD)]
    assert [row["reason"] for row in read_failures(lake).to_pylist()] == ["broken"]

    # Row for row what each gives alone, on this machine.
    other = Lake.open_or_create(tmp_path / "lake")
    for run in runs:
        database = tmp_path / f"{run['name']}.duckdb"
        ingest([recordings / run["name"]], database)
        with Database(database) as opened:
            part = write_part(
                opened.connection,
                database,
                other.store,
                tmp_path,
                source=run["source"],
                options={},
                content=Content(views=False, database=False),
            ).values["part"]
        for table in ("flow", "callback_duration", "delivery", "distribution", "finding"):
            alone = read_part(other, table, part, run["run"])
            assert alone is not None
            assert read_part(lake, table, run["part"], run["run"]) == alone, table

    # All that anybody saw at any time was whole.
    whole = counts()
    assert len(watcher.seen) > 3
    for seen in watcher.seen:
        for key, rows in seen.items():
            assert rows == whole[key]
    assert not [path for path in scratch.iterdir() if path.name.endswith(".duckdb")]
    secret = KEYS["AWS_SECRET_ACCESS_KEY"].encode()
    for entry in lake.store.entries():
        assert secret not in (lake.store.read(entry.path) or b"")
    assert KEYS["AWS_SECRET_ACCESS_KEY"] not in said

    # Nothing is left to do: no worker is asked.
    last = start("127.0.0.1:1", scratch)
    assert last.communicate(timeout=60)[1].count(f"{GOOD} there before, 1 failed before") == 1
