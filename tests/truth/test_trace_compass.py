"""The trace of Trace Compass's own tests: what it holds is known to the nanosecond."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from support.ingested import Ingested

from msgflow.db.connection import connect

FLOWS = (
    "end_to_end([1], NULL, NULL, 'callback_start', 'callback_end', 0, 9223372036854775807) AS e "
    "JOIN flow_path([1], NULL, NULL) AS h USING (path_id)"
)
MAIN_PATH = "h.topics = ['/topic_a', '/topic_b']"


@dataclass(frozen=True)
class Session:
    """What the two commands of the documentation did.

    Attributes:
        database: the database that they made.
        answer: what the query printed, as JSON.
        before: content of the trace directory before, by file.
        after: content of the trace directory afterwards.
    """

    database: Path
    answer: list[dict[str, Any]]
    before: dict[str, tuple[str, int]]
    after: dict[str, tuple[str, int]]


def contents(directory: Path) -> dict[str, tuple[str, int]]:
    """Return digest and time of change of every file below a directory."""
    return {
        str(path.relative_to(directory)): (
            hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "",
            path.stat().st_mtime_ns,
        )
        for path in sorted(directory.rglob("*"))
    }


@pytest.fixture(scope="module")
def session(shared_traces: Path, tmp_path_factory: pytest.TempPathFactory) -> Session:
    """Ingest and query, with no other option than the format."""
    directory = shared_traces / "tracecompass-ros2"
    here = tmp_path_factory.mktemp("here")
    before = contents(directory)
    for command in (["ingest", str(directory)], ["query", "e2e-latency", "--format", "json"]):
        done = subprocess.run(
            [sys.executable, "-m", "msgflow", *command],
            cwd=here,
            env={"PATH": "/usr/bin:/bin", "HOME": str(here)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
    database = here / "msgflow.duckdb"
    return Session(database, json.loads(done.stdout), before, contents(directory))


@pytest.fixture(scope="module")
def trace(session: Session) -> Iterator[Ingested]:
    connection = connect(session.database, read_only=True)
    yield Ingested(connection, session.database)
    connection.close()


@pytest.mark.thorough
def test_the_two_commands(session: Session) -> None:
    """The answer, and not a byte of the trace changes."""
    (row,) = [row for row in session.answer if row["roots"] == 2_031]
    assert (row["reached"], row["not_connected"], row["lost"], row["superseded"]) == (
        1_986,
        45,
        0,
        0,
    )
    assert (row["min_ns"], row["median_ns"], row["max_ns"]) == (131_601, 562_411, 45_601_667)
    assert session.after == session.before


@pytest.mark.thorough
def test_objects(trace: Ingested) -> None:
    assert trace.rows("SELECT event_count FROM store.run") == [(99_338,)]
    assert trace.rows("SELECT event_count FROM trace") == [(99_338,)]
    assert trace.rows(
        "SELECT full_name, pid FROM node JOIN process USING (process_id) ORDER BY 2"
    ) == [
        ("/source", 427_930),
        ("/sync_one_to_one", 427_932),
        ("/sink", 427_934),
    ]
    assert trace.rows("SELECT topic_name, count(*) FROM publisher GROUP BY ALL ORDER BY ALL") == [
        ("/parameter_events", 3),
        ("/rosout", 3),
        ("/topic_a", 1),
        ("/topic_b", 1),
    ]
    assert trace.rows(
        "SELECT topic_name, count(*) FROM subscription GROUP BY ALL ORDER BY ALL"
    ) == [
        ("/parameter_events", 3),
        ("/topic_a", 1),
        ("/topic_b", 1),
    ]
    assert trace.rows("SELECT period_ns, full_name FROM timer JOIN node USING (node_id)") == [
        (5_000_000, "/source")
    ]
    assert trace.rows("SELECT count(*), count(DISTINCT node_id) FROM service") == [(18, 3)]
    assert trace.rows(
        "SELECT kind, count(*), count(symbol) FROM callback GROUP BY ALL ORDER BY ALL"
    ) == [("service", 18, 18), ("subscription", 5, 5), ("timer", 1, 1)]
    assert trace.rows("SELECT * FROM client") == []
    assert trace.rows("SELECT hostname, uuid FROM host JOIN clock USING (clock_id)") == [
        ("chrisnux", "507ad184-257b-4164-b479-27ac6cfeb1fe")
    ]


@pytest.mark.thorough
def test_instances(trace: Ingested) -> None:
    assert trace.rows(
        "SELECT c.kind, count(*), count(i.end_ns) FROM callback_instance AS i "
        "JOIN callback AS c USING (callback_id) GROUP BY ALL ORDER BY ALL"
    ) == [("subscription", 4_034, 4_034), ("timer", 2_031, 2_031)]
    assert trace.rows(
        "SELECT topic_name, count(*) FROM publication JOIN publisher USING (publisher_id) "
        "WHERE rcl_ns IS NOT NULL GROUP BY ALL ORDER BY ALL"
    ) == [("/parameter_events", 15), ("/rosout", 2_029), ("/topic_a", 2_031), ("/topic_b", 1_986)]
    assert trace.rows("SELECT count(*) FROM publication WHERE rcl_ns IS NOT NULL") == [(6_061,)]
    assert trace.rows(
        "SELECT topic_name, method, count(*) FROM take JOIN subscription USING (subscription_id) "
        "GROUP BY ALL ORDER BY ALL"
    ) == [("/parameter_events", "rmw", 22), ("/topic_a", "rmw", 1_986), ("/topic_b", "rmw", 2_026)]
    assert trace.rows("SELECT count(*) FROM callback_instance WHERE take_id IS NOT NULL") == [
        (4_034,)
    ]


@pytest.mark.thorough
def test_links(trace: Ingested) -> None:
    assert trace.rows(
        "SELECT topic_name, method, candidate_count, count(*) FROM link_transport "
        "JOIN publication USING (publication_id) JOIN publisher USING (publisher_id) "
        "GROUP BY ALL ORDER BY ALL"
    ) == [
        ("/parameter_events", "exact", 1, 22),
        ("/topic_a", "exact", 1, 1_986),
        ("/topic_b", "exact", 1, 1_986),
    ]
    assert trace.rows(
        "SELECT topic_name, count(*), min(t.taken_ns) > (SELECT p.last_seen_ns FROM process AS p "
        "WHERE p.pid = 427932) FROM take AS t ANTI JOIN link_transport AS l USING (take_id) "
        "JOIN subscription USING (subscription_id) GROUP BY ALL"
    ) == [("/topic_b", 40, True)]
    assert trace.rows(
        "SELECT coalesce(s.topic_name, 'timer'), u.topic_name, count(*) FROM link_causal AS l "
        "JOIN callback_instance AS i USING (callback_instance_id) "
        "LEFT JOIN take AS t ON i.take_id = t.take_id "
        "LEFT JOIN subscription AS s ON t.subscription_id = s.subscription_id "
        "JOIN publication AS b USING (publication_id) "
        "JOIN publisher AS u ON b.publisher_id = u.publisher_id "
        "WHERE NOT u.is_internal GROUP BY ALL ORDER BY ALL"
    ) == [("/topic_a", "/topic_b", 1_986), ("timer", "/topic_a", 2_031)]


@pytest.mark.thorough
def test_flows(trace: Ingested) -> None:
    """2,031 roots: what became of each, and how long those took that arrived."""
    assert trace.rows(
        f"SELECT e.status, count(*) FROM {FLOWS} WHERE {MAIN_PATH} GROUP BY ALL ORDER BY ALL"
    ) == [("not_connected", 45), ("reached", 1_986)]
    assert trace.rows(
        f"SELECT count(*) FILTER (e.root_ns < first), count(*) FILTER (e.root_ns > last) "
        f"FROM (SELECT *, min(root_ns) FILTER (status = 'reached') OVER () AS first, "
        f"max(root_ns) FILTER (status = 'reached') OVER () AS last "
        f"FROM {FLOWS} WHERE {MAIN_PATH}) AS e WHERE e.status = 'not_connected'"
    ) == [(5, 40)]
    assert trace.rows(
        "SELECT min(latency_ns), quantile_disc(latency_ns, 0.5), max(latency_ns) "
        f"FROM {FLOWS} WHERE {MAIN_PATH} AND status = 'reached'"
    ) == [(131_601, 562_411, 45_601_667)]


@pytest.mark.thorough
def test_one_flow_to_the_nanosecond(trace: Ingested) -> None:
    """Forward from one timer callback; messages of the logger aside."""
    start = 1_649_361_413_615_271_699
    ((root,),) = trace.rows(
        f"SELECT callback_instance_id FROM callback_instance WHERE start_ns = {start}"
    )
    assert trace.rows(
        "SELECT f.kind, coalesce(i.start_ns, b.rclcpp_ns, t.taken_ns) - "
        f"1649361413000000000 FROM flow_forward('callback_instance', {root}) AS f "
        "LEFT JOIN callback_instance AS i "
        "ON f.kind = 'callback_instance' AND f.id = i.callback_instance_id "
        "LEFT JOIN publication AS b ON f.kind = 'publication' AND f.id = b.publication_id "
        "LEFT JOIN publisher AS u ON b.publisher_id = u.publisher_id "
        "LEFT JOIN take AS t ON f.kind = 'take' AND f.id = t.take_id "
        "WHERE NOT coalesce(u.is_internal, false) ORDER BY 2"
    ) == [
        ("callback_instance", 615_271_699),
        ("publication", 615_281_681),
        ("take", 615_630_799),
        ("callback_instance", 615_652_311),
        ("publication", 615_663_731),
        ("take", 616_054_112),
        ("callback_instance", 616_076_040),
    ]
    assert trace.rows(
        "SELECT b.dds_ns, b.source_timestamp_ns, i.end_ns FROM link_causal AS l "
        "JOIN publication AS b USING (publication_id) "
        "JOIN callback_instance AS i USING (callback_instance_id) "
        f"JOIN publisher AS u USING (publisher_id) WHERE i.start_ns = {start} "
        "AND NOT u.is_internal"
    ) == [
        (
            1_649_361_413_615_319_247,
            1_649_361_413_615_314_931,
            1_649_361_413_615_453_553,
        )
    ]


@pytest.mark.thorough
def test_executors(trace: Ingested) -> None:
    """For Trace Compass the last state of a thread lasts until the last event of all."""
    assert trace.rows(
        "SELECT p.pid, e.state, count(*), "
        "sum(coalesce(e.end_ns, (SELECT max(last_seen_ns) FROM process)) - e.start_ns)::BIGINT "
        "FROM executor_state AS e JOIN thread AS t USING (thread_id) "
        "JOIN process AS p ON t.process_id = p.process_id GROUP BY ALL ORDER BY ALL"
    ) == [
        (427_930, "execute", 2_040, 198_354_706),
        (427_930, "process", 8_153, 37_087_110),
        (427_930, "wait", 4_077, 9_929_960_352),
        (427_932, "execute", 1_995, 262_780_034),
        (427_932, "process", 7_949, 30_763_771),
        (427_932, "wait", 3_975, 9_869_544_695),
        (427_934, "execute", 2_030, 295_198_116),
        (427_934, "process", 8_087, 32_052_357),
        (427_934, "wait", 4_044, 9_823_340_097),
    ]
    assert trace.rows(
        "SELECT pid, round(sum(end_ns - start_ns) / 1e6, 1) FROM callback_instance "
        "JOIN process USING (process_id) GROUP BY pid ORDER BY pid"
    ) == [(427_930, 176.5), (427_932, 159.7), (427_934, 189.2)]
    assert trace.rows("SELECT kind, count(*) FROM executor GROUP BY ALL") == [
        ("single_threaded", 3)
    ]


@pytest.mark.thorough
def test_nothing_is_wrong_with_the_input(trace: Ingested) -> None:
    assert trace.rows("SELECT * FROM gap") == []
    assert trace.rows("SELECT * FROM finding WHERE severity = 'error'") == []
