"""A Ray cluster of this machine, a reader that polls, and processes to kill; lakes in buckets."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from msgflow.fleet.file_store import Store
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import part_path
from msgflow.fleet.part import ANSWERS

NODE = {
    "num_cpus": 1,
    "memory": 3_000_000_000,
    "object_store_memory": 80_000_000,
    "include_log_monitor": False,
    "no_monitor": True,
}


@contextmanager
def ray_cluster(nodes: int) -> Iterator[Any]:
    """Start a Ray cluster on this machine, of nodes with room for one recording each."""
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    from ray.cluster_utils import Cluster

    made: Any = Cluster(initialize_head=True, head_node_args={**NODE, "include_dashboard": False})
    try:
        for _ in range(nodes - 1):
            made.add_node(**NODE)
        made.wait_for_nodes()
        yield made
    finally:
        made.shutdown()


def start_ingest(
    sources: Sequence[str], lake: str, address: str, scratch: Path
) -> subprocess.Popen[str]:
    """Start to ingest recordings into a lake, their answers alone."""
    command = [sys.executable, "-m", "msgflow", "fleet", "ingest", *sources, "--lake", lake]
    command += ["--ray", address, "--scratch", str(scratch), "--tries", "5"]
    return subprocess.Popen(
        [*command, "--no-database"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


class Watcher:
    """Reads a lake again and again, as anybody might: a reader sees all of a run, or nothing.

    Attributes:
        polls: how often it looked.
        seen: rows of each answer at the moment when a row of `run` was seen first, by run and
            part; -1: there was no such file.
        visible: how many runs were there at each look.
        errors: what ended it.
    """

    def __init__(self, lake: str) -> None:
        self.polls = 0
        self.seen: dict[tuple[str, str], dict[str, int]] = {}
        self.visible: list[int] = []
        self.errors: list[BaseException] = []
        self._url = lake
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Watcher:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def wait_until(self, count: int, driver: subprocess.Popen[str], seconds: float = 120) -> None:
        """Wait until so many runs were seen, as long as somebody writes."""
        end = time.monotonic() + seconds
        while len(self.seen) < count and time.monotonic() < end and driver.poll() is None:
            time.sleep(0.05)

    def _run(self) -> None:
        try:
            is_last = False
            while not is_last:
                is_last = self._ended.wait(0.3)
                if Store(self._url).read("lake.json") is not None:
                    self._look()
        except BaseException as error:
            self.errors.append(error)

    def _look(self) -> None:
        self.polls += 1
        lake = Lake.open(self._url)
        runs = lake.runs().to_pylist()
        self.visible.append(len(runs))
        for run in runs:
            key = (run["run"], run["part"])
            if key not in self.seen:
                self.seen[key] = row_counts(lake, *key)


def row_counts(lake: Lake, run: str, part: str) -> dict[str, int]:
    """Return how many rows of each answer a run has; -1: there is no such file."""
    tables = {table: read_part(lake, table, part, run) for table in ANSWERS}
    return {name: -1 if table is None else len(table) for name, table in tables.items()}


def read_part(lake: Lake, table: str, part: str, run: str) -> pa.Table | None:
    """Return the rows of an answer that a run has in a part; None: there is no such file.

    The column `part` is left out: what is written twice has two.
    """
    content = lake.store.read(part_path(table, part))
    if content is None:
        return None
    read = pq.ParquetFile(pa.BufferReader(content)).read()
    return read.filter(pc.equal(read["run"], run)).drop_columns(["part"])


def children(scratch: Path) -> dict[int, str]:
    """Return the processes that do recordings in this folder, and what each is doing."""
    found = {}
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, IndexError):
            words = (entry / "cmdline").read_bytes().split(b"\0")
            if b"msgflow.fleet.child_process" in words:
                directory = Path(words[words.index(b"msgflow.fleet.child_process") + 1].decode())
                if scratch in directory.parents:  # not those of others
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
    """Return the process that started another."""
    return int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])
