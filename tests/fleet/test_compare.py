"""Two sides differ where their runs differ by more than runs of one side do."""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from typer.testing import CliRunner, Result

from msgflow.cli.app import app
from msgflow.errors import UsageError
from msgflow.fleet.compare import compare
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import part_path
from msgflow.query.compare import LEAST_RUNS
from msgflow.query.compare import runs_compared as compared
from msgflow.sql.statement import internal_sql

PATH = "/camera → /image → /control"
# 100 flows about a middle of 1: enough for p95, whose value is 1.095.
SHAPE = [1 + (place - 49) / 1000 for place in range(100)]
Z95 = statistics.NormalDist().inv_cdf(0.975)


def fill(folder: Path, runs: Iterable[tuple[Mapping[str, str], Mapping[str, float]]]) -> Lake:
    """Write a lake of runs: the labels of each, and the median of each of its paths [ms]."""
    lake = Lake.open(folder / "lake", create=True)
    rows = []
    for number, (labels, medians) in enumerate(runs):
        key = {"run": f"{number:020x}", "part": f"p{number}"}
        rows.append(key | {"labels": labels, "schema_revision": "1", "name": f"n{number}"})
        flow = {"status": "reached", "is_loss_affected": False, "is_ambiguous": False}
        flow |= dict.fromkeys(("is_first", "is_last", "is_newest"), True)
        flows = [
            key | flow | {"path": path, "latency_ns": round(1e6 * median * part)}
            for path, median in medians.items()
            for part in SHAPE
        ]
        paths = [key | {"path": path, "is_cut": False} for path in medians]
        for name, table in (("flow", flows), ("e2e_latency", paths)):
            path = part_path(name, key["part"])
            lake.put_table(path, name, pa.Table.from_pylist(table), "1")
    lake.commit(rows)
    return lake


def spread(middle: float, count: int) -> list[float]:
    """Return medians of runs that differ from each other by some percent."""
    return [middle * math.exp(0.04 * ((7 * n % count) / (count - 1) - 0.5)) for n in range(count)]


def version(name: str, values: Sequence[float]) -> list[tuple[dict[str, str], dict[str, float]]]:
    """Return runs of a version: two of each robot."""
    return [
        ({"version": name, "robot": f"r{number // 2}"}, {PATH: value})
        for number, value in enumerate(values)
    ]


@pytest.fixture(scope="module")
def slower(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """A lake with 30 runs of each of two versions; 2.10 is slower by 5 %."""
    runs = version("2.9", spread(1.0, 30)) + version("2.10", spread(1.05, 30))
    return fill(tmp_path_factory.mktemp("slower"), [*runs, ({"robot": "r9"}, {PATH: 9.0})])


def run(lake: Lake, *arguments: str) -> Result:
    return CliRunner().invoke(app, ["fleet", "compare", "--lake", lake.store.url, *arguments])


def rows_of(lake: Lake, **given: Any) -> dict[str, dict[str, Any]]:
    rows = compare(lake, "version", **given).result.to_arrow().to_pylist()
    return {row["statistic"]: row for row in rows}


def test_a_version_that_is_slower_is_found(slower: Lake) -> None:
    comparison = compare(slower, "version")
    rows = {row["statistic"]: row for row in comparison.result.to_arrow().to_pylist()}
    verdicts = {name: row["verdict"] for name, row in rows.items()}
    assert verdicts == {
        **dict.fromkeys(("median", "mean", "p95"), "B is longer"),
        "p99": "too few values",
        "max": "not estimated",
    }
    median = rows["median"]
    assert median["change_percent"] == pytest.approx(5, abs=0.1)
    assert median["low_percent"] < 5 < median["high_percent"]
    assert (median["a_count"], median["b_count"], median["a_flows"]) == (30, 30, 3000)
    notes = comparison.result.notes
    assert notes[:2] == ["A is version=2.9: 30 runs", "B is version=2.10: 30 runs"]
    assert "left out: 0 runs with other values of version, 1 without it" in notes
    assert "3 of 3 intervals show a difference; if there were none, some 0.15 would" in notes
    assert comparison.changes().to_arrow()["change"].to_pylist() == ["longer"]
    (failure,) = comparison.failures(["median>4%,p95>6%"])
    assert failure.condition == "median>4%"
    assert failure.reason.startswith("5")


def test_the_same_is_not_found_the_other_way_round(slower: Lake) -> None:
    forth, back = rows_of(slower), rows_of(slower, base="2.10", other="2.9")
    # 5 % longer one way is 4.8 % shorter the other way: surely shorter, and less than matters.
    assert back["p95"]["high_percent"] < 0
    assert back["p95"]["verdict"] == "about equal"
    for one, other in (("low_percent", "high_percent"), ("high_percent", "low_percent")):
        ratio = (1 + forth["p95"][one] / 100) * (1 + back["p95"][other] / 100)
        assert ratio == pytest.approx(1, abs=1e-4)


def test_half_of_one_version_does_not_differ_from_the_other_half(slower: Lake) -> None:
    row = {
        row["statistic"]: row
        for row in compare(
            slower, "robot", "r1", "r2", where="version = '2.9' OR version = '2.10'"
        ).result.to_arrow().to_pylist()
    }  # fmt: skip
    assert row["median"]["verdict"] == "too few runs"
    assert row["median"]["low_ns"] is None


def test_a_few_bad_runs_change_nothing(tmp_path: Path) -> None:
    values = spread(1.0, 30)
    bad = [*values[:24], *(50.0 for _ in range(6))]
    lake = fill(tmp_path, version("1", values) + version("2", bad))
    row = rows_of(lake)["median"]
    assert row["verdict"] == "no difference shown"
    assert abs(row["change_percent"]) < 2


@pytest.mark.thorough
def test_runs_of_a_robot_may_count_as_one(slower: Lake) -> None:
    """Each robot made two runs of a version: half as many tell less."""
    given = {"at_least": "4%"}
    alone = rows_of(slower, **given)["median"]
    robots = rows_of(slower, unit="robot", **given)["median"]
    assert (robots["a_count"], robots["b_count"], robots["a_flows"]) == (15, 15, 3000)
    assert robots["verdict"] == "B is longer"
    assert robots["a_ns"] == pytest.approx(alone["a_ns"], rel=0.005)
    notes = compare(slower, "version", unit="robot").result.notes
    assert notes[0] == "A is version=2.9: 30 runs, 15 by robot"
    assert any("by robot, 15 on both sides" in note for note in notes)


def test_an_interval_is_that_of_yuen(tmp_path: Path) -> None:
    """Ten runs each: two of either end are left out, and Student's t has 2 (6 - 1) degrees."""
    logs = [0.001 * n * n for n in range(10)]
    values = [math.exp(x) for x in logs]
    lake = fill(tmp_path, version("1", values) + version("2", [1.05 * v for v in values]))
    winsorized = [max(logs[2], min(logs[7], x)) for x in logs]
    error = statistics.variance(winsorized) * 9 / (6 * 5)
    t = 2.2281389
    row = rows_of(lake)["median"]
    centre = statistics.fmean(logs[2:8])
    assert row["a_ns"] == pytest.approx(1e6 * math.exp(centre), abs=2)
    off = t * math.sqrt(2 * error)
    assert row["low_percent"] == pytest.approx(100 * (1.05 * math.exp(-off) - 1), abs=2e-3)
    assert row["high_percent"] == pytest.approx(100 * (1.05 * math.exp(off) - 1), abs=2e-3)
    wider = rows_of(lake, confidence=0.99)["median"]
    off = 3.1692727 * math.sqrt(2 * error)
    assert wider["high_percent"] == pytest.approx(100 * (1.05 * math.exp(off) - 1), abs=5e-3)


def test_paths_of_one_side_are_said(tmp_path: Path) -> None:
    runs = version("1", spread(1.0, 6)) + version("2", spread(1.0, LEAST_RUNS))
    for labels, medians in runs:
        medians[f"/only/{labels['version']}"] = 2.0
    comparison = compare(fill(tmp_path, runs), "version")
    rows = comparison.result.to_arrow().to_pylist()
    verdicts = {row["subject"]: row["verdict"] for row in rows if row["statistic"] == "median"}
    assert verdicts == {
        PATH: "no difference shown", "/only/1": "only in A", "/only/2": "only in B",
    }  # fmt: skip
    assert "1 path with values only in A" in comparison.result.notes
    (failure,) = comparison.failures(["median>50%"])
    assert (failure.subject, failure.reason) == ("/only/1", "has no value in B")


def of_flows(flows: Mapping[tuple[str, str, str], Sequence[int]]) -> list[dict[str, Any]]:
    """Return the comparison of latencies by side, path and run."""
    import duckdb

    rows = [
        {"side": side, "path": path, "run": f"{side}{run}", "latency_ns": latency}
        for (side, path, run), latencies in flows.items()
        for latency in latencies
    ]
    with duckdb.connect() as con:
        con.register("given", pa.Table.from_pylist(rows))
        con.execute(
            "CREATE TABLE flow AS SELECT *, 'reached' AS status, false AS is_loss_affected,"
            " false AS is_ambiguous, true AS is_first, true AS is_last, true AS is_newest"
            " FROM given"
        )
        con.execute("CREATE TABLE e2e_latency AS SELECT DISTINCT run, false AS is_cut FROM given")
        con.execute("CREATE TABLE sided AS SELECT DISTINCT run, side, run AS unit FROM given")
        return compared(con).to_arrow().to_pylist()


@pytest.mark.parametrize(
    ("long", "short", "counted", "told_of"),
    [
        # Most runs are long enough for p95: the others say nothing of the median, either.
        (10, 8, 10, ("median", "mean", "p95")),
        (9, 9, 9, ("median", "mean", "p95")),
        # Else they count, and nothing is said of p95.
        (8, 9, 17, ("median", "mean")),
        (5, 4, 9, ("median", "mean")),
    ],
)
def test_all_statistics_are_of_the_same_runs(
    long: int, short: int, counted: int, told_of: tuple[str, ...]
) -> None:
    """Short runs are five times as slow; p95 of the long ones alone was below their median."""
    flows = {}
    for side in "ab":
        for run in range(long + short):
            values = [round(1_000 * part * (1 + run / 1_000)) for part in SHAPE]
            is_long = run < long
            flows[side, PATH, str(run)] = values if is_long else [5 * v for v in values[35:65]]
    rows = {row["statistic"]: row for row in of_flows(flows)}
    assert {(row["a_count"], row["b_count"]) for row in rows.values()} == {(counted, counted)}
    assert tuple(name for name, row in rows.items() if row["low_ns"] is not None) == told_of
    assert rows["p95"]["verdict"] in ("no difference shown", "too few values")
    assert rows["median"]["a_ns"] < rows["p95"]["a_ns"] < rows["max"]["a_ns"]
    assert rows["p99"]["verdict"] == "too few values"


def test_short_runs_count_where_a_side_has_no_others() -> None:
    values = [round(1_000 * part) for part in SHAPE]
    flows = {("a", PATH, str(run)): values[:3] for run in range(8)}
    flows |= {("b", PATH, str(run)): values[: 25 if run < 6 else 3] for run in range(8)}
    for row in of_flows(flows):
        assert (row["a_count"], row["b_count"], row["low_ns"]) == (8, 6, None)


def test_no_quantile_is_below_a_smaller_one() -> None:
    """Whatever runs there are: short, slow, or with clocks apart."""
    import random

    source, flows = random.Random(1), {}
    for path in range(60):
        for side in "ab":
            for run in range(source.randrange(1, 14)):
                middle = source.choice([-500, 10, 1_000, 1_000, 1_100, 50_000])
                spread = source.choice([1, 400, 5_000])
                count = source.choice([3, 25, 120, 120, 600])
                flows[side, f"/{path}", f"{run} {path}"] = [
                    middle + round(source.gauss(0, spread)) for _ in range(count)
                ]
    found: dict[str, dict[str, Any]] = {}
    for row in of_flows(flows):
        found.setdefault(row["subject"], {})[row["statistic"]] = row
    told = 0
    for rows in found.values():
        for side in ("a_ns", "b_ns"):
            values = [rows[name][side] for name in ("median", "p95", "p99", "max")]
            assert values == sorted(values)
        told += sum(row["low_ns"] is not None for row in rows.values())
    assert told > 20


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--by", "versoin"], "no run of the lake has such a label — versoin"),
        (["--by", "robot"], "two values of robot are compared, the runs have 15: r0 (4), r1 (4)"),
        (["--by", "version", "3"], "two values of version are compared, the runs have 2"),
        (["--by", "version", "2.9", "3"], "no run has version=3"),
        (["--by", "version", "2.9", "2.9"], "both sides are the same"),
        (["--by", "version", "--unit", "site"], "has such a label — site"),
        (["--by", "version", "--confidence", "1"], "the confidence lies between 0 and 1"),
        (["--by", "version", "--case", "second"], "there is no such case"),
        (["--by", "version", "--fail-on", "p95"], "cannot read the condition"),
        (["--by", "version", "--where", "robot = 'x'"], "none of the 61 runs"),
    ],
)
def test_what_makes_no_sense_is_a_usage_error(
    slower: Lake, arguments: list[str], words: str
) -> None:
    result = run(slower, *arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert not result.stdout


@pytest.mark.thorough
def test_the_other_of_two_values_need_not_be_named(slower: Lake) -> None:
    given = ("--by", "version", "--format", "json")
    both = run(slower, "2.10", "2.9", *given)
    assert both.exit_code == 0, both.stderr
    assert run(slower, "2.10", *given).stdout == both.stdout
    assert run(slower, *given).stdout != both.stdout


def test_nothing_in_common_is_an_error(tmp_path: Path) -> None:
    runs = version("1", spread(1.0, 6))
    other = [({"version": "2"}, {"/another": 1.0})] * 6
    with pytest.raises(UsageError, match="no path with latencies in common"):
        compare(fill(tmp_path, [*runs, *other]), "version")


def test_the_command_is_a_gate(slower: Lake) -> None:
    given = ("--by", "version", "--format", "json")
    passed = run(slower, *given, "--fail-on", "median>6%")
    assert passed.exit_code == 0, passed.stderr
    assert len(json.loads(passed.stdout)) == 5
    failed = run(slower, *given, "--fail-on", "median>4%", "--all")
    assert failed.exit_code == 1
    assert [row["change"] for row in json.loads(failed.stdout)] == ["longer"]
    assert "error: median>4%: 5 % more" in failed.stderr
    assert failed.stderr.rstrip().endswith(PATH)


@pytest.mark.thorough
def test_a_run_is_chosen_by_its_labels(slower: Lake) -> None:
    result = run(slower, "--by", "version", "--where", "robot < 'r13'", "--format", "csv")
    assert "A is version=2.9: 10 runs" in result.stderr, result.stderr


def test_students_t_is_close_where_runs_are_few() -> None:
    """The expansion against tables, at the fewest runs and degrees of freedom that there can be."""
    import duckdb

    # One side alike in all runs: the degrees of freedom are those of the other, 4 - 1.
    logs = [-0.02, -0.01, -0.004, 0.004, 0.01, 0.02]
    rows = [("a", f"a{n}", math.exp(x) * 1e9) for n, x in enumerate(logs)]
    rows += [("b", f"b{n}", 1e9) for n in range(6)]
    with duckdb.connect() as con:
        con.register("value", pa.Table.from_pylist(
            [dict(zip(("side", "unit", "value_ns"), row, strict=True)) for row in rows]
        ))  # fmt: skip
        con.execute(
            "CREATE TABLE measured AS SELECT side, unit, unit AS run, 'x' AS subject,"
            " 'median' AS statistic, round(value_ns)::BIGINT AS value_ns, true AS is_enough,"
            " 99 AS number, 99 AS roots, 99 AS reached, 0 AS loss_affected, 0 AS ambiguous,"
            " false AS is_cut"
            " FROM value"
        )
        values = {"z": Z95, "least_units": LEAST_RUNS}
        (row,) = internal_sql().run(con, "fleet_comparison", values).to_arrow_table().to_pylist()
    winsorized = [max(logs[1], min(logs[4], x)) for x in logs]
    error = math.sqrt(statistics.variance(winsorized) * 5 / (4 * 3))
    assert math.log(1 + row["high_percent"] / 100) / error == pytest.approx(3.182446, rel=0.003)


@pytest.mark.parametrize(
    ("number", "told_of"),
    [
        (19, ()),
        (20, ("median", "mean", "max")),
        (99, ("median", "mean", "max")),
        (100, ("median", "mean", "p95", "max")),
        (499, ("median", "mean", "p95", "max")),
        (500, ("median", "mean", "p95", "p99", "max")),
    ],
)
def test_five_values_of_a_run_beyond_a_quantile_are_enough(
    number: int, told_of: tuple[str, ...]
) -> None:
    import duckdb

    with duckdb.connect() as con:
        con.execute(
            "CREATE TABLE flow AS SELECT 'r' AS run, '/a' AS path, 'reached' AS status, "
            "false AS is_loss_affected, false AS is_ambiguous, true AS is_first, "
            "true AS is_last, true AS is_newest, "
            "n AS latency_ns FROM range(?) AS r(n)",
            [number],
        )
        con.execute("CREATE TABLE e2e_latency AS SELECT 'r' AS run, false AS is_cut")
        con.execute("CREATE TABLE sided AS SELECT 'r' AS run, 'a' AS side, 'u' AS unit")
        told = internal_sql().run(con, "fleet_run_value", {"case": "every_pair"}).to_arrow_table()
    enough = [row["statistic"] for row in told.to_pylist() if row["is_enough"]]
    assert enough == list(told_of)
