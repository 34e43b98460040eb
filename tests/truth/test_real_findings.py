"""What is said about recordings of real ROS 2: each sentence true, and none missing."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from support.fates import FATES
from support.ingested import Ingested
from support.thorough import few

from msgflow.db.finding import broken_rules
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query

FINDINGS = """
SELECT name, regexp_replace(subject, '^/.*/real_[a-z]+/', ''), count, detail
FROM finding
WHERE severity <> 'info'
ORDER BY ALL
"""
_ROTATED = "ust/archives/20261124T070908+0000-20261124T070909+0000-3"
# Recordings, and the start of each sentence of msgflow check.
EXPECTED: dict[str, list[tuple[str, str | None, int]]] = {
    # What /cacher and /joiner keep, a line for each topic.
    "real_cache": [
        ("dead_end", "/cacher", 116),
        ("dead_end", "/cacher", 176),
        ("dead_end", "/joiner", 176),
    ],
    "real_container": [
        ("busy_waiting", "component_conta 7031 on vm", 22_700),
        ("dead_end", "/fusion", 191),
    ],
    "real_events": [("dead_end", "/filter", 180)],
    "real_filters": [("dead_end", "/approx", 96), ("dead_end", "/exact", 84)],
    "real_intra": [],
    "real_jazzy_container": [
        ("busy_waiting", "component_conta 9529 on vm", 24_264),
        ("dead_end", "/fusion", 198),
    ],
    "real_jazzy_pipeline": [],
    "real_jazzy_services": [("missing_layer", "requests", 129)],
    "real_late": [
        ("eliminated_owner", "the input", 1),
        ("inferred_object", "callbacks", 3),
        ("inferred_object", "publishers", 2),
        ("inferred_object", "subscriptions", 2),
        ("inferred_object", "timers", 1),
        ("started_late", "filter 13086 on vm", 3),
        ("started_late", "sink 13065 on vm", 2),
        ("started_late", "source 13107 on vm", 3),
        ("topic_unnamed", "[filter 13086] → [sink 13065]", 87),
        ("topic_unnamed", "[source 13107] → [filter 13086]", 88),
    ],
    "real_lifecycle": [],
    "real_overload": [],
    "real_pipeline": [],
    "real_py_mixed": [("process_without_rclcpp", "/filter_image (python3.11 20878 on vm)", 137)],
    "real_py_timer": [
        ("doubtful_answer", "/filter_timer", 288),
        ("process_without_rclcpp", "/filter_timer (python3.11 19963 on vm)", 437),
        ("process_without_rclcpp", "/sink2 (python3.11 19960 on vm)", 25),
        ("process_without_rclcpp", "/source (python3.11 19964 on vm)", 142),
    ],
    "real_reference": [
        ("busy_waiting", "perception 18109 on vm", 38_747),
        ("dead_end", "/behaviour", 56),
        ("dead_end", "/behaviour", 114),
        ("dead_end", "/localizer", 231),
        ("dead_end", "/object_fusion", 49),
        ("dead_end", "/tracker", 58),
    ],
    "real_rotate": [
        ("discarded_events", f"{_ROTATED}/ust/uid/65534/64-bit", 12),
        ("unmatched_callback_end", f"{_ROTATED}/ust/uid/65534/64-bit", 2),
        ("unmatched_take", f"{_ROTATED}/ust/uid/65534/64-bit", 1),
    ],
    "real_services": [],
    "real_tiny": [
        ("busy_waiting", "perception 13811 on vm", 50_555),
        ("dead_end", "/behaviour", 53),
        ("dead_end", "/behaviour", 112),
        ("dead_end", "/localizer", 203),
        ("dead_end", "/points_fusion", 52),
        ("discarded_events", "ust/ust/uid/65534/64-bit", 30_685),
        ("eliminated_owner", "the input", 1),
        ("inferred_object", "callbacks", 3),
        ("inferred_object", "nodes", 1),
        ("inferred_object", "publishers", 3),
        ("inferred_object", "subscriptions", 2),
        ("inferred_object", "timers", 1),
        ("initialisation_lost", "perception 13811 on vm", 6),
        ("initialisation_lost", "sensing 13814 on vm", 4),
        ("topic_unnamed", "from [perception 13811]", 4),
        ("unmatched_callback_end", "ust/ust/uid/65534/64-bit", 23),
        ("unmatched_take", "ust/ust/uid/65534/64-bit", 2),
        ("unmatched_take", "ust/ust/uid/65534/64-bit", 15),
    ],
}


@pytest.mark.parametrize("name", few(EXPECTED, "real_container", "real_overload"))
def test_findings(recordings: Callable[[str], Ingested], name: str) -> None:
    found = recordings(name).rows(FINDINGS)
    assert [row[:3] for row in found] == EXPECTED[name], found


@pytest.mark.parametrize("name", few(EXPECTED, "real_container", "real_overload"))
def test_recordings_keep_every_rule(recordings: Callable[[str], Ingested], name: str) -> None:
    assert broken_rules(recordings(name).connection) == []


@pytest.mark.thorough
def test_services_of_a_managed_node(recordings: Callable[[str], Ingested]) -> None:
    """rclcpp has copies of them: the order tells which is which."""
    recording = recordings("real_lifecycle")
    assert recording.rows(
        "SELECT service_name, c.symbol LIKE '%LifecycleNodeInterfaceImpl%' "
        "FROM service AS s JOIN callback AS c USING (service_id) JOIN node AS n "
        "ON c.node_id = n.node_id AND s.node_id = n.node_id "
        "WHERE n.full_name = '/managed' AND service_name NOT LIKE '%parameter%' "
        "ORDER BY c.callback_id"
    ) == [
        ("/managed/get_type_description", False),
        ("/managed/change_state", True),
        ("/managed/get_state", True),
        ("/managed/get_available_states", True),
        ("/managed/get_available_transitions", True),
        ("/managed/get_transition_graph", True),
    ]


@pytest.mark.thorough
def test_deferred_responses_before_kilted(recordings: Callable[[str], Ingested]) -> None:
    """The callback of /outer has no end in the trace; the node says that it took 1.3 ms."""
    recording = recordings("real_jazzy_services")
    assert recording.rows(
        "SELECT s.service_name, i.is_end_inferred, count(*), "
        "median(i.end_ns - i.start_ns) BETWEEN 1_200_000 AND 1_400_000 "
        "FROM callback_instance AS i JOIN callback AS c USING (callback_id) "
        "JOIN service AS s USING (service_id) GROUP BY ALL ORDER BY ALL"
    ) == [("/inner", False, 73, False), ("/outer", True, 56, True)]


@pytest.mark.thorough
def test_a_join_that_the_other_input_triggers(recordings: Callable[[str], Ingested]) -> None:
    """After the first twelve, /rear_tf is always last: the node ends flows from /front."""
    recording = recordings("real_reference")
    counts = recording.rows(
        "SELECT e.status, count(*) FROM end_to_end([1], '/front', '/ground') AS e "
        "WHERE e.is_first IS NOT false GROUP BY ALL ORDER BY ALL"
    )
    assert counts == [("no_output", 46), ("not_connected", 1), ("reached", 12)]


def test_two_queries_say_the_same_of_the_same_messages(
    recordings: Callable[[str], Ingested],
) -> None:
    """Where a path has a queue that drops, its roots end as the messages on the topic do."""
    connection = recordings("real_overload").connection
    delivery = {
        (row["topic_name"], row["subscriber"]): row
        for row in run_query(connection, load_query("topics-delivery"), {}).to_arrow().to_pylist()
        if row["delivered"]
    }
    paths = {
        row["path"]: row
        for row in run_query(connection, load_query("e2e-latency"), {}).to_arrow().to_pylist()
    }
    sensor, fast, slow = (
        delivery[way] for way in (("/sensor", "/slow"), ("/fast", "/slow"), ("/slow_out", "/late"))
    )
    words = ("dropped", "lost", "not_connected", "unknown", "cut_by_recording")
    root = paths["/talker → /sensor → /slow"]
    expected = [438, 0, 13, 0, 1]
    assert [root[word] for word in words] == [sensor[word] for word in words] == expected
    assert (root["roots"], root["reached"]) == (sensor["published"], sensor["delivered"])
    assert root["reasons"] == sensor["reasons"]
    root = paths["/talker → /fast → /slow → /slow_out → /late"]
    both = [fast[word] + slow[word] for word in words]
    assert [root[word] for word in words] == both == [981, 0, 111, 0, 1]
    assert (root["reached"], root["no_output"]) == (slow["delivered"], 1)
    assert sum(root[word] for word in FATES) == root["roots"] == fast["published"]
