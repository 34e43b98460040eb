"""What CARET tells besides: when messages arrived, and the time of a simulation."""

from __future__ import annotations

import json
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
    """Arrivals that its hook would tell: those of a simulated system, read without its kernel."""
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


@pytest.mark.thorough
def test_a_recording_of_caret(tmp_path: Path) -> None:
    """Its events alone tell executors, arrivals, and the time of a simulation at half the pace."""
    simulated = simulate("caret", tmp_path / "simulated", factor=0.6, layout="humble-caret")
    path = tmp_path / "run.duckdb"
    ingest([simulated.directory], path)
    meta = json.loads((simulated.directory / "truth" / "meta.json").read_text(encoding="utf-8"))
    begin = meta["hosts"]["alpha"]["begin_of_tracing_ns"]
    with open_db(path) as db:

        def rows(query: str) -> list[tuple[object, ...]]:
            return [tuple(row.values()) for row in db.sql(query).to_arrow().to_pylist()]

        assert rows("SELECT kind, count(*) FROM executor GROUP BY kind") == [
            ("single_threaded_executor", 4)
        ]
        assert rows("SELECT DISTINCT name FROM finding WHERE severity <> 'info'") == [
            ("executor_events_left_out",)
        ]
        assert rows(
            "SELECT count(*) > 200, bool_and(a.is_exact AND a.waker_kind = 'listener'), "
            "bool_and(a.until_arrival_ns + a.executor_ns = l.latency_ns) "
            "FROM take LEFT JOIN link_transport AS l USING (take_id) "
            "LEFT JOIN arrival AS a USING (take_id)"
        ) == [(True, True, True)]
        late = db.query("timers").to_arrow().to_pydict()["lateness_max_ns"]
        assert max(late) < 3_000_000
        (flow, *_) = db.query("flows", start="sim:1").with_times("sim").to_arrow().to_pylist()
        (same, *_) = db.query("flows", start=begin + 2 * 10**9).to_arrow().to_pylist()
        assert flow["root_s"] >= 1
        assert flow["root_s"] == pytest.approx((same["root_ns"] - begin) / 2e9, abs=1e-6)


@pytest.mark.thorough
def test_a_subscriber_without_ros(tmp_path: Path) -> None:
    """An instrumented DDS tells of its readers."""
    simulated = simulate("caret", tmp_path / "simulated", factor=0.1)
    path = tmp_path / "run.duckdb"
    ingest([simulated.directory], path)
    with duckdb.connect(str(path)) as connection:
        found = connection.execute(
            "SELECT pid, topic_name, created_ns FROM main.untraced_reader "
            "JOIN main.process USING (process_id) ORDER BY ALL"
        ).fetchall()
        true = f"SELECT pid, topic_name, created_ns FROM '{simulated.truth['reader']}' ORDER BY ALL"
        assert found == connection.execute(true).fetchall()
        assert [topic for _, topic, _ in found] == ["/image", "/map"]
