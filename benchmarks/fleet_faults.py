"""Many recordings go into a lake by a Ray cluster while much goes wrong: is anything lost or twice?

    python benchmarks/fleet_faults.py [--recordings 200] [--factor 0.02] [--keep DIR] [--shards N]

Simulates recordings of 20 robots with three versions of their software, every tenth of them broken,
in a bucket of an S3-compatible server (moto), which refuses every tenth request. Three nodes of a
Ray cluster on this machine ingest them. Meanwhile workers are killed while they write, a node is
taken away, and the driver is killed and started again. A reader polls all the time.

At the end every table of the lake has to have the rows that each recording gives alone, and every
run has to have been whole at the moment when it was seen first. `--keep` keeps the recordings and a
copy of the lake.

With `--shards` there is no cluster and no bucket: so many processes fill a lake in a folder side by
side (`fleet ingest --shard`), they and their children are killed at random moments and started
again. Tables, some views and failures have to be those of a lake that one process makes. It prints
how many files a run has.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from support.fleet_cluster import (
    NODE,
    Watcher,
    children,
    parent_of,
    ray_cluster,
    row_counts,
    start_ingest,
    wait_for,
)
from support.fleet_robots import record, robot_of, write_broken
from support.object_store import ObjectStore, object_store

from msgflow import Database
from msgflow.fleet.lake import Lake
from msgflow.fleet.lake_connection import Reading, choose
from msgflow.fleet.part import ANSWERS, write_part
from msgflow.ingest import ingest

if TYPE_CHECKING:
    import pyarrow as pa

VERSIONS = ("1.0", "1.1", "2.0")
SLOW = {"2.0": 0.05}
BROKEN = 10
LAKE = "s3://fleet/lake"
REFUSED = 10
VIEWS = ("publication", "take")


def main() -> None:
    """Do it, and print what happened."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--recordings", type=int, default=200)
    parser.add_argument("--factor", type=float, default=0.02)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--shards", type=int)
    given = parser.parse_args()
    with contextlib.ExitStack() as stack:
        folder = given.keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        good = simulated(folder / "recordings", given.recordings, given.factor)
        print(f"{given.recordings} recordings, {given.recordings - len(good)} of them broken")
        work = measured(folder, given.recordings, good)
        if given.shards:
            work = sharded(folder, given.shards, given.recordings, good)
        for line in work:
            print(line, flush=True)


def measured(folder: Path, count: int, good: list[str]) -> Iterator[str]:
    """Yield what happened; raise where the lake is not what it has to be."""
    with pytest.MonkeyPatch.context() as patch, object_store(patch) as bucket:
        upload(bucket, folder, count)
        bucket.refuse_every = REFUSED
        begin = time.monotonic()
        with ray_cluster(3) as cluster, Watcher(LAKE) as watcher:
            said = go_wrong(cluster, watcher, folder / "scratch", len(good))
        seconds = time.monotonic() - begin
        bucket.refuse_every = 0
        yield said
        yield (
            f"{seconds:.0f} s; {bucket.refused:,} requests refused; a reader looked"
            f" {watcher.polls} times"
        )
        assert not watcher.errors, watcher.errors
        lake = Lake.open(LAKE)
        runs = lake.runs().to_pylist()
        assert sorted(run["name"] for run in runs) == sorted(good)
        failed = lake.failures().to_pylist()
        assert {row["reason"] for row in failed} == {"broken"}, failed
        assert len(failed) == count - len(good)
        whole = {
            (run["run"], run["part"]): row_counts(lake, run["run"], run["part"]) for run in runs
        }
        assert watcher.seen == whole, "somebody saw half a run"
        assert watcher.visible == sorted(watcher.visible), "a run was gone meanwhile"
        tries = sum(run["tries"] for run in runs)
        yield f"{len(runs)} runs in {tries} tries by the drivers that committed them; none half"
        copy(lake, folder / "lake")
    begin, cpu = time.monotonic(), children_cpu()
    alone = Lake.open(folder / "alone", create=True)
    jobs = [(folder / "recordings" / run["name"], run["source"], alone.store.url) for run in runs]
    with ProcessPoolExecutor(2) as pool:
        alone.commit(pool.map(ingest_alone, jobs))
    yield f"each alone: {time.monotonic() - begin:.0f} s, {children_cpu() - cpu:.0f} s of CPU"
    for table, rows in equal(folder / "lake", folder / "alone").items():
        yield f"equal: {table}, {rows:,} rows"


def sharded(folder: Path, shards: int, count: int, good: list[str]) -> Iterator[str]:
    """Yield what happened to a lake of shards; raise where it is not that of one process."""
    source, lakes = folder / "recordings" / "night.csv", (folder / "sharded", folder / "alone")
    source.write_text(manifest(count))
    begin = time.monotonic()
    ingesting(source, lakes[1], folder / "scratch-alone").wait()
    yield f"one process: {time.monotonic() - begin:.0f} s"
    begin = time.monotonic()
    with Watcher(str(lakes[0])) as watcher:
        killed = kill_at_random(source, lakes[0], folder / "scratch", shards)
    yield f"{shards} shards, {killed}: {time.monotonic() - begin:.0f} s"
    assert not watcher.errors, watcher.errors
    assert watcher.visible == sorted(watcher.visible), "a run was gone meanwhile"
    lake = Lake.open(lakes[0])
    runs = lake.runs().to_pylist()
    assert sorted(run["name"] for run in runs) == sorted(good)
    for run in runs:
        key = (run["run"], run["part"])
        assert watcher.seen[key] == row_counts(lake, *key), "somebody saw half a run"
    require_same_runs(lake, Lake.open(lakes[1]))
    yield f"equal: run, {len(runs)} rows; fleet_failure, {count - len(good)} rows"
    for table, rows in equal(*lakes).items():
        yield f"equal: {table}, {rows:,} rows"
    files = [path for path in lakes[0].rglob("*.*") if path.is_file()]
    named = [path for path in files if any(run["part"] in path.name for run in runs)]
    yield f"{len(files)} files of {len(runs)} runs, {len(named)} of them with answers"


def ingesting(source: Path, lake: Path, scratch: Path, *more: str) -> subprocess.Popen[bytes]:
    """Start to ingest recordings into a lake."""
    command = [sys.executable, "-m", "msgflow", "fleet", "ingest", str(source), "--lake", str(lake)]
    command += ["--scratch", str(scratch), "--tries", "20", "--quiet", *more]
    return subprocess.Popen(command, stderr=subprocess.DEVNULL)


def kill_at_random(source: Path, lake: Path, scratch: Path, shards: int) -> str:
    """Fill a lake by shards; kill them, and what they do, some three times each."""
    chance, kills = random.Random(), [0, 0]

    def start(shard: int) -> subprocess.Popen[bytes]:
        return ingesting(source, lake, scratch, "--shard", f"{shard}/{shards}")

    running = [start(shard) for shard in range(shards)]
    while sum(kills) < 3 * shards:
        time.sleep(chance.uniform(0.2, 5))
        found = sorted(children(scratch))
        if found and chance.random() < 0.4:
            with contextlib.suppress(ProcessLookupError):
                os.kill(chance.choice(found), signal.SIGKILL)
                kills[1] += 1
            continue
        shard = chance.randrange(shards)
        if running[shard].poll() is None:
            running[shard].kill()
            kills[0] += 1
        running[shard].wait()
        running[shard] = start(shard)
    for process in running:
        assert process.wait() in (0, 1, 3)
    return f"killed {kills[0]} times, their children {kills[1]} times"


def simulated(folder: Path, count: int, factor: float) -> list[str]:
    """Write recordings, and return the names of those that are not broken."""
    good = []
    for number in range(count):
        name = f"n{number:03}"
        if number % BROKEN == BROKEN - 1:
            write_broken(folder / name, number)
        else:
            slower = SLOW.get(VERSIONS[number % len(VERSIONS)], 0.0)
            record(folder / name, number, slower=slower, factor=factor)
            good.append(name)
    return good


def upload(bucket: ObjectStore, folder: Path, count: int) -> None:
    """Put recordings and their manifest into the bucket."""
    for file in sorted((folder / "recordings").rglob("*")):
        if file.is_file():
            path = file.relative_to(folder / "recordings").as_posix()
            bucket.put(f"fleet/night/{path}", file.read_bytes())
    bucket.put("fleet/night/night.csv", manifest(count).encode())


def manifest(count: int) -> str:
    """Return the list of recordings, with their labels."""
    rows = [
        f"n{number:03},{robot_of(number)},{VERSIONS[number % len(VERSIONS)]}"
        for number in range(count)
    ]
    return "\n".join(["path,robot,software_version", *rows, ""])


def go_wrong(cluster: Any, watcher: Watcher, scratch: Path, good: int) -> str:
    """Ingest while workers, a node and the driver are killed; return what the last one said."""

    def start() -> subprocess.Popen[str]:
        return start_ingest(["s3://fleet/night/night.csv"], LAKE, cluster.address, scratch)

    def kill_writing_worker() -> None:
        os.kill(parent_of(wait_for("writing", scratch)), signal.SIGKILL)

    driver = start()
    kill_writing_worker()
    watcher.wait_until(good // 5, driver, 3_600)
    cluster.remove_node(sorted(cluster.worker_nodes, key=str)[0], allow_graceful=False)
    watcher.wait_until(good // 3, driver, 3_600)
    cluster.add_node(**NODE)
    # The process that does it, not its worker.
    os.kill(wait_for("writing", scratch), signal.SIGKILL)
    watcher.wait_until(good // 2, driver, 3_600)
    assert driver.poll() is None, "it was done too soon"
    driver.kill()
    driver.communicate()
    again = start()
    watcher.wait_until(2 * good // 3, again, 3_600)
    kill_writing_worker()
    _, said = again.communicate(timeout=7_200)
    assert again.returncode == 1, said
    return next(line for line in said.splitlines() if "recordings for" in line)


def copy(lake: Lake, folder: Path) -> None:
    """Copy a lake out of its bucket."""
    for entry in lake.store.entries():
        content = lake.store.read(entry.path)
        assert content is not None
        path = folder / entry.path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def ingest_alone(job: tuple[Path, str, str]) -> dict[str, Any]:
    """Ingest one recording into a database, write its answers, and return its row of `run`."""
    recording, source, url = job
    with tempfile.TemporaryDirectory() as name:
        database = Path(name) / "msgflow.duckdb"
        ingest([recording], database)
        with Database(database) as opened:
            part = write_part(
                opened.connection,
                database,
                Lake.open(url).store,
                Path(name),
                database=False,
            )
    return {**part, "source": source}


def require_same_runs(one: Lake, other: Lake) -> None:
    """Raise where two lakes differ in their runs or failures."""
    left = {"part", "database_part", "committed_ns", "failed_ns", "worker"}
    left |= {"seconds", "tries"}
    for tables in ([one.runs(), other.runs()], [one.failures(), other.failures()]):
        same = [each for each in tables[0].column_names if each not in left]
        assert tables[0].select(same).equals(tables[1].select(same)), tables[0].column_names


def equal(one: Path, other: Path) -> dict[str, int]:
    """Return the rows of every table and of some views; raise where two lakes differ in one."""
    found = {}
    with contextlib.ExitStack() as stack:
        both = [
            stack.enter_context(Reading(choose(Lake.open(each)), ANSWERS, VIEWS))
            for each in (one, other)
        ]
        for table in (*ANSWERS, *(f"view.{view}" for view in VIEWS)):
            sql = f"FROM {table} ORDER BY ALL"
            rows: list[pa.Table] = [each.connection.execute(sql).to_arrow_table() for each in both]
            assert rows[0].equals(rows[1]), table
            found[table] = len(rows[0])
    return found


def children_cpu() -> float:
    """Return the processor time of processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
