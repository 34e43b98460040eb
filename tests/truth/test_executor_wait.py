"""When inputs really arrived in simulated executors, against the bounds that the trace gives."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import pytest
from support.ingested import Ingested, ingest_one
from support.thorough import few

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow_sim import executor_thread, simulate
from msgflow_sim.objects import TimerObject
from msgflow_sim.transport import Middleware

SCENARIOS = ["demo", "events_executors", "executors", "multi_threaded", "nested", "overload"]
_LENGTH = 0.2
_ARRIVED = """
SELECT w.earliest_ns, a.arrived_ns, w.latest_ns
FROM executor_wait AS w
JOIN callback_instance AS i USING (callback_instance_id)
JOIN take AS t ON i.take_id = t.take_id
JOIN subscription AS s ON t.subscription_id = s.subscription_id
JOIN process AS p ON i.process_id = p.process_id
JOIN host AS h ON p.host_id = h.host_id
JOIN true_arrival AS a
    ON h.hostname = a.hostname
    AND p.pid = a.pid
    AND s.rmw_handle = a.handle
    AND t.source_timestamp_ns = a.stamp_ns
"""
_DUE = """
SELECT w.earliest_ns, w.origin_ns, d.due_ns, w.latest_ns
FROM executor_wait AS w
JOIN callback AS c USING (callback_id)
JOIN process AS p ON c.process_id = p.process_id
JOIN host AS h ON p.host_id = h.host_id
ASOF JOIN due AS d
    ON h.hostname = d.hostname
    AND p.pid = d.pid
    AND c.callback_handle = d.callback
    AND w.start_ns >= d.called_ns
WHERE c.kind = 'timer'
"""
# What executors of one thread ran between the arrival of a message and its take, by what msgflow
# says of the two; sums over the flows of each hop of each path.
_BUSY = """
WITH part AS (
    SELECT e.path_id, e.hop, e.flow_id, e.from_ns, e.to_ns, a.arrived_ns, i.thread_id
    FROM end_to_end_part(
        [1], NULL, NULL, 'callback_start', 'callback_end', -9223372036854775807,
        9223372036854775807, 'first'
    ) AS e
    JOIN callback_instance AS i USING (callback_instance_id)
    JOIN take AS t ON i.take_id = t.take_id
    JOIN subscription AS s ON t.subscription_id = s.subscription_id
    JOIN process AS p ON i.process_id = p.process_id
    JOIN host AS h ON p.host_id = h.host_id
    JOIN executor_thread AS x ON i.thread_id = x.thread_id
    LEFT JOIN true_arrival AS a
        ON h.hostname = a.hostname
        AND p.pid = a.pid
        AND s.rmw_handle = a.handle
        AND t.source_timestamp_ns = a.stamp_ns
    WHERE e.part = 'publish_to_take'
        AND x.executor_id IN (
            SELECT executor_id FROM executor_thread GROUP BY executor_id HAVING count(*) = 1
        )
),
meanwhile AS (
    SELECT
        p.path_id, p.hop, p.flow_id,
        sum(least(r.end_ns, p.to_ns) - greatest(r.start_ns, p.arrived_ns)) AS busy_ns
    FROM part AS p
    JOIN callback_instance AS r
        ON p.thread_id = r.thread_id AND r.start_ns < p.to_ns AND r.end_ns > p.arrived_ns
    WHERE r.parent_id IS NULL
    GROUP BY ALL
)
SELECT
    path_id, hop, sum(to_ns - from_ns)::BIGINT, sum(coalesce(busy_ns, 0))::BIGINT,
    count(*) = count(arrived_ns)
FROM part
LEFT JOIN meanwhile USING (path_id, hop, flow_id)
GROUP BY path_id, hop
"""


class Witness:
    """Sees messages arrive and timers called."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.arrivals: list[tuple[Any, ...]] = []
        self.calls: list[tuple[Any, ...]] = []
        arrive, run_timer = Middleware.arrive, executor_thread.HANDLERS[TimerObject]

        def seen(middleware: Middleware, time: int, delivery: Any) -> None:
            subscription, message = delivery
            process = subscription.process
            moment = time + process.machine.epoch
            place = process.machine.hostname, process.pid, subscription.rmw_handle
            self.arrivals.append((*place, message.stamp_ns, moment))
            arrive(middleware, time, delivery)

        def called(thread: Any, middleware: Any, timer: TimerObject, time: int) -> Any:
            epoch = thread.machine.epoch
            place = thread.machine.hostname, thread.process.pid, timer.callback
            self.calls.append((*place, time + epoch, timer.due + epoch))
            return run_timer(thread, middleware, timer, time)

        monkeypatch.setattr(Middleware, "arrive", seen)
        handlers: dict[type, Callable[..., Any]] = {**executor_thread.HANDLERS, TimerObject: called}
        monkeypatch.setattr(executor_thread, "HANDLERS", handlers)


@pytest.fixture(scope="module")
def witnessed(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Ingested]:
    """Simulates and ingests a system; what was seen is in the tables `true_arrival` and `due`."""

    @lru_cache(1)
    def get(name: str) -> Ingested:
        directory = tmp_path_factory.mktemp(name)
        with pytest.MonkeyPatch.context() as patch:
            witness = Witness(patch)
            simulation = simulate(name, directory / "trace", factor=_LENGTH)
        ingested = ingest_one(simulation.directory, directory / "run.duckdb")
        connection = ingested.connection
        connection.execute(
            "CREATE TEMP TABLE true_arrival "
            "(hostname VARCHAR, pid INTEGER, handle UBIGINT, stamp_ns BIGINT, arrived_ns BIGINT)"
        )
        connection.execute(
            "CREATE TEMP TABLE due "
            "(hostname VARCHAR, pid INTEGER, callback UBIGINT, called_ns BIGINT, due_ns BIGINT)"
        )
        connection.executemany("INSERT INTO true_arrival VALUES (?, ?, ?, ?, ?)", witness.arrivals)
        connection.executemany("INSERT INTO due VALUES (?, ?, ?, ?, ?)", witness.calls)
        return ingested

    return get


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(SCENARIOS, "executors"))
def test_inputs_arrive_within_their_bounds(name: str, witnessed: Callable[[str], Ingested]) -> None:
    ingested = witnessed(name)
    arrived, due = ingested.rows(_ARRIVED), ingested.rows(_DUE)
    assert len(arrived) > 50
    for earliest, moment, latest in arrived:
        assert earliest is None or earliest <= moment
        assert moment <= latest
    assert len(due) > 50
    for earliest, origin, moment, latest in due:
        assert origin is None or (earliest <= origin == moment <= latest)
    assert sum(origin is None for _, origin, _, _ in due) <= 10


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(["demo", "executors", "overload"], "executors"))
def test_the_breakdown_bounds_how_long_executors_were_busy(
    name: str, witnessed: Callable[[str], Ingested]
) -> None:
    """What passed up to the takes is the sum of its three parts."""
    connection = witnessed(name).connection
    true = connection.execute(_BUSY).fetchall()
    parts: dict[tuple[int, int, str], int] = defaultdict(int)
    for row in run_query(connection, load_query("path-breakdown"), {}).to_arrow().to_pylist():
        parts[row["path_id"], row["hop"], row["part"]] += row["total_ns"]
    ever_busy = 0
    for path, hop, whole, busy, is_known in true:
        idle, undecided, certain = (
            parts[path, hop, part] for part in ("network_or_idle", "undecided", "executor_busy")
        )
        assert idle + undecided + certain == whole
        if is_known:
            assert certain <= busy <= certain + undecided
            ever_busy += busy
    assert ever_busy > 0
