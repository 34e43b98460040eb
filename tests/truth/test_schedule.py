"""What the kernel did with threads of simulated systems, against what is true."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import duckdb
import pytest
from scoring import Score, compare_simulated
from support.ingested import ingest_one
from support.thorough import few, thorough

from msgflow_sim import Recording, Simulation, scenarios, simulate
from msgflow_sim.entity import MILLISECOND, SECOND
from msgflow_sim.system import KernelTrace

# How much of each is simulated: the losses come after 0.7 s of 5 s.
SYSTEMS = {
    "cpu_hog": 0.1,
    "real_time": 0.2,
    "shared_map": 0.2,
    "shared_memory": 0.4,
    "kernel_losses": 0.17,
}
LOSS_NS = 41 * MILLISECOND
KINDS = {"thread_state", "preemptor", "callback_schedule", "arrival"}

Traced = tuple[Simulation, Path]


@pytest.fixture(scope="module", params=few(SYSTEMS, "real_time"))
def traced(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Traced:
    return ingested(request.param, tmp_path_factory.mktemp(request.param), Recording())


def ingested(system: str, directory: Path, recording: Recording) -> Traced:
    simulation = simulate(system, directory / "trace", factor=SYSTEMS[system], recording=recording)
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


@pytest.mark.thorough
@pytest.mark.parametrize("traced", few(SYSTEMS, "shared_memory"), indirect=True, scope="module")
def test_perf_gives_the_same_answers(traced: Traced, tmp_path: Path) -> None:
    """But it does not tell what it has lost."""
    simulation, database = traced
    system = json.loads(simulation.meta.read_text())["scenario"]
    by_perf, other = ingested(system, tmp_path, Recording(kernel_tracer="perf"))
    assert (by_perf.directory / "robot" / "perf" / "metadata").exists()
    assert not (by_perf.directory / "robot" / "kernel").exists()
    with duckdb.connect() as connection:
        connection.execute(f"ATTACH '{database}' AS lttng (READ_ONLY)")
        connection.execute(f"ATTACH '{other}' AS perf (READ_ONLY)")
        for table in (
            "store.thread_state",
            "store.preemptor",
            "store.callback_schedule",
            "store.callback_preemptor",
            "main.arrival",
        ):
            columns = "COLUMNS(lambda c: c <> 'is_loss_affected')"
            rows, differing = connection.execute(
                f"SELECT (SELECT count(*) FROM lttng.{table}), count(*) FROM ("
                f"FROM (SELECT {columns} FROM lttng.{table}) "
                f"EXCEPT ALL SELECT {columns} FROM perf.{table} UNION ALL "
                f"(SELECT {columns} FROM perf.{table} "
                f"EXCEPT ALL SELECT {columns} FROM lttng.{table}))"
            ).fetchall()[0]
            assert (table, differing) == (table, 0)
            assert rows > 10
        assert connection.execute(
            "SELECT bool_or(is_loss_affected) FROM perf.store.thread_state"
        ).fetchall() == [(False,)]
    for kind, score in scores(by_perf, other).items():
        assert (kind, score.wrong, score.missing) == (kind, 0, 0)


# What the comparison notices in one run, it notices in all.
@pytest.mark.thorough
@pytest.mark.parametrize("traced", few(SYSTEMS, "real_time"), indirect=True, scope="module")
@pytest.mark.parametrize(
    ("kind", "change"),
    [
        thorough(
            "thread_state", "UPDATE thread_state SET end_ns = end_ns + 1 WHERE state = 'runnable'"
        ),
        thorough(
            "thread_state", "UPDATE thread_state SET state = 'sleeping' WHERE state = 'preempted'"
        ),
        thorough(
            "thread_state",
            "UPDATE thread_state SET waker_kind = 'thread' WHERE waker_kind = 'timer'",
        ),
        thorough("thread_state", "UPDATE thread_state SET cpu = cpu + 1"),
        thorough("preemptor", "DELETE FROM preemptor WHERE state = 'preempted'"),
        thorough("preemptor", "UPDATE preemptor SET preemptor_priority = preemptor_priority + 1"),
        ("callback_schedule", "UPDATE callback_schedule SET running_ns = running_ns + 1"),
        thorough("callback_schedule", "UPDATE callback_schedule SET preemption_count = 0"),
        thorough("callback_schedule", "UPDATE callback_schedule SET irq_ns = irq_ns + 1"),
        thorough("callback_schedule", "UPDATE callback_schedule SET softirq_ns = 0"),
        thorough(
            "arrival", "UPDATE thread_state SET waker_kind = 'timer' WHERE waker_kind = 'softirq'"
        ),
        thorough("arrival", "UPDATE thread_state SET end_ns = end_ns - 1 WHERE state = 'sleeping'"),
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


@pytest.mark.thorough
def test_a_disk_ends_waits_that_nothing_else_does(tmp_path: Path) -> None:
    simulation, database = ingested("shared_memory", tmp_path, Recording())
    with duckdb.connect(str(database), read_only=True) as connection:
        found = connection.execute(
            "SELECT tid, waker_kind, count(*) FROM store.thread_state "
            "JOIN store.thread USING (thread_id) "
            "WHERE state = 'uninterruptible' AND waker_kind IS NOT NULL GROUP BY ALL"
        ).fetchall()
    ((happened,),) = duckdb.sql(
        f"SELECT count(*) FROM '{simulation.truth['callback_instance']}' AS c "
        f"JOIN '{simulation.truth['take']}' AS t USING (take_id) "
        "WHERE topic_name = '/objects' AND end_ns IS NOT NULL"
    ).fetchall()
    assert found == [(1301, "interrupt", happened)]
    assert happened > 10


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("system", "depth"),
    few([("shared_map", 1), ("shared_memory", 2)], ("shared_memory", 2)),
)
def test_who_waits_for_another_thread_waits_for_what_that_does(
    tmp_path: Path, system: str, depth: int
) -> None:
    """Critical paths have what the threads did that gave a mutex away or signalled a condition.

    In shared_memory the tracker waits for the detector, and that for the driver, of another
    process.
    """
    simulation, database = ingested(system, tmp_path, Recording())
    with duckdb.connect(str(database), read_only=True) as connection:
        differing, deepest, waits = connection.execute(f"""
            WITH RECURSIVE piece AS MATERIALIZED (
                SELECT
                    callback_instance_id, wakers, t.tid, state, from_ns, to_ns, duration_ns
                FROM critical_path([1], most_flows := 1000)
                JOIN thread AS t ON state_thread_id = t.thread_id
                WHERE hop = 1 AND activity = 'callback'
            ),
            whole AS (
                SELECT
                    callback_instance_id, min_by(tid, from_ns) FILTER (WHERE wakers = 0) AS tid,
                    min(from_ns) AS from_ns, max(to_ns) AS to_ns
                FROM piece
                GROUP BY callback_instance_id
            ),
            happened AS (
                SELECT
                    w.callback_instance_id, 0 AS wakers, s.tid, s.state, s.waker_tid,
                    greatest(s.start_ns, w.from_ns) AS from_ns, least(s.end_ns, w.to_ns) AS to_ns
                FROM whole AS w
                JOIN '{simulation.truth["thread_state"]}' AS s
                    ON w.tid = s.tid AND s.start_ns < w.to_ns AND s.end_ns > w.from_ns
                UNION ALL
                SELECT
                    h.callback_instance_id, h.wakers + 1, s.tid, s.state, s.waker_tid,
                    greatest(s.start_ns, h.from_ns), least(s.end_ns, h.to_ns)
                FROM happened AS h
                JOIN '{simulation.truth["thread_state"]}' AS s
                    ON h.waker_tid = s.tid AND s.start_ns < h.to_ns AND s.end_ns > h.from_ns
                WHERE h.state = 'sleeping'
            ),
            expected AS (
                SELECT callback_instance_id, wakers, tid, state, sum(to_ns - from_ns) AS ns
                FROM happened
                WHERE state <> 'sleeping' OR waker_tid IS NULL
                GROUP BY ALL
            ),
            found AS (
                SELECT callback_instance_id, wakers, tid, state, sum(duration_ns) AS ns
                FROM piece
                GROUP BY ALL
            )
            SELECT
                count(*) FILTER (WHERE e.ns IS NULL OR f.ns IS NULL),
                max(wakers),
                count(DISTINCT callback_instance_id) FILTER (WHERE wakers > 0)
            FROM expected AS e
            FULL JOIN found AS f USING (callback_instance_id, wakers, tid, state, ns)
        """).fetchall()[0]
    assert (differing, deepest) == (0, depth)
    assert waits > 5


@pytest.mark.thorough
@pytest.mark.parametrize("tracer", few(["lttng", "perf"], "lttng"))
def test_what_losses_leave_open_is_not_guessed(tmp_path: Path, tracer: str) -> None:
    """Where a switch was lost, no other thread passes for the one that ran."""
    system = scenarios()["shared_memory"]
    # A thread whose switch was lost still runs after most of these.
    losses = tuple((time, time + 3 * MILLISECOND) for time in range(SECOND // 2, SECOND, LOSS_NS))
    host = replace(system.hosts[0], kernel=KernelTrace(system.hosts[0].kernel.loads, losses=losses))
    simulation = simulate(
        replace(system, hosts=(host,)),
        tmp_path / "trace",
        factor=0.4,
        recording=Recording(kernel_tracer=tracer),
    )
    database = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, database).connection.close()
    with duckdb.connect(str(database), read_only=True) as connection:
        wakers = connection.execute(f"""
            SELECT
                count(*) FILTER (WHERE k.tid = t.waker_tid),
                count(*) FILTER (
                    WHERE s.waker_kind = 'thread' AND k.tid IS DISTINCT FROM t.waker_tid
                )
            FROM store.thread_state AS s
            JOIN store.thread AS o ON s.thread_id = o.thread_id
            LEFT JOIN store.thread AS k ON s.waker_thread_id = k.thread_id
            JOIN '{simulation.truth["thread_state"]}' AS t
                ON o.tid = t.tid AND s.end_ns = t.end_ns AND t.state = 'sleeping'
            WHERE s.state = 'sleeping'
        """).fetchall()[0]
        preemptors = connection.execute(f"""
            SELECT count(r.cpu), count(*) - count(r.cpu)
            FROM store.preemptor AS s
            LEFT JOIN store.thread AS t ON s.preemptor_thread_id = t.thread_id
            LEFT JOIN store.other_thread AS o
                ON s.preemptor_other_thread_id = o.other_thread_id
            LEFT JOIN '{simulation.truth["cpu_run"]}' AS r
                ON s.cpu = r.cpu AND r.kernel_tid = coalesce(t.tid, o.tid)
                AND r.start_ns <= s.start_ns AND r.end_ns >= s.end_ns
            WHERE coalesce(s.preemptor_thread_id, s.preemptor_other_thread_id) IS NOT NULL
                -- A thread that is back before a loss ends seems not to have gone.
                AND NOT EXISTS (
                    FROM '{simulation.truth["kernel_loss"]}' AS l
                    WHERE s.start_ns < l.end_ns AND s.end_ns > l.start_ns
                )
        """).fetchall()[0]
    assert (wakers[1], preemptors[1]) == (0, 0)
    assert min(wakers[0], preemptors[0]) > 30
