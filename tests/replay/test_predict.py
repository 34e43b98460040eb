"""A replay gives what was recorded, and what the simulator gives for a change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

import msgflow
from msgflow.errors import UsageError
from msgflow.ingest import ingest
from msgflow.replay.predict import Change, Prediction, Spread, is_near, predict
from msgflow.run.slice import Slice
from msgflow_sim import (
    Executor,
    Host,
    Node,
    Process,
    Publisher,
    Scenario,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim import simulate as simulated
from msgflow_sim.entity import MILLISECOND

_SOURCES = Node(
    "sources",
    publishers=(Publisher("/often"), Publisher("/seldom")),
    timers=(
        Timer(10 * MILLISECOND, ("/often",), Work(100_000, 100_000)),
        Timer(23 * MILLISECOND, ("/seldom",), Work(100_000, 100_000)),
    ),
)
_FAST = Node(
    "fast",
    publishers=(Publisher("/answer"),),
    subscriptions=(Subscription("/often", ("/answer",), Work(MILLISECOND, MILLISECOND)),),
)
_SLOW = Node("slow", subscriptions=(Subscription("/seldom", work=Work(9_000_000, 2_000_000)),))
_SINK = Node("sink", subscriptions=(Subscription("/answer"),))


def _system(layout: str, kind: str = "single_threaded", *, slow: Node = _SLOW) -> Scenario:
    executors = (Executor(kind, 2 if kind == "multi_threaded" else 1), Executor())
    library = "traced_rclpy" if layout == "rolling" else "rclcpp"
    return Scenario(
        "replayed",
        "Two nodes with one executor.",
        (Host("alpha", cpu_count=16),),
        (
            Process("sources", "alpha", 1101, (_SOURCES,), client_library=library),
            Process(
                "pair",
                "alpha",
                1201,
                (_FAST, slow),
                executors=executors[: 1 + slow.executor],
                client_library=library,
            ),
            Process("sink", "alpha", 1301, (_SINK,)),
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
        return predict(opened.connection, Slice().one_run(opened.connection, "a replay"), changes)


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
        (Change("period", "/slow", 1), "callbacks"),
        (Change("thread", "/slow", 2), "threads"),
        (Change("depth", "/often", 0), None),
    ):
        with pytest.raises(UsageError) as raised:
            _asked(_system("jazzy"), tmp_path, [change])
        assert said is None or said in str(raised.value.hint)
