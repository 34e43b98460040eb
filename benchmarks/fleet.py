"""How fast recordings go into a lake, by how many workers, and how fast a lake answers.

    python benchmarks/fleet.py [--recordings 20] [--factor 1] [--workers 0 1 2 3] [--runs 1000]
                               [--markdown FILE]

Simulates recordings of robots with three versions of their software, every tenth of them broken.
They go into a new lake for each number of workers: 0 is one process without Ray, others are nodes
of a Ray cluster on this machine with one core each. All lakes have to hold the same.

Then a lake of many runs, copied from those with keys of their own, is asked before and after it is
compacted: the runs alone, the latencies of all paths over all runs, and of ten runs that a label
chooses.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from msgflow.fleet.answers import answers
from msgflow.fleet.compact import compact
from msgflow.fleet.ingest import fleet_ingest
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import part_path
from msgflow.sim import simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

VERSIONS = ("1.0", "1.1", "2.0")
BROKEN = 10
CHOSEN = 10
REPETITIONS = 5
LATENCY = """
SELECT path, count(*) AS pairs, quantile_disc(latency_ns, [0.5, 0.95, 0.99]) AS quantiles
FROM read_parquet($files, hive_partitioning = true, union_by_name = true)
JOIN chosen USING (run, part)
WHERE is_first AND status = 'reached'
GROUP BY path ORDER BY path
"""


def main() -> None:
    """Measure, and print what was measured."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--recordings", type=int, default=20)
    parser.add_argument("--factor", type=float, default=1.0)
    parser.add_argument("--workers", type=int, nargs="*", default=[0, 1, 2, 3])
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--markdown", type=Path)
    given = parser.parse_args()
    lines = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        manifest, size = record(folder, given.recordings, given.factor)
        lines += list(ingested(folder, manifest, size, given.workers))
        if given.runs:
            lines += ["", *asked(folder, given.runs)]
    text = "\n".join([surroundings(), "", *lines])
    print(text)
    if given.markdown:
        given.markdown.write_text(f"{text}\n", encoding="utf-8")


def surroundings() -> str:
    """Return when and on what this was measured."""
    return (
        f"{datetime.now(UTC):%Y-%m-%d}: {os.cpu_count()} cores ({platform.machine()}),"
        f" Python {platform.python_version()}, load {os.getloadavg()[0]:.1f} at the end."
    )


def record(folder: Path, count: int, factor: float) -> tuple[Path, int]:
    """Write recordings and their manifest, and return that and the bytes of all."""
    rows = ["path,robot,software_version"]
    for number in range(count):
        path = folder / "recordings" / f"r{number}"
        if number % BROKEN == BROKEN - 1:
            path.mkdir(parents=True)
            (path / "metadata").write_text("broken")
        else:
            simulate("pipeline", path, factor=factor, seed=number)
        rows.append(f"{path},r{number % 20},{VERSIONS[number % len(VERSIONS)]}")
    manifest = folder / "night.csv"
    manifest.write_text("\n".join(rows) + "\n")
    files = (folder / "recordings").rglob("*")
    return manifest, sum(file.stat().st_size for file in files if file.is_file())


def ingested(
    folder: Path, manifest: Path, source_size: int, workers: Sequence[int]
) -> Iterator[str]:
    """Yield lines of a table: how long it takes with so many workers."""
    yield "| workers | seconds | recordings/min | events/s | went in | failed |"
    yield "| --- | --- | --- | --- | --- | --- |"
    contents = []
    for number in workers:
        place = folder / f"lake{number}"
        begin = time.monotonic()
        if number:
            with cluster(number) as address:
                begin = time.monotonic()
                done = fleet_ingest([str(manifest)], place, ray=address)
        else:
            done = fleet_ingest([str(manifest)], place)
        seconds = time.monotonic() - begin
        yield (
            f"| {number or 'one process'} | {seconds:.1f} | {60 * done.worked / seconds:.1f} |"
            f" {done.events / seconds:,.0f} | {done.in_lake} | {done.failed} |"
        )
        contents.append(flows(Lake.open(place)))
    assert all(content.equals(contents[0]) for content in contents), "the lakes differ"
    lake = Lake.open(folder / f"lake{workers[0]}")
    events = pc.sum(lake.runs()["event_count"]).as_py()
    entries = lake.store.entries()
    of_views = sum(entry.size for entry in entries if entry.path.startswith("view/"))
    of_databases = sum(entry.size for entry in entries if entry.path.startswith("database/"))
    rest = sum(entry.size for entry in entries) - of_views - of_databases
    yield ""
    yield (
        f"{events:,} events, {source_size / events:.0f} bytes each in the recordings. In the lake,"
        f" MB per million events: answers {rest / events:.1f}, views {of_views / events:.1f},"
        f" databases {of_databases / events:.1f}; {len(entries) / len(lake.runs()):.0f} files each."
    )


class cluster:
    """A Ray cluster on this machine, of nodes with one core each."""

    def __init__(self, nodes: int) -> None:
        os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
        from ray.cluster_utils import Cluster

        node = {"num_cpus": 1, "memory": 4_000_000_000, "object_store_memory": 80_000_000}
        self._cluster = Cluster(
            initialize_head=True, head_node_args={**node, "include_dashboard": False}
        )
        for _ in range(nodes - 1):
            self._cluster.add_node(**node)
        self._cluster.wait_for_nodes()

    def __enter__(self) -> str:
        return str(self._cluster.address)

    def __exit__(self, *_: object) -> None:
        self._cluster.shutdown()


def flows(lake: Lake) -> pa.Table:
    """Return the flows of all runs, in order."""
    tables = [pq.ParquetFile(lake.store.full(p)).read() for p in lake.files("flow", lake.runs())]
    return pa.concat_tables(tables).replace_schema_metadata()


def asked(folder: Path, count: int) -> Iterator[str]:
    """Yield lines of a table: how long a lake of many runs takes to answer."""
    source = Lake.open(sorted(folder.glob("lake*"))[0])
    lake = Lake.open_or_create(folder / "many")
    copy(source, lake, count)
    yield f"| {count:,} runs | as written | compacted |"
    yield "| --- | --- | --- |"
    before = measured(lake)
    begin = time.monotonic()
    compact(lake, older_than=0)
    seconds = time.monotonic() - begin
    after = measured(lake)
    for what, value in before.items():
        yield f"| {what} | {value:.2f} s | {after[what]:.2f} s |"
    yield ""
    yield f"Compaction took {seconds:.1f} s."


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


def measured(lake: Lake) -> dict[str, float]:
    """Return seconds, the median of some, by what is asked."""
    whole = {
        "the runs": lambda: lake.runs(),
        "latencies of all runs": lambda: latencies(lake, None),
        f"latencies of {CHOSEN} runs, chosen by a label": lambda: latencies(lake, "0"),
    }
    return {what: median(work) for what, work in whole.items()}


def latencies(lake: Lake, batch: str | None) -> list[Any]:
    """Return quantiles of the latency of each path."""
    runs = lake.runs()
    with duckdb.connect() as con:
        con.register("everything", runs)
        chosen = con.sql(
            "SELECT run, part FROM everything WHERE $batch IS NULL OR labels['batch'] = $batch",
            params={"batch": batch},
        ).to_arrow_table()
        con.register("chosen", chosen)
        files = [lake.store.full(path) for path in lake.files("flow", chosen)]
        return con.execute(LATENCY, {"files": files}).fetchall()


def median(work: Callable[[], Any]) -> float:
    """Return the median of how long something takes [s]."""
    seconds = []
    for _ in range(REPETITIONS):
        begin = time.monotonic()
        work()
        seconds.append(time.monotonic() - begin)
    return statistics.median(seconds)


if __name__ == "__main__":
    main()
