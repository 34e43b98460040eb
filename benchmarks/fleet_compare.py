"""Does `msgflow fleet compare` find a difference where there is one, and none where there is none?

    python benchmarks/fleet_compare.py [--repetitions 100] [--recordings 60] [--lake DIR]

Repetitions draw the latencies of runs from a generator: runs of a side differ from each other, and
flows within a run. Each is compared with the same settings: how often does the interval of the
median contain the true difference (0 or 5 %), and how often is a difference shown?

Then simulated recordings of 20 robots go into a lake, half of them of a version whose callbacks
take 5 % longer, and that lake is compared: by version, and the one version with itself. `--lake`
takes one that is there, with the versions 1.0, 1.1 and 2.0 of benchmarks/fleet_faults.py.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb
import numpy as np
import pyarrow as pa
from fleet_robots import record, robot_of

from msgflow.fleet.compare import compare, compared
from msgflow.fleet.ingest import Options, fleet_ingest
from msgflow.fleet.lake import Lake

if TYPE_CHECKING:
    from collections.abc import Iterator

SLOWER = 0.05
FLOWS = 100
# Repetitions that are compared at once, each a path of its own.
AT_ONCE = 25
SIDES = ((30, 30), (6, 6), (6, 30), (10, 10), (100, 20))
# How much runs differ: what each kind adds to the logarithm of all latencies of a run.
KINDS = (
    "runs differ by 3 %",
    "runs differ by 15 %",
    "skewed: some are much slower",
    "a tenth three times as slow",
    "heavy tails",
    "B differs four times as much",
    "robots differ by 3 %, two runs each",
)


def main() -> None:
    """Measure, and print what was measured."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--repetitions", type=int, default=100)
    parser.add_argument("--recordings", type=int, default=60)
    parser.add_argument("--lake", type=Path)
    given = parser.parse_args()
    for line in coverage(given.repetitions):
        print(line, flush=True)
    print()
    with tempfile.TemporaryDirectory() as name:
        lake = given.lake or recorded(Path(name), given.recordings)
        for line in real(Lake.open(lake)):
            print(line, flush=True)


def coverage(repetitions: int) -> Iterator[str]:
    """Yield lines of a table: of each kind, how often an interval was right."""
    generator = np.random.default_rng(0)
    yield f"{repetitions} repetitions, {FLOWS} flows a run, 95 %:"
    yield "| | runs | contain 0 | contain 5 % | 5 % found |"
    yield "| --- | --- | --- | --- | --- |"
    for kind in KINDS:
        for sides in SIDES if kind == KINDS[0] else SIDES[:2]:
            same = repeated(generator, kind, sides, 0.0, repetitions)
            slower = repeated(generator, kind, sides, SLOWER, repetitions)
            shares = [
                sum(contains(row, 0.0) for row in same),
                sum(contains(row, SLOWER) for row in slower),
                sum(row["verdict"] == "B is longer" for row in slower),
            ]
            numbers = " | ".join(f"{share / repetitions:.2f}" for share in shares)
            yield f"| {kind} | {sides[0]}, {sides[1]} | {numbers} |"


def contains(row: dict[str, Any], share: float) -> bool:
    """Tell whether an interval contains a difference."""
    return bool(row["low_percent"] <= 100 * share <= row["high_percent"])


def repeated(
    generator: np.random.Generator,
    kind: str,
    sides: tuple[int, int],
    slower: float,
    repetitions: int,
) -> list[dict[str, Any]]:
    """Return the row of the median of each repetition."""
    rows: list[dict[str, Any]] = []
    while len(rows) < repetitions:
        count = min(AT_ONCE, repetitions - len(rows))
        with duckdb.connect(config={"threads": 1}) as con:
            flows(con, drawn(generator, kind, sides, slower, count))
            con.execute(
                "CREATE TABLE sided AS SELECT 'r' || n AS run, 'r' || n AS unit,"
                " CASE WHEN n < $first THEN 'a' ELSE 'b' END AS side FROM range($all) AS r (n)",
                {"first": sides[0], "all": sum(sides)},
            )
            table = compared(con).to_arrow()
        rows += [row for row in table.to_pylist() if row["statistic"] == "median"]
    return rows


def drawn(
    generator: np.random.Generator,
    kind: str,
    sides: tuple[int, int],
    slower: float,
    count: int,
) -> np.ndarray:
    """Return latencies [ns], by repetition, run and flow."""
    shape = (count, sum(sides))
    is_b = np.arange(shape[1]) >= sides[0]
    if kind == KINDS[1]:
        run = generator.normal(0, 0.15, shape)
    elif kind == KINDS[2]:
        run = generator.exponential(0.1, shape)
    elif kind == KINDS[3]:
        run = generator.normal(0, 0.03, shape) + (generator.random(shape) < 0.1) * np.log(3)
    elif kind == KINDS[4]:
        run = 0.03 * generator.standard_t(2, shape)
    elif kind == KINDS[5]:
        run = generator.normal(0, 1, shape) * np.where(is_b, 0.08, 0.02)
    elif kind == KINDS[6]:
        # Each robot runs both versions: run n of a side is that of robot n / 2.
        place = np.where(is_b, np.arange(shape[1]) - sides[0], np.arange(shape[1])) // 2
        robot = generator.normal(0, 0.03, (count, shape[1]))
        run = generator.normal(0, 0.03, shape) + robot[:, place]
    else:
        run = generator.normal(0, 0.03, shape)
    run = run + np.where(is_b, np.log1p(slower), 0)
    # Neighbours are alike: half of what a flow has it has from the one before.
    noise = generator.gamma(4, 0.05, (*shape, FLOWS))
    noise[..., 1:] = (noise[..., 1:] + noise[..., :-1]) / 2
    return (2e6 * np.exp(run)[..., None] * (1 + noise)).astype(np.int64)


def flows(con: duckdb.DuckDBPyConnection, latencies: np.ndarray) -> None:
    """Make the tables of a lake of latencies by path, run and flow."""
    path, run, _ = np.indices(latencies.shape)
    drawn_flows = pa.table(
        {"path": path.ravel(), "run": run.ravel(), "latency_ns": latencies.ravel()}
    )
    con.register("drawn", drawn_flows)
    con.execute(
        "CREATE TABLE flow AS SELECT 'r' || run AS run, 'path ' || path AS path, latency_ns,"
        " 'reached' AS status, true AS is_first, true AS is_last, true AS is_newest,"
        " false AS is_loss_affected FROM drawn"
    )
    con.execute("CREATE TABLE e2e_latency AS SELECT DISTINCT run, path, false AS is_cut FROM flow")


def recorded(folder: Path, count: int) -> Path:
    """Simulate recordings, put them into a lake, and return it."""
    rows = ["path,robot,software_version"]
    for number in range(count):
        version = ("1.0", "2.0")[number % 2]
        path = folder / "recordings" / f"n{number:03}"
        record(path, number, slower=SLOWER * (version == "2.0"))
        rows.append(f"{path},{robot_of(number)},{version}")
    manifest = folder / "night.csv"
    manifest.write_text("\n".join(rows) + "\n")
    options = Options(views=False, database=False)
    done = fleet_ingest([str(manifest)], folder / "lake", options=options)
    assert done.added == count
    return folder / "lake"


def real(lake: Lake) -> Iterator[str]:
    """Yield what a comparison of simulated recordings says."""
    versions = {dict(pairs)["software_version"] for pairs in lake.runs()["labels"].to_pylist()}
    yield "| versions | runs | median | change | interval | verdict | seconds |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    pairs = [("1.0", "2.0"), ("1.0", "1.1"), ("1.1", "2.0")]
    for base, other in pairs:
        if {base, other} <= versions:
            begin = time.monotonic()
            comparison = compare(lake, "software_version", base, other)
            seconds = time.monotonic() - begin
            row = comparison.result.to_arrow().to_pylist()[0]
            yield (
                f"| {base}, {other} | {row['a_count']}, {row['b_count']} |"
                f" {row['a_ns'] / 1e6:.3f} ms | {row['change_percent']:.1f} % |"
                f" {row['low_percent']:.1f} to {row['high_percent']:.1f} % | {row['verdict']} |"
                f" {seconds:.1f} |"
            )


if __name__ == "__main__":
    main()
