"""Events executors, which have no events of their own: what is said of real and simulated ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.ingested import Ingested

from msgflow.ingest import ingest
from msgflow_sim import scenarios, simulate
from msgflow_sim.system import KernelTrace

# How long the kernel saw each thread in each state while it is said to have waited.
_WAITED = """
SELECT s.state, sum(least(s.end_ns, a.end_ns) - greatest(s.start_ns, a.start_ns))::BIGINT
FROM waited AS a
JOIN thread_state AS s
    ON a.thread_id = s.thread_id AND s.start_ns < a.end_ns AND s.end_ns > a.start_ns
GROUP BY s.state
"""
_OUT_OF_BOUNDS = """
SELECT count(*), count(*) FILTER (a.arrived_ns NOT BETWEEN w.earliest_ns AND w.latest_ns)
FROM executor_wait AS w
JOIN callback_instance AS i USING (callback_instance_id)
JOIN arrival AS a ON i.take_id = a.take_id
WHERE a.is_exact
"""


@pytest.mark.thorough
def test_real_events_executors(shared_traces: Path, tmp_path: Path) -> None:
    """The kernel says when they slept, and when messages came: other knowledge must agree."""
    path, recording = tmp_path / "run.duckdb", shared_traces / "real_events"
    ingest([recording / "ust", recording / "kernel.tar.xz"], path)
    with duckdb.connect(str(path)) as con:

        def rows(query: str) -> list[tuple[Any, ...]]:
            return con.execute(query).fetchall()

        assert rows("SELECT kind FROM executor") == [("events",), ("events",)]
        ((takes, exact),) = rows(
            "SELECT count(*), count(*) FILTER (a.is_exact) FROM link_transport AS l "
            "LEFT JOIN arrival AS a USING (take_id)"
        )
        assert exact > 0.95 * takes > 950
        ((exact, wrong),) = rows(_OUT_OF_BOUNDS)
        assert (exact > 950, wrong) == (True, 0)
        con.execute("CREATE TEMP TABLE waited AS FROM executor_activity WHERE activity = 'wait'")
        ((state, slept),) = rows(_WAITED)
        assert (state, slept > 7_800_000_000) == ("sleeping", True)
        # What is said without the kernel's states.
        con.execute("CREATE TEMP TABLE state AS FROM store.thread_state")
        con.execute("DELETE FROM store.thread_state")
        con.execute(
            "CREATE OR REPLACE TEMP TABLE waited AS FROM executor_activity WHERE activity = 'wait'"
        )
        con.execute("INSERT INTO store.thread_state FROM state")
        waited = dict(rows(_WAITED))
    assert waited.pop("sleeping") > 7_500_000_000
    assert sum(waited.values()) < 4_000_000


@pytest.mark.thorough
def test_simulated_events_executors(simulations: Callable[[str], Ingested]) -> None:
    """They are found, and what they publish to themselves is there when publish() returns."""
    simulated = simulations("events_executors")
    assert simulated.rows(
        "SELECT p.name, e.kind FROM executor AS e JOIN process AS p USING (process_id) ORDER BY ALL"
    ) == [
        ("relay", "events"),
        ("sink", "single_threaded"),
        ("source", "single_threaded"),
        ("worker", "events"),
    ]
    ((own, exact),) = simulated.rows(
        "SELECT count(*), count(*) FILTER (a.is_exact) FROM take AS t "
        "JOIN link_transport AS l USING (take_id) "
        "JOIN publication AS b USING (publication_id) LEFT JOIN arrival AS a USING (take_id) "
        "WHERE t.thread_id = b.thread_id AND b.start_ns >= (SELECT min(start_ns) "
        "FROM callback_instance AS i WHERE i.thread_id = t.thread_id)"
    )
    assert own == exact > 100


# As above, with what the simulator knows in place of a kernel trace.
_TRULY_WAITED = """
SELECT s.state = 'sleeping', sum(least(s.end_ns, a.end_ns) - greatest(s.start_ns, a.start_ns))
FROM executor_activity AS a
JOIN executor AS e USING (executor_id)
JOIN thread AS t USING (thread_id)
JOIN read_parquet('{thread_state}') AS s
    ON t.tid = s.tid AND s.start_ns < a.end_ns AND s.end_ns > a.start_ns
WHERE a.activity = 'wait' AND e.kind = 'events'
GROUP BY ALL
"""
_TRULY_OUT_OF_BOUNDS = """
SELECT count(*), count(*) FILTER (k.arrived_ns NOT BETWEEN w.earliest_ns AND w.latest_ns)
FROM executor_wait AS w
JOIN executor AS e ON w.executor_id = e.executor_id
JOIN callback_instance AS i USING (callback_instance_id)
JOIN take AS t ON i.take_id = t.take_id
JOIN thread AS h ON t.thread_id = h.thread_id
JOIN read_parquet('{take}') AS r ON h.tid = r.tid AND t.taken_ns = r.rmw_ns
JOIN read_parquet('{arrival}') AS k ON r.take_id = k.take_id
WHERE e.kind = 'events'
"""


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_bounds_of_simulated_events_executors(tmp_path: Path, seed: int) -> None:
    """Without a kernel trace: the true arrivals are within the bounds, and its waits are sleep."""
    scenario = scenarios()["events_executors"]
    (host,) = scenario.hosts
    known = replace(scenario, hosts=(replace(host, kernel=KernelTrace()),))
    simulated = simulate(known, tmp_path / "simulated", factor=0.4, seed=seed)
    path = tmp_path / "run.duckdb"
    ingest([one for one in simulated.trace_directories if "kernel" not in one.parts], path)
    with duckdb.connect(str(path)) as con:
        found, wrong = con.execute(_TRULY_OUT_OF_BOUNDS.format_map(simulated.truth)).fetchall()[0]
        assert (found > 1000, wrong) == (True, 0)
        waited = dict(con.execute(_TRULY_WAITED.format_map(simulated.truth)).fetchall())
    assert waited[False] < waited[True] / 200
