"""A simulated system with Agnocast: callbacks, links, causes, missing messages are as they were."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import duckdb
import pytest
from support.thorough import thorough

from msgflow.ingest import ingest
from msgflow_sim import simulate
from msgflow_sim.scenario import scenarios

# Name, truth, what was found.
TRUTHS = {
    "callbacks": (
        "SELECT pid, tid, start_ns, end_ns, kind FROM callback_instance",
        "SELECT pid, tid, start_ns, end_ns, kind FROM run",
    ),
    "messages": (
        "SELECT b.pid, coalesce(b.agnocast_ns, b.rclcpp_ns, b.rcl_ns), t.pid, "
        "coalesce(t.agnocast_ns, t.rmw_ns) FROM take AS t "
        "JOIN publication AS b USING (publication_id) WHERE NOT b.is_internal",
        "SELECT b.pid, coalesce(b.rclcpp_ns, b.rcl_ns), t.pid, t.taken_ns "
        "FROM store.link_transport AS l JOIN sent AS b USING (publication_id) "
        "JOIN got AS t USING (take_id) WHERE l.candidate_count = 1",
    ),
    "direct causes": (
        "SELECT c.pid, c.tid, c.callback_start_ns, coalesce(b.agnocast_ns, b.rclcpp_ns) "
        "FROM causal AS c "
        "JOIN publication AS b USING (publication_id) "
        "WHERE c.kind = 'direct' AND NOT c.is_internal",
        "SELECT i.pid, i.tid, i.start_ns, b.rclcpp_ns FROM store.link_causal AS l "
        "JOIN run AS i USING (callback_instance_id) JOIN sent AS b USING (publication_id) "
        "WHERE l.kind = 'direct'",
    ),
    "polls": (
        "SELECT c.pid, b.agnocast_ns, t.agnocast_ns FROM causal AS c "
        "JOIN publication AS b USING (publication_id) JOIN take AS t ON c.take_id = t.take_id "
        "WHERE c.kind = 'polled'",
        "SELECT b.pid, b.rclcpp_ns, t.taken_ns FROM store.link_causal AS l "
        "JOIN sent AS b USING (publication_id) JOIN got AS t USING (take_id) "
        "WHERE l.kind = 'polled'",
    ),
    "missing messages": (
        "SELECT u.publication_pid, coalesce(b.agnocast_ns, b.rclcpp_ns), u.subscription_pid, "
        "u.reason FROM undelivered AS u "
        "JOIN publication AS b USING (publication_id) "
        "WHERE NOT u.is_internal",
        "SELECT b.pid, b.rclcpp_ns, p.pid, u.reason FROM store.undelivered AS u "
        "JOIN sent AS b USING (publication_id) "
        "JOIN store.subscription AS s USING (subscription_id) "
        "JOIN store.process AS p ON s.process_id = p.process_id",
    ),
}
# What was found, by process and thread.
PLACES = """
CREATE TEMP VIEW place AS SELECT h.thread_id, h.tid, p.pid
    FROM run.store.thread AS h JOIN run.store.process AS p USING (process_id);
CREATE TEMP VIEW sent AS SELECT b.*, h.pid, h.tid FROM run.store.publication AS b
    JOIN place AS h USING (thread_id)
    JOIN run.store.publisher AS p USING (publisher_id) WHERE NOT p.is_internal;
CREATE TEMP VIEW got AS SELECT t.*, h.pid FROM run.store.take AS t
    JOIN place AS h USING (thread_id);
CREATE TEMP VIEW run AS SELECT i.*, h.pid, h.tid, c.kind FROM run.store.callback_instance AS i
    JOIN place AS h USING (thread_id) JOIN run.store.callback AS c USING (callback_id);
"""


@pytest.fixture(params=["jazzy-agnocast", thorough("humble-agnocast")], scope="module")
def database(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[duckdb.DuckDBPyConnection]:
    """The run, attached, beside views of the truth. Agnocast 2.3 and 2.1."""
    directory: Path = tmp_path_factory.mktemp("agnocast")
    scenario = replace(scenarios()["agnocast"], layout=request.param)
    simulated = simulate(scenario, directory / "simulated")
    ingest([*simulated.trace_directories], directory / "run.duckdb")
    with duckdb.connect() as connection:
        connection.execute(f"ATTACH '{directory / 'run.duckdb'}' AS run (READ_ONLY)")
        for name, path in simulated.truth.items():
            connection.execute(f"CREATE TEMP VIEW {name} AS FROM read_parquet('{path}')")
        connection.execute(PLACES.replace("run.store", '"run".store'))
        yield connection


@pytest.mark.thorough
@pytest.mark.parametrize("what", TRUTHS)
def test_every_row_is_as_it_was(database: duckdb.DuckDBPyConnection, what: str) -> None:
    truth, found = (text.replace(" store.", " run.store.") for text in TRUTHS[what])
    assert database.execute(f"SELECT count(*) > 10 FROM ({truth})").fetchall() == [(True,)]
    for one, other in ((truth, found), (found, truth)):
        assert database.execute(f"({one}) EXCEPT ALL ({other})").fetchall() == []


@pytest.mark.thorough
def test_what_the_system_shows(database: duckdb.DuckDBPyConnection) -> None:
    """Numbers that begin again, receipts before the event of the publication, old periods."""
    assert database.execute(
        "SELECT count(*) FILTER (t.taken_ns < b.end_ns) > 5 FROM run.store.link_transport AS l "
        "JOIN got AS t USING (take_id) JOIN sent AS b USING (publication_id) "
        "WHERE l.method = 'agnocast'"
    ).fetchall() == [(True,)]
    assert database.execute(
        "SELECT count(*), count(DISTINCT e.entry_id) FROM run.store.agnocast_entry AS e "
        "JOIN sent AS b USING (publication_id) JOIN run.store.publisher AS p USING (publisher_id) "
        "WHERE p.topic_name = '/short'"
    ).fetchall() == [(64, 32)]
    # Before 2.3, the periods were recorded in milliseconds.
    assert database.execute(
        "SELECT period_ns // 1_000_000 FROM run.store.timer WHERE period_ns IS NOT NULL ORDER BY 1"
    ).fetchall() == [(10,), (20,), (20,), (50,), (70,), (100,), (230,)]
