"""Recordings on which msgflow was wrong once: no wrong link without a mark, no false word."""

from __future__ import annotations

import tarfile
from collections.abc import Callable
from pathlib import Path

import pytest
from scoring import compare_real, compare_recorded
from support.ingested import Ingested, made_once, open_ingested

from msgflow.ingest import ingest

# Recordings by archive and folder; what is true lies in each.
RECORDINGS = (
    "1-rclpy-three-nodes",
    "1-rclpy-three-nodes/sim",
    "2-approximate-close",
    "2-approximate-close/sim",
    "3-e2e-hides-marks",
    "3-e2e-hides-marks/partial",
    "4-main-loops/rclpy",
    "4-main-loops/waitset",
    "5-never-connected-lost/domains",
    "5-never-connected-lost/lifecycle",
    "6-destroyed-subscription-lost/groups",
    "6-destroyed-subscription-lost/sensor",
    "7-timers",
    "8-action-server-executor",
    "9-lost-but-taken-humble",
    "9-lost-but-taken-humble/iron",
    "11-rclpy-step-timer",
    "12-ghost-iron",
    "13-executor-select",
    "14-nested-response",
    "14-nested-response/sim",
)
# What the callback of an action's feedback publishes: these callbacks have no events, and what is
# true of links says nothing of topics of actions.
NOT_JUDGED = {"8-action-server-executor": {"take_adjacent"}}
# What is true of each as SQL.
WORDS = {
    "5-never-connected-lost/domains": (
        "SELECT count(*) > 2000 FROM stat_delivery WHERE reason = 'never_taken'"
    ),
    "6-destroyed-subscription-lost/groups": (
        "SELECT count(*) > 6000 FROM stat_delivery WHERE reason = 'subscription_ended'"
    ),
    "7-timers": (
        "SELECT count(*) = 0 FROM executor_wait JOIN callback USING (callback_id) JOIN timer "
        "USING (timer_id) WHERE since = 'timer' AND period_ns >= 1e8 AND wait_ns > "
        "200_000_000"
    ),
    "8-action-server-executor": (
        "SELECT max(threads) = 3 FROM (SELECT count(*) AS threads FROM executor_thread GROUP "
        "BY executor_id)"
    ),
    "13-executor-select": (
        "SELECT sum(end_ns - start_ns) FILTER (activity = 'select') < 0.05 * sum(end_ns - "
        "start_ns) FILTER (activity = 'blocked') FROM executor_activity"
    ),
}


@pytest.fixture(scope="session")
def wild(
    shared_traces: Path, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], tuple[Ingested, Path]]:
    """Unpacks and ingests a recording; returns it with the file of what is true."""

    def get(name: str) -> tuple[Ingested, Path]:
        archive = shared_traces.parent / "wild" / f"{name.partition('/')[0]}.tar.xz"
        if not archive.exists():
            pytest.skip("the recordings of ../shared/wild are not here")

        def make(path: Path) -> None:
            with tarfile.open(archive) as packed:
                packed.extractall(path.parent, filter="data")
            traces = [
                each
                for kind in ("ust", "kernel", "trace-*")
                for each in (path.parent / name).glob(kind)
            ]
            ingest(traces, path)

        path = made_once(tmp_path_factory, f"wild_{name.replace('/', '_')}", make)
        return open_ingested(path), path.parent / name / "truth.jsonl.gz"

    return get


@pytest.mark.thorough
@pytest.mark.parametrize("name", RECORDINGS)
def test_no_link_is_wrong_without_a_mark(
    wild: Callable[[str], tuple[Ingested, Path]], name: str
) -> None:
    ingested, truth = wild(name)
    compare = compare_recorded if (truth.parent / "meta.json").exists() else compare_real
    scores = compare(ingested.path, truth)
    assert sum(score.found for score in scores) > 200
    assert {
        score.kind: score.wrong
        for score in scores
        if score.wrong and score.kind not in NOT_JUDGED.get(name, ())
    } == {}
    if name in WORDS:
        assert ingested.rows(WORDS[name]) == [(True,)]
