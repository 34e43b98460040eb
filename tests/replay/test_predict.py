"""A replay gives what was recorded, and what the simulator gives for a change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from support.robots import FAST, SINK, sources

import msgflow
from msgflow.errors import UsageError
from msgflow.ingest import ingest
from msgflow.replay.change import Change
from msgflow.replay.predict import Gain, Prediction, Predictor, Spread, gain_of, is_near
from msgflow.run.slice import Slice
from msgflow_sim import (
    Executor,
    Host,
    Node,
    Process,
    Scenario,
    Subscription,
    Work,
)
from msgflow_sim import simulate as simulated

_SLOW = Node("slow", subscriptions=(Subscription("/seldom", work=Work(9_000_000, 2_000_000)),))


def _system(layout: str, kind: str = "single_threaded", *, slow: Node = _SLOW) -> Scenario:
    executors = (Executor(kind, 2 if kind == "multi_threaded" else 1), Executor())
    library = "traced_rclpy" if layout == "rolling" else "rclcpp"
    return Scenario(
        "replayed",
        "Two nodes with one executor.",
        (Host("alpha", cpu_count=16),),
        (
            Process("sources", "alpha", 1101, (sources(10, 23),), client_library=library),
            Process(
                "pair",
                "alpha",
                1201,
                (FAST, slow),
                executors=executors[: 1 + slow.executor],
                client_library=library,
            ),
            Process("sink", "alpha", 1301, (SINK,)),
        ),
        layout=layout,
        overwrites=True,
    )


def _asked(scenario: Scenario, folder: Path, changes: Sequence[Change] = ()) -> list[Prediction]:
    database = folder / "run.duckdb"
    if not database.exists():
        simulated(scenario, folder / "trace", factor=0.3)
        ingest([folder / "trace"], database)
    with msgflow.open_db(database) as opened:
        run = Slice().one_run(opened.connection, "a replay")
        return Predictor(opened.connection, run).predict(changes)


def _of(predictions: Sequence[Prediction], end: str) -> Prediction:
    (found,) = [each for each in predictions if each.path.endswith(end)]
    return found


@pytest.mark.parametrize(
    ("layout", "kind"),
    [
        ("humble", "single_threaded"),
        ("jazzy", "single_threaded"),
        ("jazzy", "multi_threaded"),
        ("jazzy", "events"),
        ("rolling", "single_threaded"),
    ],
)
def test_a_replay_without_a_change_gives_what_was_recorded(layout, kind, tmp_path):
    predictions = _asked(_system(layout, kind), tmp_path)
    assert len(predictions) == 2
    for each in predictions:
        assert each.doubt is None
        assert each.recorded is not None
        assert each.recorded.flows > 50
        assert is_near(each.recorded, each.replayed)
        assert each.predicted == (each.replayed,)


def test_an_executor_of_its_own_is_predicted_as_the_simulator_has_it(tmp_path):
    before = _of(
        _asked(_system("jazzy"), tmp_path, [Change("executor", "/slow", 1)]), "/answer → /sink"
    )
    other = tmp_path / "other"
    other.mkdir()
    after = _of(_asked(_system("jazzy", slow=replace(_SLOW, executor=1)), other), "/answer → /sink")
    assert before.recorded is not None
    assert after.recorded is not None
    assert before.recorded.p95 > 3 * after.recorded.p95
    (predicted,) = before.predicted
    assert predicted.median == pytest.approx(after.recorded.median, rel=0.05)
    assert predicted.p95 == pytest.approx(after.recorded.p95, rel=0.05)


def test_what_a_change_does(tmp_path):
    def changed(*changes: Change) -> tuple[Spread, ...]:
        return _of(_asked(_system("jazzy"), tmp_path, changes), "/answer → /sink").predicted

    (before,) = changed(Change("duration", "/slow", 1))
    (faster,) = changed(Change("duration", "/slow Subscription(/seldom)", 0.5))
    assert faster.p95 < 0.7 * before.p95
    (rarer,) = changed(Change("period", "/sources Timer(10 ms)", 20_000_000))
    assert before.flows / 2 == pytest.approx(rarer.flows, abs=2)
    (later,) = changed(Change("phase", "/sources Timer(23 ms)", 3_000_000))
    assert later != before
    (newest,) = changed(Change("depth", "/often", 1), Change("duration", "/slow", 3))
    (oldest,) = changed(Change("duration", "/slow", 3))
    assert newest.p95 < 0.5 * oldest.p95
    # Callbacks of two nodes do not exclude each other.
    (beside,) = changed(Change("threads", "/slow", 2))
    assert beside.p95 < 0.7 * before.p95


def test_a_busy_executor_makes_it_doubtful(tmp_path):
    slow = Node("slow", subscriptions=(Subscription("/seldom", work=Work(19_000_000, 1_000_000)),))
    predictions = _asked(_system("jazzy", slow=slow), tmp_path)
    assert _of(predictions, "/sink").load > 0.9
    assert "busy" in (_of(predictions, "/sink").doubt or "")


def test_what_does_not_exist_cannot_be_changed(tmp_path):
    for change, said in (
        (Change("executor", "/slo", 1), "/slow"),
        (Change("period", "/slow", 20_000_000), "callbacks"),
        # They would never end, or take all memory.
        (Change("period", "/sources Timer(10 ms)", 1), None),
        (Change("threads", "/slow", 1e9), None),
        (Change("thread", "/slow", 2), "threads"),
        (Change("depth", "/often", 0), None),
    ):
        with pytest.raises(UsageError) as raised:
            _asked(_system("jazzy"), tmp_path, [change])
        assert said is None or said in str(raised.value.hint)


def _predicted(folder: Path, *changes: Change, rounds: int = 8) -> list[Prediction]:
    with msgflow.open_db(folder / "run.duckdb") as opened:
        run = Slice().one_run(opened.connection, "a replay")
        return Predictor(opened.connection, run).predict(changes, rounds)


def test_a_gain_is_the_mean_of_drawn_runs(tmp_path):
    _asked(_system("jazzy"), tmp_path)
    change = Change("executor", "/slow", 1)
    drawn, again, single = (
        _of(_predicted(tmp_path, change, rounds=rounds), "/answer → /sink") for rounds in (8, 8, 0)
    )
    assert drawn == again
    assert drawn.p95 is not None
    assert single.p95 is not None
    assert 0 < drawn.p95.low < drawn.p95.size < drawn.p95.high
    assert drawn.p95.size == pytest.approx(single.p95.size, rel=0.5)
    assert single.replayed is not None
    (predicted,) = single.predicted
    size = single.replayed.p95 - predicted.p95
    assert single.p95 == Gain(size, size, size)


def test_what_a_change_cannot_reach_gains_nothing(tmp_path):
    _asked(_system("jazzy"), tmp_path)
    for each in _predicted(tmp_path, Change("duration", "/sink", 0.5)):
        assert each.is_reached == each.path.endswith("/sink")
        assert each.p95 is not None
        if each.is_reached:
            # The time that a thread needs to go on is not known better.
            assert each.p95.high - each.p95.low >= 20_000
        else:
            assert each.median == each.p95 == Gain(0, 0, 0)


def test_a_change_that_leaves_an_executor_no_time_has_no_size(tmp_path):
    _asked(_system("jazzy"), tmp_path)
    (path,) = (
        each
        for each in _predicted(tmp_path, Change("duration", "/slow", 2.4))
        if each.path.endswith("/slow")
    )
    assert "with the change an executor is busy" in (path.doubt or "")
    assert path.median is None


def test_of_a_long_run_the_middle_is_replayed(tmp_path):
    every = _of(_asked(_system("jazzy"), tmp_path), "/slow")
    with msgflow.open_db(tmp_path / "run.duckdb") as opened:
        run = Slice().one_run(opened.connection, "a replay")
        predictor = Predictor(opened.connection, run, longest_ns=1_000_000_000)
        some = _of(predictor.predict(), "/slow")
    assert predictor.window is not None
    assert predictor.window[1] - predictor.window[0] == pytest.approx(1_000_000_000, abs=2)
    assert every.recorded is not None
    assert some.recorded is not None
    assert some.recorded.flows == pytest.approx(every.recorded.flows / 3, abs=3)
    assert some.doubt is None


def test_a_path_has_a_size_where_drawn_runs_are_like_the_recording(tmp_path, monkeypatch):
    _asked(_system("jazzy"), tmp_path)
    monkeypatch.setattr("msgflow.replay.predict.is_near", lambda *_: False)
    change = Change("executor", "/slow", 1)
    by_rounds = {
        rounds: _of(_predicted(tmp_path, change, rounds=rounds), "/answer → /sink")
        for rounds in (0, 8)
    }
    assert by_rounds[8].doubt is None
    assert "differs" in (by_rounds[0].doubt or "")


def test_one_drawn_run_alone_does_not_move_a_size():
    assert gain_of([100, 200, 300, 90_000]).size == 250
    assert gain_of([100]) == Gain(100, 100, 100)
