"""Comparing two runs: intervals and effect sizes mean what they say, conditions are exact."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.golden import BASE, FLOW, fill_case, insert
from support.thorough import thorough

import msgflow
from msgflow.db.derivation import derive_table
from msgflow.errors import UsageError
from msgflow.query.differences import parse_conditions

CASES = Path(__file__).parents[1] / "schema" / "cases" / "main.comparison"
CALLBACKS = 40
VALUES = 120
MEDIAN_NS = 1_000_000


def _fill(
    path: Path, *, shift_ns: int, callbacks: int = CALLBACKS, values: int = VALUES, held: int = 1
) -> None:
    """Two runs of callbacks; durations of the second one are longer by `shift_ns`.

    Args:
        path: the database.
        shift_ns: by how much.
        callbacks: how many.
        values: durations of each.
        held: how many durations of a callback are equal before it takes another one.
    """
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
            numbers = [str(run * 1000 + number) for number in range(callbacks)]
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
                    range(12), lambda k: hash(c.callback_id, n.n // $held, k) % 100_001
                ))::BIGINT - 600_000 AS end_ns
            )
            FROM store.callback_instance AS t
            CROSS JOIN store.callback AS c
            CROSS JOIN range(1, $values + 1) AS n (n)
            """,
            {"median": MEDIAN_NS, "shift": shift_ns, "values": values, "held": held},
        )
        connection.execute("DELETE FROM store.callback_instance WHERE callback_instance_id = 0")


@pytest.fixture(scope="module")
def alike(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs that do not differ, of all callbacks; read it only."""
    path = tmp_path_factory.mktemp("alike") / "msgflow.duckdb"
    shutil.copyfile(empty_database, path)
    _fill(path, shift_ns=0)
    return path


@pytest.fixture(scope="module")
def compared(alike: Path) -> list[dict[str, Any]]:
    """The comparison of these."""
    with msgflow.open_db(alike) as database:
        return _rows(database, "after", resamples=400)


def _rows(database: msgflow.Database, run_b: str, **options: Any) -> list[dict[str, Any]]:
    comparison = database.compare("before", run_b, what="callbacks", **options)
    return comparison.result.to_arrow().to_pylist()


@pytest.mark.thorough
def test_what_is_equal_is_rarely_called_different(compared: list[dict[str, Any]]) -> None:
    assert len(compared) == 5 * CALLBACKS
    for statistic in ("median", "mean"):
        verdicts = [row["verdict"] for row in compared if row["statistic"] == statistic]
        wrong = sum(verdict != "no difference shown" for verdict in verdicts)
        # 5 % of 40 are expected; more than 8 have a probability of less than 0.1 %.
        assert wrong <= 8, verdicts
        assert all(verdict != "too few values" for verdict in verdicts)
    assert {row["verdict"] for row in compared if row["statistic"] == "p99"} == {"too few values"}
    assert {row["verdict"] for row in compared if row["statistic"] == "max"} == {"not estimated"}


@pytest.mark.thorough
def test_a_difference_is_found_and_lies_in_its_interval(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=100_000)
    with msgflow.open_db(fresh_database) as database:
        rows = _rows(database, "after", resamples=400)
        reverse = database.compare("after", "before", what="callbacks", resamples=0)
    for statistic in ("median", "mean"):
        own = [row for row in rows if row["statistic"] == statistic]
        assert all(row["verdict"] == "B is longer" for row in own)
        assert sum(row["low_ns"] <= 100_000 <= row["high_ns"] for row in own) >= CALLBACKS - 8
    mirrored = reverse.result.to_arrow().to_pylist()
    for row, other in zip(rows, mirrored, strict=True):
        assert other["difference_ns"] == -row["difference_ns"]


def _check_width(rows: list[dict[str, Any]], values: int) -> None:
    widths = [row["high_ns"] - row["low_ns"] for row in rows if row["statistic"] == "mean"]
    expected = 2 * 1.96 * 100_000 * (2 / values) ** 0.5
    # Wider, if anything: how much blocks vary is estimated from few of them.
    assert 0.98 * expected <= sum(widths) / len(widths) <= 1.18 * expected


@pytest.mark.thorough
def test_an_interval_of_a_mean_is_as_wide_as_theory_says(compared: list[dict[str, Any]]) -> None:
    _check_width(compared, VALUES)


@pytest.mark.thorough
def test_also_of_more_than_1000_values_which_are_not_drawn_at_once(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0, callbacks=2, values=2_000)
    with msgflow.open_db(fresh_database) as database:
        _check_width(_rows(database, "after", resamples=400), 2_000)


def test_each_statistic_is_of_the_values_and_in_its_interval(fresh_database: Path) -> None:
    """All durations from 1 to 1000 us in no order, and others that are nearly equal."""
    count = 1_000
    _fill(fresh_database, shift_ns=0, callbacks=1, values=count)
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute(
            "UPDATE store.callback_instance SET end_ns = start_ns + CASE run_id "
            "WHEN 1 THEN ((start_ns // 10000000) * 7919 % $count + 1) * 1000 "
            "ELSE 10000000 + (start_ns // 10000000) * 7919 % 10 END",
            {"count": count},
        )
    with msgflow.open_db(fresh_database) as database:
        rows = {row["statistic"]: row for row in _rows(database, "after", resamples=400)}
    values = {name: row["a_ns"] for name, row in rows.items()}
    assert values == {
        "median": 500_000,
        "mean": 500_500,
        "p95": 950_000,
        "p99": 990_000,
        "max": 1_000_000,
    }
    for name in ("median", "mean", "p95", "p99"):
        row = rows[name]
        assert row["b_ns"] == pytest.approx(10_000_004, abs=6)
        # B has no spread to speak of. Values as quantiles vary in A: in so many resamples they do
        # to either side, and by less than four standard deviations.
        share = {"median": 0.5, "p95": 0.95, "p99": 0.99}.get(name)
        deviation = 0.289 if share is None else (share * (1 - share)) ** 0.5
        spread = 4 * deviation * 1_000_000 / count**0.5
        assert row["difference_ns"] - spread < row["low_ns"] < row["difference_ns"], name
        assert row["difference_ns"] < row["high_ns"] < row["difference_ns"] + spread, name
    assert rows["max"]["low_ns"] is None


@pytest.mark.thorough
def test_five_values_beyond_a_quantile_are_enough(fresh_database: Path) -> None:
    """Each callback has as many values as one statistic needs; then one less in run B."""
    enough = {"/n · Timer(1 ms)": 20, "/n · Timer(2 ms)": 100, "/n · Timer(3 ms)": 500}
    needed = {"median": 20, "mean": 20, "p95": 100, "p99": 500}

    def verdicts() -> set[tuple[str, str]]:
        """(subject, statistic) of what has values enough."""
        with msgflow.open_db(fresh_database) as database:
            return {
                (row["subject"], row["statistic"])
                for row in _rows(database, "after", resamples=400)
                if row["statistic"] in needed and row["verdict"] != "too few values"
            }

    def without(values: int) -> str:
        return (
            f"DELETE FROM store.callback_instance WHERE start_ns // 10_000_000 >= {values} "
            "+ CASE callback_id % 1000 WHEN 0 THEN 20 WHEN 1 THEN 100 ELSE 500 END"
        )

    _fill(fresh_database, shift_ns=0, callbacks=len(enough), values=max(enough.values()))
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute(without(1))
    assert verdicts() == {
        (subject, statistic)
        for subject, count in enough.items()
        for statistic, least in needed.items()
        if count >= least
    }
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute(f"{without(0)} AND run_id = 2")
    assert verdicts() == {
        (subject, statistic)
        for subject, count in enough.items()
        for statistic, least in needed.items()
        if count > least
    }


@pytest.mark.thorough
def test_values_that_are_held_count_once(fresh_database: Path) -> None:
    """Of 1280 durations, 64 are independent, whose means differ by more than those of 1280."""
    _fill(fresh_database, shift_ns=0, callbacks=16, values=1_280, held=20)
    with msgflow.open_db(fresh_database) as database:
        rows = _rows(database, "after", resamples=400)
    for statistic in ("median", "mean"):
        own = [row for row in rows if row["statistic"] == statistic]
        wrong = sum(row["verdict"] in ("B is longer", "B is shorter") for row in own)
        # At most one is expected. With intervals as of independent values, 10 would be.
        assert wrong <= 4, own
        assert sum(row["verdict"] == "no difference shown" for row in own) >= 11
        worth = sorted(row["a_independent"] for row in own if row["a_independent"] is not None)
        assert 45 <= worth[len(worth) // 2] <= 90
    widths = [
        row["high_ns"] - row["low_ns"]
        for row in rows
        if row["statistic"] == "mean" and row["low_ns"] is not None
    ]
    expected = 2 * 1.96 * 100_000 * (2 / 64) ** 0.5
    assert sum(widths) / len(widths) == pytest.approx(expected, rel=0.2)


def test_each_statistic_is_worth_what_lies_beyond_it(fresh_database: Path) -> None:
    """Every third value is longer, every 25th much longer, and longest are four in a row."""
    _fill(fresh_database, shift_ns=0, callbacks=1, values=400)
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute(
            "UPDATE store.callback_instance SET end_ns = start_ns + CASE "
            "WHEN start_ns // 10_000_000 BETWEEN 201 AND 204 THEN 3000 "
            "WHEN start_ns // 10_000_000 % 25 = 0 THEN 2000 "
            "ELSE 1000 + start_ns // 10_000_000 % 3 // 2 END"
        )
    with msgflow.open_db(fresh_database) as database:
        rows = _rows(database, "after", resamples=400)
        worth = {row["statistic"]: row["a_independent"] for row in rows}
    assert worth["p99"] < worth["p95"] < worth["median"], worth


def test_what_is_alike_all_along_has_no_interval(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=1_000_000, callbacks=10, values=320, held=80)
    with msgflow.open_db(fresh_database) as database:
        found = database.compare("before", "after", what="callbacks", resamples=400).result
    assert any(note.startswith("values that follow each other are alike") for note in found.notes)
    for row in found.to_arrow().to_pylist():
        if row["statistic"] in ("median", "mean"):
            assert row["verdict"] == "too few independent values"
            assert (row["low_ns"], row["high_ns"]) == (None, None)


@pytest.mark.thorough
def test_too_few_resamples_have_no_interval(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=100_000, callbacks=1)
    with msgflow.open_db(fresh_database) as database:
        with pytest.raises(UsageError, match="so few resamples — 399"):
            _rows(database, "after", resamples=399)
        with pytest.raises(UsageError, match="so few resamples — 1000"):
            _rows(database, "after", resamples=1_000, confidence=0.99)
        (row, *_) = _rows(database, "after", confidence=0.99)
        assert row["verdict"] == "B is longer"
        with pytest.raises(UsageError, match="so few resamples — -1"):
            _rows(database, "after", resamples=-1)
        (none, *_) = _rows(database, "after", resamples=0)
        assert (none["verdict"], none["low_ns"]) == ("too few resamples", None)
        assert (none["a_ns"], none["b_ns"]) == (row["a_ns"], row["b_ns"])
        text = "SELECT verdict, low_ns, high_ns FROM comparison('callbacks', 1, 2, resamples := 1)"
        assert database.sql(text).to_arrow().to_pylist()[0] == {
            "verdict": "too few resamples",
            "low_ns": None,
            "high_ns": None,
        }


@pytest.mark.thorough
def test_a_seed_gives_the_same_intervals_and_another_one_others(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0, callbacks=4)
    with msgflow.open_db(fresh_database) as database:
        rows = _rows(database, "after", resamples=400)
        assert rows == _rows(database, "after", resamples=400)
        assert rows != _rows(database, "after", resamples=400, seed=1)


def test_a_run_does_not_differ_from_itself(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0, callbacks=4)
    with msgflow.open_db(fresh_database) as database:
        rows = _rows(database, "before", resamples=400)
    assert {row["difference_ns"] for row in rows} == {0}


@pytest.mark.thorough
def test_a_verdict_is_of_the_recordings_alone(fresh_database: Path) -> None:
    note = (
        "longer and shorter are said of these two recordings; the same system started again"
        " differs, too"
    )
    _fill(fresh_database, shift_ns=100_000, callbacks=1)
    with msgflow.open_db(fresh_database) as database:
        assert database.compare("before", "after", what="callbacks").result.notes == [note]
        assert database.compare("before", "before", what="callbacks").result.notes == []
        near = database.compare("before", "after", what="callbacks", at_least="50%")
        with pytest.raises(UsageError, match="what matters is a share — much"):
            database.compare("before", "after", at_least="much")
    # As sure as it is, it does not matter.
    assert near.result.table["verdict"][0].as_py() == "about equal"
    assert near.result.table["low_ns"][0].as_py() > 0
    assert near.changes().when_empty.endswith("1 compared, 1 with about equal: --all lists them")


@pytest.mark.parametrize(
    ("waited", "said"),
    [
        ("preempted_ns", "300.000 µs more waiting for a CPU"),
        thorough("running_ns", "300.000 µs more CPU time"),
        thorough("sleeping_ns", "300.000 µs more sleeping or blocked"),
    ],
)
def test_longer_callbacks_computed_or_waited(fresh_database: Path, waited: str, said: str) -> None:
    _fill(fresh_database, shift_ns=300_000, callbacks=1)
    parts = ("running_ns", "preempted_ns", "runnable_ns", "sleeping_ns", "uninterruptible_ns")
    longer = "CASE run_id WHEN 2 THEN 300_000 ELSE 0 END"
    values = ", ".join(f"{longer if part == waited else 0} AS {part}" for part in parts)
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute(
            f"INSERT INTO store.callback_schedule BY NAME SELECT run_id, callback_instance_id, "
            f"{values}, 0 AS unknown_ns, 0 AS preemption_count, 0 AS migration_count, "
            "false AS is_loss_affected FROM store.callback_instance"
        )
    with msgflow.open_db(fresh_database) as database:
        notes = database.compare("before", "after", what="callbacks").result.notes
    told = [note for note in notes if note.startswith("/n · ")]
    assert len(told) == 1
    assert told[0].endswith(said)


def test_functions_that_computed_longer_are_named(fresh_database: Path) -> None:
    """Only where both runs have samples."""
    _fill(fresh_database, shift_ns=0, callbacks=1)
    told = []
    for run_id, samples in ((1, 1), (2, 40)):
        with duckdb.connect(str(fresh_database)) as connection:
            connection.execute(
                f"INSERT INTO store.stack_frame VALUES ({run_id}, {run_id}, 'hog', '/lib/hog.so');"
                f"INSERT INTO store.stack VALUES ({run_id}, {run_id}, {run_id}, 1);"
                "INSERT INTO store.stack_sample BY NAME SELECT run_id, process_id, 1 AS tid,"
                " start_ns AS at_ns, callback_instance_id, run_id AS stack_id, 10**6 AS cpu_ns"
                f" FROM store.callback_instance, range({samples}) WHERE run_id = {run_id}"
            )
        with msgflow.open_db(fresh_database) as database:
            notes = database.compare("before", "after", what="callbacks").result.notes
        told.append([note for note in notes if "hog" in note])
    (note,) = told.pop()
    assert note.startswith("/n · ")
    assert "CPU time per call in hog 1.000 ms → 40.000 ms" in note
    assert told == [[]]


def test_lost_events_are_told(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0, callbacks=2)
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute("UPDATE store.trace SET run_id = 2, discarded_event_count = 30")
        connection.execute(
            "UPDATE store.callback_instance SET is_loss_affected = true"
            " WHERE run_id = 2 AND start_ns < 60_000_000"
        )
    with msgflow.open_db(fresh_database) as database:
        comparison = database.compare("before", "after", what="callbacks")
    (row, *_) = comparison.result.to_arrow().to_pylist()
    assert (row["a_loss_affected"], row["b_loss_affected"]) == (0, 5)
    assert (
        "run B, after (2), lost 30 events: 10 of its callback instances have a gap in their time,"
        " others may be missing altogether"
    ) in comparison.result.notes


def test_less_that_arrives_fails(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0, callbacks=2)
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute(
            "UPDATE store.callback_instance SET end_ns = NULL"
            " WHERE callback_id = 2000 AND start_ns <= 60_000_000"
        )
    with msgflow.open_db(fresh_database) as database:
        comparison = database.compare("before", "after", what="callbacks")
    assert comparison.failures(["share<-5%"]) == []
    (failure,) = comparison.failures(["share < -4.9%"])
    assert (failure.subject, failure.reason) == (
        "/n · Timer(1 ms)",
        "5 points less (100 % to 95 %)",
    )
    reverse = comparison.failures(["share<-0%", "median>100%"])
    assert len(reverse) == 1


@pytest.mark.thorough
def test_percentages_of_what_is_not_positive(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=-7_000, callbacks=1)
    with msgflow.open_db(fresh_database) as database:
        assert database.compare("before", "after", what="callbacks").failures(["mean>0%"]) == []
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute(
            "UPDATE store.callback_instance SET end_ns = start_ns - (callback_id = 2000)::BIGINT"
        )
    with msgflow.open_db(fresh_database) as database:
        shorter = database.compare("before", "after", what="callbacks")
        longer = database.compare("after", "before", what="callbacks")
    assert shorter.failures(["mean>0%"]) == []
    assert longer.failures(["mean>0.5ns"])[0].reason == "1e-06 ms more"
    with pytest.raises(UsageError, match="no percentage can be told of -1e-06 ms") as raised:
        longer.failures(["mean>0%"])
    assert "clocks apply" in str(raised.value.hint)


@pytest.mark.thorough
def test_nothing_holds_of_paths_that_were_left_out(fresh_database: Path) -> None:
    with duckdb.connect(str(fresh_database)) as connection:
        fill_case(connection, CASES / "many_paths.case")
    with msgflow.open_db(fresh_database) as database:
        whole = database.compare(1, 2)
        cut = database.compare(1, 2, max_paths=1)
        short = database.compare(1, 2, max_depth=1)
        with pytest.raises(UsageError, match="--max-paths is at least 1 — 0"):
            database.compare(1, 2, max_paths=0)
    note = (
        "paths beyond the limits are left out; --max-paths and --max-depth raise them, --from and"
        " --to choose"
    )
    assert note not in whole.result.notes
    assert whole.failures(["median>5%"]) == []
    for limited in (cut, short):
        assert note in limited.result.notes
        assert limited.failures([]) == []
        with pytest.raises(UsageError, match="not all paths were compared"):
            limited.failures(["median>5%"])


def test_what_exceeds_a_condition_fails(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=50_000, callbacks=4)
    with msgflow.open_db(fresh_database) as database:
        comparison = database.compare("before", "after", what="callbacks", resamples=400)
        # All medians rise by about 5 %, hence none by 50 %, and all by more than 0.1 µs.
        assert comparison.failures(["median>50%"]) == []
        assert comparison.failures([]) == []
        assert len(comparison.failures(["mean > 100us"])) == 0
        failures = comparison.failures(["mean>2%,mean>1us", "mean>0.001ms"])
        assert len(failures) == 3 * 4
        assert {failure.condition for failure in failures} == {
            "mean>2%",
            "mean>1us",
            "mean>0.001ms",
        }
        # Less than what matters by default: the condition decides, and the reason says so.
        assert all(" % more (" in failure.reason for failure in failures[:4])
        assert failures[0].reason.endswith("ms); less than --at-least")


@pytest.mark.thorough
def test_what_is_gone_fails(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0, callbacks=4)
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute("DELETE FROM store.callback_instance WHERE callback_id = 2000")
    with msgflow.open_db(fresh_database) as database:
        comparison = database.compare("before", "after", what="callbacks")
    (failure,) = comparison.failures(["median>1000%"])
    assert (failure.subject, failure.reason) == ("/n · Timer(1 ms)", "has no value in B")
    assert comparison.result.notes[0] == "1 callback with values only in run A, before (1)"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "p95",
        "p95>",
        "p95>5",
        "p95<5%",
        "p50>5%",
        "p95>-5%",
        "p95>5%,",
        "p95>5 hours",
        "share>1%",
        "share<1%",
        "share<-1ms",
        "p95<-1%",
    ],
)
def test_a_condition_that_cannot_be_read_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="cannot read the condition"):
        parse_conditions([text])


def test_conditions_are_read() -> None:
    conditions = parse_conditions([" p95 > 5% ,max>1.5ms", "mean>20µs,share<-1.5 %"])
    assert [(each.statistic, each.allowed, each.is_relative) for each in conditions] == [
        ("p95", 5, True),
        ("max", 1_500_000, False),
        ("mean", 20_000, False),
        ("share", 1.5, True),
    ]


def test_runs_without_anything_in_common_are_refused(alike: Path) -> None:
    with msgflow.open_db(alike) as database:
        with pytest.raises(UsageError, match="no paths with values in common — before"):
            database.compare("before", "after")
        with pytest.raises(UsageError, match="there is no such run — never"):
            database.compare("before", "never")
        with pytest.raises(UsageError, match="a run is on one side — before"):
            database.compare("before", "all")
        with pytest.raises(UsageError, match="--what has no such value — nodes"):
            database.compare("before", "after", what="nodes")
        with pytest.raises(UsageError, match="only paths start and end"):
            database.compare("before", "after", what="topics", from_="/a")
        with pytest.raises(UsageError, match="no such topic or node"):
            database.compare("before", "after", from_="/a")
        with pytest.raises(UsageError, match="confidence"):
            database.compare("before", "after", confidence=95)
        with pytest.raises(UsageError, match="not negative"):
            database.compare("before", "after", skip_first=-1)


def test_a_database_without_runs_says_so(fresh_database: Path) -> None:
    with (
        msgflow.open_db(fresh_database) as database,
        pytest.raises(UsageError, match="holds no run yet"),
    ):
        database.compare(1, 2)


@pytest.mark.thorough
def test_a_start_with_the_longest_values_is_named(fresh_database: Path) -> None:
    _fill(fresh_database, shift_ns=0, callbacks=1)
    with duckdb.connect(str(fresh_database)) as connection:
        # Twenty values until 0.2 s of the second run; an interval of p95 needs a hundred.
        connection.execute(
            "UPDATE store.callback_instance SET end_ns = end_ns + 5000000"
            " WHERE run_id = 2 AND start_ns <= 200_000_000"
        )
    with msgflow.open_db(fresh_database) as database:
        comparison = database.compare("before", "after", what="callbacks")
        reverse = database.compare("after", "before", what="callbacks")
        quick = database.compare("before", "after", what="callbacks", resamples=0)
        later = database.compare("before", "after", what="callbacks", skip_first=0.5)
    # As text a comparison has what it compares.
    assert "Timer(" in str(comparison)
    # In steps of half a second.
    note = (
        "run after (2) may warm up: its longest values lie at its start; --skip-first 0.5 leaves it"
        " out"
    )
    assert [note in each.result.notes for each in (comparison, reverse, quick)] == [True] * 3
    assert note not in later.result.notes
    mean, *_ = (row for row in later.result.to_arrow().to_pylist() if row["statistic"] == "mean")
    assert (mean["a_count"], mean["verdict"]) == (VALUES - 49, "no difference shown")
    assert later.failures(["p95>50%"]) == []
    assert len(comparison.failures(["p95>50%"], even_by_chance=True)) == 1


def _fill_runs(path: Path, latencies: list[int]) -> None:
    """For each latency a run of 20 flows from a timer of /camera; the first six are old."""
    tables: dict[str, list[dict[str, Any]]] = {}

    def add(table: str, **values: str | int | None) -> None:
        texts = {key: None if value is None else str(value) for key, value in values.items()}
        tables.setdefault(table, []).append(texts)

    for name in ("clock", "host", "trace", "process", "thread"):
        tables[name] = [BASE[name]]
    for run, latency in enumerate(latencies, start=1):
        label = f"['version={'new' if run > 6 else 'old'}']"
        add("run", run_id=run, name=f"start{run}", start_ns=0, labels=label)
        add("node", node_id=2 * run, run_id=run, full_name="/camera")
        add("node", node_id=2 * run + 1, run_id=run, full_name="/viewer")
        add("timer", timer_id=run, run_id=run, node_id=2 * run, period_ns=1_000_000)
        add("publisher", publisher_id=run, run_id=run, node_id=2 * run, topic_name="/image")
        add(
            "subscription",
            subscription_id=run,
            run_id=run,
            node_id=2 * run + 1,
            topic_name="/image",
        )
        add(
            "callback",
            callback_id=2 * run,
            run_id=run,
            node_id=2 * run,
            kind="timer",
            timer_id=run,
            subscription_id=None,
        )
        add(
            "callback",
            callback_id=2 * run + 1,
            run_id=run,
            node_id=2 * run + 1,
            kind="subscription",
            timer_id=None,
            subscription_id=run,
        )
        for flow in range(20):
            one, start = 100 * run + flow, 10_000_000 * (flow + 1)
            add(
                "callback_instance",
                callback_instance_id=2 * one,
                run_id=run,
                callback_id=2 * run,
                start_ns=start,
                end_ns=start + 20,
                take_id=None,
                depth=1,
            )
            add(
                "publication",
                publication_id=one,
                run_id=run,
                publisher_id=run,
                start_ns=start + 5,
                end_ns=start + 10,
            )
            add(
                "link_causal",
                run_id=run,
                callback_instance_id=2 * one,
                publication_id=one,
                publisher_id=run,
                kind="direct",
            )
            add(
                "take",
                take_id=one,
                run_id=run,
                subscription_id=run,
                taken_ns=start + 30,
                method="rmw",
            )
            add(
                "link_transport",
                run_id=run,
                publication_id=one,
                take_id=one,
                publisher_id=run,
                subscription_id=run,
                method="exact",
            )
            add(
                "callback_instance",
                callback_instance_id=2 * one + 1,
                run_id=run,
                callback_id=2 * run + 1,
                start_ns=start + 40,
                end_ns=start + latency + flow,
                take_id=one,
                depth=1,
            )
    with duckdb.connect(str(path)) as connection:
        for name, rows in tables.items():
            insert(connection, name, list(rows[0]), [list(row.values()) for row in rows])
        for run in range(1, len(latencies) + 1):
            for name in FLOW:
                derive_table(connection, name, run)


def test_a_run_of_several_on_a_side_is_one_value(fresh_database: Path) -> None:
    old, new = [1000, 1010, 1020, 1005, 1015, 1025], [1300, 1310, 1320, 1305, 1315, 1325]
    _fill_runs(fresh_database, old + new)
    with msgflow.open_db(fresh_database) as database:
        found = database.compare("version=old", "version=new")
        (path,) = found.changes().to_arrow().to_pylist()
        few = database.compare("start1,2", "start7,start8")
        with pytest.raises(UsageError, match="is on one side"):
            database.compare("version=old", "start1")
        for refused in ({"what": "topics"}, {"explain": True}):
            with pytest.raises(UsageError, match="paths of several runs"):
                database.compare("version=old", "version=new", **refused)
        without = database.compare("version=old", "version=new", skip_first=0.155)
    assert (path["change"], path["path"]) == ("longer", "/camera → /image → /viewer")
    # The mean without the lowest and the highest run of the medians.
    assert (path["a_median_ns"], path["b_median_ns"], path["a_count"]) == (1021, 1321, 6)
    assert "A is 2 runs: start1 (1), start2 (2)" in few.result.notes
    assert any("one has 2" in note for note in few.result.notes)
    rows = few.result.to_arrow().to_pylist()
    assert {row["verdict"] for row in rows} == {"too few runs", "not estimated"}
    assert [row["a_ns"] for row in rows if row["statistic"] == "median"] == [1014]
    assert few.failures(["median>20%"]) == []
    (failure,) = few.failures(["median>20%"], even_by_chance=True)
    assert failure.reason == (
        "29.59 % more (0.001014 ms to 0.001314 ms); too few runs to exclude chance"
    )
    assert {row["a_flows"] for row in without.result.to_arrow().to_pylist()} == {6 * 5}
