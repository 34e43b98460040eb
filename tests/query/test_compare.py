"""Comparing two runs: intervals and effect sizes mean what they say, conditions are exact."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import duckdb
import pytest
from golden import BASE, insert

import msgflow
from msgflow.errors import UsageError
from msgflow.query.compare import parse_conditions

CALLBACKS = 40
VALUES = 120
MEDIAN_NS = 1_000_000


def _fill(path: Path, *, shift_ns: int) -> None:
    """Two runs of CALLBACKS callbacks; durations of the second one are longer by `shift_ns`."""
    with duckdb.connect(str(path)) as connection:
        for table, row in BASE.items():
            if table != "run":
                insert(connection, table, list(row), [list(row.values())])
        insert(
            connection,
            "run",
            ["run_id", "name", "start_ns"],
            [["1", "before", "0"], ["2", "after", "0"]],
        )
        insert(connection, "node", ["node_id", "run_id", "full_name"], [["1", "1", "/n"]])
        for run in (1, 2):
            numbers = [str(run * 1000 + number) for number in range(CALLBACKS)]
            insert(
                connection,
                "timer",
                ["timer_id", "run_id", "period_ns"],
                [[each, str(run), str(1_000_000 * (int(each) % 1000 + 1))] for each in numbers],
            )
            insert(
                connection,
                "callback",
                ["callback_id", "run_id", "node_id", "kind", "timer_id"],
                [[each, str(run), "1", "timer", each] for each in numbers],
            )
        insert(connection, "callback_instance", ["callback_instance_id"], [["0"]])
        # Sums of even numbers, nearly normal, of a standard deviation of 100 µs.
        connection.execute(
            """
            INSERT INTO store.callback_instance
            SELECT t.* REPLACE (
                row_number() OVER () AS callback_instance_id,
                c.run_id AS run_id,
                c.callback_id AS callback_id,
                n.n * 10_000_000 AS start_ns,
                n.n * 10_000_000 + $median + CASE c.run_id WHEN 2 THEN $shift ELSE 0 END
                + list_sum(list_transform(
                    range(12), lambda k: hash(c.callback_id, n.n, k) % 100_001
                ))::BIGINT - 600_000 AS end_ns
            )
            FROM store.callback_instance AS t
            CROSS JOIN store.callback AS c
            CROSS JOIN range(1, $values + 1) AS n (n)
            """,
            {"median": MEDIAN_NS, "shift": shift_ns, "values": VALUES},
        )
        connection.execute("DELETE FROM store.callback_instance WHERE callback_instance_id = 0")


def _rows(database: msgflow.Database, run_b: str, **options: Any) -> list[dict[str, Any]]:
    comparison = database.compare("before", run_b, what="callbacks", **options)
    return comparison.result.to_arrow().to_pylist()


def test_what_is_equal_is_rarely_called_different(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0)
    with msgflow.open_db(fresh_database) as database:
        rows = _rows(database, "after", resamples=300)
    assert len(rows) == 5 * CALLBACKS
    for statistic in ("median", "mean"):
        verdicts = [row["verdict"] for row in rows if row["statistic"] == statistic]
        wrong = sum(verdict != "no difference shown" for verdict in verdicts)
        # 5 % of 40 are expected; more than 8 have a probability of less than 0.1 %.
        assert wrong <= 8, verdicts
        assert all(verdict != "too few values" for verdict in verdicts)
    assert {row["verdict"] for row in rows if row["statistic"] == "p99"} == {"too few values"}
    assert {row["verdict"] for row in rows if row["statistic"] == "max"} == {"not estimated"}


def test_a_difference_is_found_and_lies_in_its_interval(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=100_000)
    with msgflow.open_db(fresh_database) as database:
        rows = _rows(database, "after", resamples=300)
        reverse = database.compare("after", "before", what="callbacks", resamples=300)
    for statistic in ("median", "mean"):
        own = [row for row in rows if row["statistic"] == statistic]
        assert all(row["verdict"] == "B is longer" for row in own)
        assert sum(row["low_ns"] <= 100_000 <= row["high_ns"] for row in own) >= CALLBACKS - 8
        # Two normal distributions one standard deviation apart: 2 Φ(1/√2) - 1.
        deltas = [row["cliffs_delta"] for row in own]
        assert sum(deltas) / len(deltas) == pytest.approx(0.5205, abs=0.03)
    mirrored = reverse.result.to_arrow().to_pylist()
    for row, other in zip(rows, mirrored, strict=True):
        assert other["difference_ns"] == -row["difference_ns"]
        assert other["cliffs_delta"] == -row["cliffs_delta"]


def test_an_interval_of_a_mean_is_as_wide_as_theory_says(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0)
    with msgflow.open_db(fresh_database) as database:
        widths = [
            row["high_ns"] - row["low_ns"]
            for row in _rows(database, "after")
            if row["statistic"] == "mean"
        ]
    expected = 2 * 1.96 * 100_000 * (2 / VALUES) ** 0.5
    assert sum(widths) / len(widths) == pytest.approx(expected, rel=0.1)


def test_a_seed_gives_the_same_intervals_and_another_one_others(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0)
    with msgflow.open_db(fresh_database) as database:
        rows = _rows(database, "after", resamples=50)
        assert rows == _rows(database, "after", resamples=50)
        assert rows != _rows(database, "after", resamples=50, seed=1)


def test_a_run_does_not_differ_from_itself(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0)
    with msgflow.open_db(fresh_database) as database:
        rows = _rows(database, "before", resamples=50)
    assert {(row["difference_ns"], row["cliffs_delta"]) for row in rows} == {(0, 0.0)}


def test_what_exceeds_a_condition_fails(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=50_000)
    with msgflow.open_db(fresh_database) as database:
        comparison = database.compare("before", "after", what="callbacks", resamples=1)
        # All medians rise by about 5 %, hence none by 50 %, and all by more than 0.1 µs.
        assert comparison.failures(["median>50%"]) == []
        assert comparison.failures([]) == []
        assert len(comparison.failures(["mean > 100us"])) == 0
        failures = comparison.failures(["mean>2%,mean>1us", "mean>0.001ms"])
        assert len(failures) == 3 * CALLBACKS
        assert {failure.condition for failure in failures} == {
            "mean>2%",
            "mean>1us",
            "mean>0.001ms",
        }
        assert all(failure.reason.endswith("ms)") for failure in failures[:CALLBACKS])


def test_what_is_gone_fails(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0)
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute("DELETE FROM store.callback_instance WHERE callback_id = 2000")
    with msgflow.open_db(fresh_database) as database:
        comparison = database.compare("before", "after", what="callbacks", resamples=1)
    (failure,) = comparison.failures(["median>1000%"])
    assert (failure.subject, failure.reason) == ("/n · Timer(1 ms)", "has no value in run B")
    assert comparison.result.notes == ["1 callback with values only in run A, before (1)"]


@pytest.mark.parametrize(
    "text", ["", "p95", "p95>", "p95>5", "p95<5%", "p50>5%", "p95>-5%", "p95>5%,", "p95>5 hours"]
)
def test_a_condition_that_cannot_be_read_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="cannot read the condition"):
        parse_conditions([text])


def test_conditions_are_read() -> None:
    conditions = parse_conditions([" p95 > 5% ,max>1.5ms", "mean>20µs"])
    assert [(each.statistic, each.limit, each.is_relative) for each in conditions] == [
        ("p95", 5, True),
        ("max", 1_500_000, False),
        ("mean", 20_000, False),
    ]


def test_runs_without_anything_in_common_are_refused(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0)
    with msgflow.open_db(fresh_database) as database:
        with pytest.raises(UsageError, match="no paths with values in common — before"):
            database.compare("before", "after")
        with pytest.raises(UsageError, match="there is no such run — never"):
            database.compare("before", "never")
        with pytest.raises(UsageError, match="one run is compared with another"):
            database.compare("before", "all")
        with pytest.raises(UsageError, match="no such choice — nodes"):
            database.compare("before", "after", what="nodes")
        with pytest.raises(UsageError, match="only paths start and end"):
            database.compare("before", "after", what="topics", from_="/a")
        with pytest.raises(UsageError, match="no such topic"):
            database.compare("before", "after", from_="/a")
        with pytest.raises(UsageError, match="confidence"):
            database.compare("before", "after", confidence=95)
        with pytest.raises(UsageError, match="at least one resample"):
            database.compare("before", "after", resamples=0)
        with pytest.raises(UsageError, match="not negative"):
            database.compare("before", "after", skip_first=-1)


def test_a_database_without_runs_says_so(fresh_database: Path) -> None:
    with (
        msgflow.open_db(fresh_database) as database,
        pytest.raises(UsageError, match="holds no run yet"),
    ):
        database.compare(1, 2)
