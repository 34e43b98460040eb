"""msgflow compare: what is printed, and when the exit code is 1."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from support.golden import fill_case
from typer.testing import Result

Msgflow = Callable[..., Result]
CASES = Path(__file__).parents[1] / "schema" / "cases" / "main.comparison"


@pytest.fixture(scope="module")
def database(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs: before (1) with latencies of 300 and 500 ns, after (2) with 300 and 400 ns."""
    path = Path(shutil.copy(empty_database, tmp_path_factory.mktemp("compare") / "msgflow.duckdb"))
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, CASES / "paths.case")
    return path


def test_a_table_and_the_runs(msgflow: Msgflow, database: Path) -> None:
    result = msgflow("compare", "before", "2", "--db", database)
    assert result.exit_code == 0
    assert "runs: before (1), after (2)" in result.stderr
    shown = dict(line.split(maxsplit=1) for line in result.stdout.splitlines() if line)
    assert (shown["a_median"], shown["b_median"]) == ("300 ns", "300 ns")
    assert shown["change"] == "too few values"
    assert max(map(len, result.stdout.splitlines())) <= 100
    wide = msgflow("compare", "before", "2", "--wide", "--db", database)
    header, _, *rows = wide.stdout.splitlines()
    assert header.split()[:4] == ["statistic", "a", "b", "difference"]
    assert [row.split()[0] for row in rows] == ["median", "mean", "p95", "p99", "max"]
    assert "-100 ns" in rows[-1]


@pytest.mark.thorough
def test_a_change_is_the_sum_of_those_of_its_parts(msgflow: Msgflow, database: Path) -> None:
    result = msgflow("compare", 1, 2, "--explain", "--format", "json", "--db", database)
    whole, *parts = json.loads(result.stdout)
    assert (whole["part"], whole["difference_ns"], whole["a_mean_ns"]) == ("all", -50, 400)
    assert sum(part["difference_ns"] for part in parts) == -50
    sizes = [abs(part["difference_ns"]) for part in parts]
    assert sizes == sorted(sizes, reverse=True)
    wrong = msgflow("compare", 1, 2, "--explain", "--what", "topics", "--db", database)
    assert wrong.exit_code == 2


def test_json_is_exact(msgflow: Msgflow, database: Path) -> None:
    result = msgflow("compare", 1, 2, "--format", "json", "--db", database)
    rows = {row["statistic"]: row for row in json.loads(result.stdout)}
    assert (rows["mean"]["a_ns"], rows["mean"]["b_ns"]) == (400, 350)
    assert rows["mean"]["subject"] == "/camera → /image → /viewer"
    assert rows["mean"]["b_share"] == 0.6667


def test_two_times_of_one_run(msgflow: Msgflow, database: Path) -> None:
    windows = ("--window", "0..1500ns", "--window", "1500ns..")
    result = msgflow("compare", "--run", "before", *windows, "--format", "json", "--db", database)
    (median, *_) = json.loads(result.stdout)
    names = ("a_ns", "b_ns", "a_count", "b_count")
    assert tuple(median[name] for name in names) == (300, 500, 1, 1)
    assert "A is 0..1500ns of run before (1)" in result.stderr
    for wrong in (("before",), ("--run", "before"), ("1", "2", *windows[:2]), windows[:2]):
        assert msgflow("compare", *wrong, "--db", database).exit_code == 2


def test_the_exit_code_tells_whether_a_condition_holds(msgflow: Msgflow, database: Path) -> None:
    assert msgflow("compare", 1, 2, "--fail-on", "p95>5%", "--db", database).exit_code == 0
    conditions = ("compare", 2, 1, "--fail-on", "median>1%,p95>5%", "--db", database)
    chance = msgflow(*conditions)
    assert chance.exit_code == 0
    assert "1 difference beyond a limit may be chance: --even-by-chance counts" in chance.stderr
    worse = msgflow(*conditions, "--even-by-chance")
    assert worse.exit_code == 1
    assert worse.stdout
    errors = [line for line in worse.stderr.splitlines() if line.startswith("error: ")]
    assert errors == [
        "error: p95>5%: 25 % more (0.0004 ms to 0.0005 ms); too few values to exclude chance"
        " — /camera → /image → /viewer"
    ]


@pytest.mark.thorough
def test_every_kind_of_thing(msgflow: Msgflow, database: Path) -> None:
    topics = msgflow("compare", 1, 2, "--what", "topics", "--format", "csv", "--db", database)
    assert '"/image → /viewer"' in topics.stdout
    case = msgflow("compare", 1, 2, "--case", "last", "--from", "/image", "--db", database)
    assert case.exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("1", "2", "--fail-on", "p95"), "cannot read the condition — p95"),
        (("1", "3"), "there is no such run — 3"),
        (("1", "2", "--what", "callbacks"), "the runs have no callbacks with values in common"),
        (("1", "2", "--skip-first", "100"), "the runs have no paths with values in common"),
        (("1",), "a comparison is of two runs, or of two times of one"),
    ],
)
def test_what_makes_no_sense_is_a_usage_error(
    msgflow: Msgflow, database: Path, arguments: tuple[str, ...], error: str
) -> None:
    result = msgflow("compare", *arguments, "--db", database)
    assert result.exit_code == 2
    assert f"error: {error}" in result.stderr
    assert not result.stdout
