"""What the kernel did with threads of simulated systems, against what is true."""

from __future__ import annotations

import shutil
from pathlib import Path

import duckdb
import pytest
from ingested import ingest_one
from scoring import Score, compare_simulated
from thorough import few

from msgflow.sim import Simulation, simulate

# How much of each is simulated: the losses come after 0.7 s of 5 s.
SYSTEMS = {"cpu_hog": 0.1, "real_time": 0.2, "shared_map": 0.2, "kernel_losses": 0.17}
KINDS = {"thread_state", "preemptor", "callback_schedule", "arrival"}

Traced = tuple[Simulation, Path]


@pytest.fixture(scope="module", params=few(SYSTEMS, "real_time", "shared_map", "kernel_losses"))
def traced(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Traced:
    directory = tmp_path_factory.mktemp(request.param)
    simulation = simulate(request.param, directory / "trace", factor=SYSTEMS[request.param])
    path = directory / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    return simulation, path


def scores(simulation: Simulation, database: Path) -> dict[str, Score]:
    found, _ = compare_simulated(database, simulation.truth)
    return {score.kind: score for score in found}


def test_all_is_found_and_nothing_else(traced: Traced) -> None:
    found = scores(*traced)
    assert found.keys() >= KINDS
    for kind in KINDS:
        score = found[kind]
        assert (kind, score.wrong, score.missing) == (kind, 0, 0)
        assert score.decided > 30
        assert score.decided > 0.7 * score.happened
        assert score.misguessed < 0.05 * score.found


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("thread_state", "UPDATE thread_state SET end_ns = end_ns + 1 WHERE state = 'runnable'"),
        ("thread_state", "UPDATE thread_state SET state = 'sleeping' WHERE state = 'preempted'"),
        (
            "thread_state",
            "UPDATE thread_state SET waker_kind = 'thread' WHERE waker_kind = 'timer'",
        ),
        ("thread_state", "UPDATE thread_state SET cpu = cpu + 1"),
        ("preemptor", "DELETE FROM preemptor WHERE state = 'preempted'"),
        ("preemptor", "UPDATE preemptor SET preemptor_priority = preemptor_priority + 1"),
        ("callback_schedule", "UPDATE callback_schedule SET running_ns = running_ns + 1"),
        ("callback_schedule", "UPDATE callback_schedule SET preemption_count = 0"),
        ("arrival", "UPDATE thread_state SET waker_kind = 'timer' WHERE waker_kind = 'softirq'"),
        ("arrival", "UPDATE thread_state SET end_ns = end_ns - 1 WHERE state = 'sleeping'"),
    ],
)
def test_what_is_wrong_is_noticed(traced: Traced, tmp_path: Path, kind: str, change: str) -> None:
    simulation, database = traced
    changed = Path(shutil.copy(database, tmp_path / "run.duckdb"))
    with duckdb.connect(str(changed)) as connection:
        connection.execute("USE store")
        connection.execute(change)
    score = scores(simulation, changed)[kind]
    assert score.wrong + score.missing > 0


def test_a_cpu_has_one_thread_at_a_time(traced: Traced) -> None:
    """And a thread has one CPU, and its states follow each other."""
    simulation, _ = traced
    for table, place in (
        ("cpu_run", "host, cpu"),
        ("cpu_run", "host, kernel_tid"),
        ("thread_state", "host, pid, tid"),
    ):
        assert duckdb.sql(
            f"SELECT count(*) FROM (SELECT start_ns, lag(end_ns) OVER (PARTITION BY {place} "
            f"ORDER BY start_ns) AS before_ns FROM '{simulation.truth[table]}') "
            "WHERE before_ns > start_ns"
        ).fetchall() == [(0,)]
    assert duckdb.sql(
        "SELECT count(*) FROM (SELECT start_ns, lag(end_ns) OVER (PARTITION BY host, pid, tid "
        f"ORDER BY start_ns) AS before_ns FROM '{simulation.truth['thread_state']}') "
        "WHERE before_ns < start_ns"
    ).fetchall() == [(0,)]


def test_who_waits_for_a_mutex_waits_for_the_thread_that_has_it(tmp_path: Path) -> None:
    """Critical paths have what that thread did in place of the sleep."""
    simulation = simulate("shared_map", tmp_path / "trace", factor=SYSTEMS["shared_map"])
    ingested = ingest_one(simulation.directory, tmp_path / "run.duckdb")
    ((callbacks, differing),) = ingested.rows(f"""
        WITH found AS (
            SELECT
                callback_instance_id,
                coalesce(sum(duration_ns) FILTER (WHERE wakers > 0), 0) AS waited_ns,
                bool_and(state_thread_id <> i.thread_id) FILTER (WHERE wakers > 0) AS is_other
            FROM critical_path([1], most_flows := 1000)
            JOIN callback_instance AS i USING (callback_instance_id)
            WHERE hop = 1 AND activity = 'callback'
            GROUP BY callback_instance_id
        ),
        happened AS (
            SELECT i.callback_instance_id, sum(s.end_ns - s.start_ns) AS waited_ns
            FROM '{simulation.truth["thread_state"]}' AS s
            JOIN thread AS t ON s.tid = t.tid
            JOIN callback_instance AS i
                ON t.thread_id = i.thread_id AND s.start_ns BETWEEN i.start_ns AND i.end_ns
            WHERE s.state = 'sleeping' AND s.waker_kind = 'thread'
            GROUP BY i.callback_instance_id
        )
        SELECT
            count(h.waited_ns),
            count(*) FILTER (
                WHERE f.waited_ns <> coalesce(h.waited_ns, 0) OR f.is_other IS FALSE
            )
        FROM found AS f
        LEFT JOIN happened AS h ON f.callback_instance_id = h.callback_instance_id
    """)
    assert differing == 0
    assert callbacks > 5
