"""Messages that do not pass every layer, and stamps that do not tell them apart."""

from __future__ import annotations

import pytest

from msgflow_sim import simulate


def _names(recording, *pids):
    return {e.name.removeprefix("ros2:") for e in recording.events if e.pid in pids}


def test_python_has_neither_rclcpp_nor_callbacks(recordings):
    names = _names(recordings["python"], 1201, 1301)
    assert {"rcl_node_init", "rcl_publish", "rmw_publish", "rmw_take", "rcl_take"} < names
    assert not {name for name in names if "rclcpp" in name or "callback" in name}


def test_what_python_takes_is_the_cause_of_what_it_publishes(recordings):
    rows = recordings["python"].truth(
        "SELECT kind, count(*), count(take_id), count(callback_instance_id) FROM causal "
        "WHERE pid = 1201 GROUP BY kind"
    )
    ((kind, count, takes, callbacks),) = rows
    assert kind == "take_adjacent"
    assert count == takes > 50
    assert callbacks == 0


def test_kinds_of_publishers_pass_the_layers_of_jazzy(recordings):
    layers = dict(
        recordings["layers"].truth(
            "SELECT topic_name, list_distinct(list([rclcpp_ns IS NOT NULL, rmw_ns IS NOT NULL])) "
            "FROM publication WHERE pid = 1101 AND NOT is_internal GROUP BY ALL"
        )
    )
    assert layers == {
        "/typed": [[True, True]],
        "/generic": [[True, True]],
        "/loaned": [[True, True]],
        "/serialized": [[False, True]],
    }


def test_kinds_of_takes_pass_their_layers(recordings):
    rows = recordings["layers"].truth(
        "SELECT DISTINCT t.node, t.topic_name, t.method, rclcpp_ns IS NOT NULL, "
        "callback_instance_id IS NOT NULL FROM take t WHERE NOT is_internal "
        "AND t.node IN ('/special', '/waiting', '/polling') ORDER BY ALL"
    )
    assert rows == [
        ("/polling", "/typed", "rmw", True, False),
        ("/special", "/loaned", "callback_only", False, True),
        ("/special", "/serialized", "rmw", False, True),
        ("/waiting", "/generic", "rmw", True, False),
        ("/waiting", "/typed", "rmw", True, False),
    ]


def test_older_releases_do_not_trace_every_kind(tmp_path, read):
    recording = read(simulate("layers", tmp_path / "out", factor=0.1, layout="iron"))
    traced = recording.truth(
        "SELECT DISTINCT topic_name FROM publication WHERE pid = 1101 AND rmw_ns IS NOT NULL "
        "AND NOT is_internal"
    )
    assert traced == [("/typed",)]
    # They are delivered nevertheless.
    assert recording.truth(
        "SELECT count(*) > 5 FROM transport WHERE topic_name = '/generic' "
        "AND publication_rmw_ns IS NULL AND take_rmw_ns IS NOT NULL"
    ) == [(True,)]


@pytest.mark.thorough
def test_stamps_are_equal_on_one_topic_and_on_two(recordings):
    recording = recordings["equal_stamps"]
    twins = recording.truth(
        "SELECT a.topic_name = b.topic_name, count(*) FROM publication a JOIN publication b "
        "ON a.source_timestamp_ns = b.source_timestamp_ns "
        "AND a.publication_id < b.publication_id AND NOT a.is_internal AND NOT b.is_internal "
        "GROUP BY ALL ORDER BY ALL"
    )
    assert [is_same for is_same, _ in twins] == [False, True]
    assert all(count > 50 for _, count in twins)
    stamps = recording.truth("SELECT DISTINCT source_timestamp_ns % 4000000 FROM publication")
    assert stamps == [(0,)]
