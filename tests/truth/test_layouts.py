"""Every layout gives the same objects, and the publications, takes and links that it can show."""

from __future__ import annotations

from pathlib import Path

import pytest
from scoring import compare_simulated
from support.ingested import Ingested, ingest_one
from support.thorough import few

from msgflow_sim import layouts, simulate

# Between rcl and DDS these have no event.

OBJECTS = {
    "node": (
        "SELECT full_name FROM node WHERE NOT is_inferred",
        [("/relay",), ("/sink",), ("/source",)],
    ),
    "publisher": (
        "SELECT n.full_name, topic_name FROM publisher JOIN node AS n USING (node_id) "
        "WHERE NOT is_internal",
        [("/relay", "/topic_b"), ("/source", "/topic_a")],
    ),
    "rosout": (
        "SELECT n.full_name FROM publisher JOIN node AS n USING (node_id) "
        "WHERE topic_name = '/rosout'",
        [("/relay",), ("/sink",), ("/source",)],
    ),
    "subscription": (
        "SELECT n.full_name, topic_name, kind FROM subscription JOIN node AS n USING (node_id) "
        "JOIN callback USING (subscription_id) WHERE NOT is_internal",
        [("/relay", "/topic_a", "subscription"), ("/sink", "/topic_b", "subscription")],
    ),
    "timer": (
        "SELECT n.full_name, period_ns, kind FROM timer JOIN callback USING (timer_id) "
        "LEFT JOIN node AS n ON timer.node_id = n.node_id",
        [("/source", 5_000_000, "timer")],
    ),
    "service": (
        "SELECT n.full_name, count(*) FROM service JOIN node AS n USING (node_id) GROUP BY ALL",
        [("/relay", 6), ("/sink", 6), ("/source", 6)],
    ),
}


# CARET leaves out events that the others are judged by: test_caret_arrival.py.
JUDGED = [name for name in layouts() if not name.endswith("-caret")]


@pytest.fixture(scope="module", params=few(JUDGED, "humble"))
def named(request, tmp_path_factory):
    """The pipeline in each layout: its name, truth, database file and the database."""
    directory: Path = tmp_path_factory.mktemp("layout")
    name: str = request.param
    simulation = simulate("pipeline", directory / "trace", factor=0.03, layout=name)
    path = directory / "run.duckdb"
    ingested: Ingested = ingest_one(simulation.directory, path)
    yield name, simulation, path, ingested
    ingested.connection.close()


@pytest.mark.parametrize("table", list(OBJECTS))
def test_objects(named, table):
    name, _, _, ingested = named
    sql, expected = OBJECTS[table]
    if table == "timer" and not layouts()[name].declares("ros2:rclcpp_timer_link_node"):
        # Foxy does not say whose timer it is.
        expected = [(None, *row[1:]) for row in expected]
    assert ingested.rows(f"{sql} ORDER BY ALL") == expected


def test_instances_and_links(named):
    _, simulation, path, _ = named
    scores, _ = compare_simulated(path, simulation.truth)
    assert {"publication", "take", "callback_instance", "direct", "transport"} <= {
        score.kind for score in scores
    }
    for score in scores:
        assert (score.wrong, score.repeated) == (0, 0), score
        assert score.missing == 0, score


@pytest.mark.thorough
def test_what_a_layout_cannot_show_is_not_asked_for(named):
    name, simulation, path, _ = named
    layout = layouts()[name]
    decided = {score.kind: score.decided for score in compare_simulated(path, simulation.truth)[0]}
    assert decided["callback_instance"] > 100
    assert (decided["publication"] > 100) is (name != "foxy")
    assert (decided["direct"] > 100) is (name != "foxy")
    assert (decided["take"] > 50) is layout.declares("ros2:rmw_take")
    assert (decided["transport"] > 50) is layout.declares("ros2:rmw_take")
