"""Arrivals that CARET's hook would tell: those of a simulated system, read without its kernel."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest

from msgflow import open_db
from msgflow.ingest import ingest
from msgflow_sim import simulate

# As the ingest makes them of on_data_available.
TOLD = """
INSERT INTO store.data_arrival
SELECT t.run_id, t.take_id, t.taken_ns - a.arrived_ns, false
FROM store.take AS t
JOIN store.thread AS h USING (thread_id)
JOIN read_parquet('{take}') AS k ON h.tid = k.tid AND t.taken_ns = k.rmw_ns
JOIN read_parquet('{arrival}') AS a ON k.take_id = a.take_id
"""


@pytest.mark.thorough
def test_the_parts_of_a_latency_add_up(tmp_path: Path) -> None:
    simulated = simulate("shared_map", tmp_path / "simulated")
    path = tmp_path / "run.duckdb"
    ingest([one for one in simulated.trace_directories if "kernel" not in one.parts], path)
    with duckdb.connect(str(path)) as connection:
        connection.execute(TOLD.format_map(simulated.truth))

        def rows(query: str) -> list[tuple[object, ...]]:
            return connection.execute(query).fetchall()

        assert rows(
            "SELECT count(*) > 300, bool_and(a.is_exact), "
            "bool_and(a.until_arrival_ns + a.executor_ns = l.latency_ns) "
            "FROM main.arrival AS a JOIN main.link_transport AS l USING (take_id)"
        ) == [(True, True, True)]
        # A message may arrive while the thread has no CPU to begin the wait that its executor
        # shows: then it is there before the least bound.
        assert rows(
            "SELECT count(*) FILTER (a.arrived_ns < w.earliest_ns) < count(*) / 100, "
            "bool_and(a.arrived_ns <= w.latest_ns) "
            "FROM main.arrival AS a JOIN main.callback_instance AS i USING (take_id) "
            "JOIN main.executor_wait AS w USING (callback_instance_id)"
        ) == [(True, True)]
        assert rows(
            "SELECT count(*) FROM main.executor_wait_explained([1]) "
            "WHERE until_arrival_ns IS NOT NULL AND busy_min_ns <> busy_max_ns"
        ) == [(0,)]
    with open_db(path) as db:
        found = db.query("path-breakdown").to_arrow().to_pylist()
        flows = db.query("e2e-latency").to_arrow().to_pylist()
    parts = {row["part"] for row in found}
    assert {"until_arrival", "executor"} <= parts
    assert "run_queue" not in parts
    # Means are rounded.
    latency = sum(row["mean_ns"] * row["pairs"] for row in flows)
    assert abs(sum(row["total_ns"] for row in found) - latency) <= sum(
        row["pairs"] for row in flows
    )
