"""What a recording costs, how fast many go into a lake, and how fast a lake of many runs answers.

    python benchmarks/fleet.py [--factors 0.02 1 10] [--recordings 9] [--workers 0 1 2 3]
                               [--runs 1000] [--markdown FILE]

First recordings of the simulated robot (`demo`), as many times as long as each factor says, go in
one by one: processor time, memory, scratch space, and what the lake takes.

Then short recordings go in by different numbers of workers: 0 is one process without Ray, others
are nodes of a Ray cluster on this machine with one core each. All lakes have to hold the same.
`core seconds` are those of the processes that do the recordings: where they grow with the workers,
cores are shared.

Last a lake of many runs, copied from those with keys of their own, is asked before and after it is
compacted. A factor, number of workers or of runs of -1 leaves that part out.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))

from fleet_cluster import ray_cluster
from fleet_robots import record, robot_of

from msgflow.fleet.answers import answers
from msgflow.fleet.compact import compact
from msgflow.fleet.ingest import Options, fleet_ingest
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import part_path
from msgflow.sim import simulate

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

VERSIONS = ("1.0", "1.1", "2.0")
CHOSEN = 10
REPETITIONS = 5
_TICKS = os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Measure, and print what was measured."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--factors", type=float, nargs="*", default=[0.02, 1.0, 10.0])
    parser.add_argument("--recordings", type=int, default=9)
    parser.add_argument("--workers", type=int, nargs="*", default=[0, 1, 2, 3])
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--markdown", type=Path)
    given = parser.parse_args()
    lines = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in (
            sized(folder, [factor for factor in given.factors if factor > 0]),
            side_by_side(folder, given.recordings, [n for n in given.workers if n >= 0]),
            asked(folder, given.runs),
        ):
            for line in part:
                print(line, flush=True)
                lines.append(line)
    lines.append(surroundings())
    print(lines[-1])
    if given.markdown:
        given.markdown.write_text("\n".join(lines) + "\n", encoding="utf-8")


def surroundings() -> str:
    """Return when and on what this was measured."""
    return (
        f"{datetime.now(UTC):%Y-%m-%d}: {os.cpu_count()} cores ({platform.machine()}),"
        f" Python {platform.python_version()}, load {os.getloadavg()[0]:.1f} at the end."
    )


class Tasks:
    """Watches the processes that do recordings, whoever started them.

    Attributes:
        memory: most bytes that one of them took.
        scratch: most bytes that lay in the scratch folder.
    """

    def __init__(self, scratch: Path) -> None:
        self.memory = 0
        self.scratch = 0
        self._folder = scratch
        self._cpu: dict[int, float] = {}
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)

    @property
    def core_seconds(self) -> float:
        """Processor time of all of them [s], but for their last tenth of a second."""
        return sum(self._cpu.values())

    def __enter__(self) -> Tasks:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(0.1):
            for entry in Path("/proc").iterdir():
                with contextlib.suppress(OSError, ValueError, StopIteration):
                    self._look(entry)
            size = 0
            for path in self._folder.rglob("*"):
                with contextlib.suppress(OSError):
                    size += path.stat().st_size
            self.scratch = max(self.scratch, size)

    def _look(self, entry: Path) -> None:
        process = int(entry.name)
        command = (entry / "cmdline").read_bytes()
        if b"msgflow.fleet.child" not in command or bytes(self._folder) not in command:
            return
        fields = (entry / "stat").read_text().rpartition(")")[2].split()
        self._cpu[process] = (int(fields[11]) + int(fields[12])) / _TICKS
        lines = (entry / "status").read_text().splitlines()
        peak = next(line for line in lines if line.startswith("VmHWM"))
        self.memory = max(self.memory, int(peak.split()[1]) * 1024)


def sized(folder: Path, factors: Sequence[float]) -> Iterator[str]:
    """Yield lines of a table: what a recording costs, by its length."""
    yield (
        "| events | MB | core seconds | events/s per core | memory | scratch | answers | views |"
        " database | files |"
    )
    yield f"|{' --- |' * 10}"
    for factor in factors:
        name = f"demo-{factor:g}"
        recording = simulate("demo", folder / name / "recording", factor=factor).directory
        for path in sorted((recording / "truth").iterdir()):
            path.unlink()
        lake, scratch = folder / name / "lake", folder / name / "scratch"
        with Tasks(scratch) as tasks:
            fleet_ingest([str(recording)], lake, options=Options(scratch=str(scratch)))
        opened = Lake.open(lake)
        (run,) = opened.runs().to_pylist()
        sizes = {"view": 0, "database": 0, "": 0}
        entries = opened.store.entries()
        for entry in entries:
            kind = entry.path.partition("/")[0]
            sizes[kind if kind in sizes else ""] += entry.size
        events = run["event_count"]
        bytes_of = (tasks.memory, tasks.scratch, sizes[""], sizes["view"], sizes["database"])
        yield (
            f"| {events:,} | {run['source_bytes'] / 1e6:.1f} | {tasks.core_seconds:.1f} |"
            f" {events / tasks.core_seconds:,.0f} |"
            f" {' | '.join(f'{size / 1e6:.2f} MB' for size in bytes_of)} | {len(entries)} |"
        )
    yield ""


def side_by_side(folder: Path, count: int, workers: Sequence[int]) -> Iterator[str]:
    """Yield lines of a table: how long it takes with so many workers."""
    rows = ["path,robot,software_version"]
    for number in range(count):
        path = folder / "recordings" / f"r{number}"
        record(path, number)
        rows.append(f"{path},{robot_of(number)},{VERSIONS[number % len(VERSIONS)]}")
    manifest = folder / "night.csv"
    manifest.write_text("\n".join(rows) + "\n")
    yield "| workers | seconds | recordings/min | core seconds each |"
    yield "| --- | --- | --- | --- |"
    contents = []
    for number in workers:
        place, scratch = folder / f"lake{number}", folder / f"scratch{number}"
        options = Options(views=False, database=False, scratch=str(scratch))
        with contextlib.ExitStack() as stack:
            ray = stack.enter_context(ray_cluster(number)).address if number else None
            tasks = stack.enter_context(Tasks(scratch))
            begin = time.monotonic()
            done = fleet_ingest([str(manifest)], place, ray=ray, options=options)
            seconds = time.monotonic() - begin
        assert done.added == count, done.failures
        yield (
            f"| {number or 'one process'} | {seconds:.1f} | {60 * count / seconds:.1f} |"
            f" {tasks.core_seconds / count:.1f} |"
        )
        contents.append(flows(Lake.open(place)))
    assert all(content.equals(contents[0]) for content in contents), "the lakes differ"
    yield ""


def flows(lake: Lake) -> pa.Table:
    """Return the flows of all runs, in order."""
    tables = [pq.ParquetFile(lake.store.full(p)).read() for p in lake.files("flow", lake.runs())]
    return pa.concat_tables(tables).replace_schema_metadata()


def asked(folder: Path, count: int) -> Iterator[str]:
    """Yield lines of a table: how long a lake of many runs takes to answer."""
    sources = sorted(folder.glob("lake*"))
    if count <= 0 or not sources:
        return
    lake = Lake.open_or_create(folder / "many")
    copy(Lake.open(sources[0]), lake, count)
    yield f"| {count:,} runs | as ingested | compacted |"
    yield "| --- | --- | --- |"
    before = measured(lake)
    begin, cpu = time.monotonic(), time.process_time()
    compact(lake, older_than=0)
    seconds, cpu = time.monotonic() - begin, time.process_time() - cpu
    after = measured(lake)
    for what, value in before.items():
        yield f"| {what} | {value} | {after[what]} |"
    yield ""
    yield f"Compaction took {seconds:.1f} s, {cpu:.1f} s of a core."


def copy(source: Lake, target: Lake, count: int) -> None:
    """Fill a lake with copies of runs, each with a key of its own."""
    runs = source.runs().to_pylist()
    tables = {
        (answer.table, run["part"]): pq.ParquetFile(
            source.store.full(part_path(answer.table, run["part"]))
        ).read()
        for answer in answers()
        for run in runs
    }
    rows = []
    for number in range(count):
        run = runs[number % len(runs)]
        key = f"{number * 2654435761 % 2**32:020x}"
        for answer in answers():
            table = tables[answer.table, run["part"]]
            keys = pa.array([key] * len(table), pa.string())
            place = Path(target.store.full(part_path(answer.table, key)))
            place.parent.mkdir(parents=True)
            pq.write_table(table.set_column(0, "run", keys), place, compression="zstd")
        rows.append(
            {**run, "run": key, "part": key, "view_part": None, "database_part": None}
            | {"labels": {**dict(run["labels"]), "batch": str(number // CHOSEN)}}
        )
    for row in rows:
        target.commit([row])
    # As every ingest does in the end.
    target.put_together()


def measured(lake: Lake) -> dict[str, str]:
    """Return seconds that passed and those of a core, each the median of some, by what is asked.

    Each is a command, with all that it takes to start.
    """
    url = lake.store.url
    chosen = ["--where", "batch = '0'"]
    commands = {
        "`fleet runs`": ["runs"],
        "`fleet query e2e-latency`": ["query", "e2e-latency"],
        f"the same of {CHOSEN} runs": ["query", "e2e-latency", *chosen],
        "`fleet compare`": ["compare", "--by", "software_version", "1.0", "2.0"],
    }
    return {what: timed([*words, "--lake", url]) for what, words in commands.items()}


def timed(words: list[str]) -> str:
    """Return how long a command of the fleet takes: seconds that passed, and those of a core."""
    passed, used = [], []
    for _ in range(REPETITIONS):
        begin, cpu = time.monotonic(), children_cpu()
        subprocess.run(
            [sys.executable, "-m", "msgflow", "fleet", *words],
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        passed.append(time.monotonic() - begin)
        used.append(children_cpu() - cpu)
    return f"{statistics.median(passed):.2f} s ({statistics.median(used):.2f} s of a core)"


def children_cpu() -> float:
    """Return the processor time of processes that have ended [s]."""
    used: Any = resource.getrusage(resource.RUSAGE_CHILDREN)
    return float(used.ru_utime + used.ru_stime)


if __name__ == "__main__":
    main()
