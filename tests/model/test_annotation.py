"""Declared indirect links: what their handles mean."""

from __future__ import annotations

import pytest
from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(100)


def annotations(analysis: Analysis) -> list[tuple[str, list[str], list[str]]]:
    """Kind, topics of the inputs and of the outputs ('?': not known), in order of identity."""
    return [
        (kind, inputs or [], outputs or [])
        for kind, inputs, outputs in analysis.rows(
            "SELECT a.kind, (SELECT list(coalesce(s.topic_name, '?') ORDER BY subscription_id) "
            "FROM annotation_input AS i JOIN subscription AS s USING (subscription_id) "
            "WHERE i.annotation_id = a.annotation_id), "
            "(SELECT list(coalesce(p.topic_name, '?') ORDER BY publisher_id) "
            "FROM annotation_output AS o JOIN publisher AS p USING (publisher_id) "
            "WHERE o.annotation_id = a.annotation_id) "
            "FROM annotation AS a WHERE a.source = 'trace' ORDER BY a.annotation_id"
        )
    ]


def findings(analysis: Analysis) -> list[tuple[str, int]]:
    return analysis.rows(
        "SELECT name, count FROM finding WHERE name LIKE '%annotation%' ORDER BY ALL"
    )


def test_inputs_and_outputs_by_their_rcl_handles(system: RosSystem, analyse: Analyse) -> None:
    system.subscription(MAIN, 0x11, "/a", callback=0xC1)
    system.subscription(MAIN, 0x12, "/b", callback=0xC2)
    system.publisher(MAIN, 0x21, "/c")
    system.publisher(MAIN, 0x22, "/d")
    system.annotate(MAIN, "periodic_async", [0x12, 0x11], [0x21, 0x22])
    system.annotate(MAIN, "partial_sync", [0x11], [0x22])
    analysis = analyse(system)
    assert annotations(analysis) == [
        ("periodic_async", ["/a", "/b"], ["/c", "/d"]),
        ("partial_sync", ["/a"], ["/d"]),
    ]
    assert findings(analysis) == [("contradictory_annotations", 1)]


def test_repeated_equal_annotations_are_one(system: RosSystem, analyse: Analyse) -> None:
    """Whatever the order of the handles; another kind or process is another annotation."""
    other = Thread(200)
    for thread in (MAIN, other):
        system.subscription(thread, 0x11, "/a", callback=0xC1)
        system.subscription(thread, 0x12, "/b", callback=0xC2)
        system.publisher(thread, 0x21, "/c")
        system.annotate(thread, "periodic_async", [0x11, 0x12], [0x21])
        system.annotate(thread, "periodic_async", [0x12, 0x11, 0x12], [0x21])
        system.annotate(thread, "partial_sync", [0x11, 0x12], [0x21])
    analysis = analyse(system)
    kinds = [kind for kind, _, _ in annotations(analysis)]
    assert kinds == ["periodic_async", "partial_sync"] * 2
    assert analysis.column("SELECT process_id FROM annotation ORDER BY annotation_id") == [
        1,
        1,
        2,
        2,
    ]


def test_handles_mean_what_they_meant_then(system: RosSystem, analyse: Analyse) -> None:
    system.subscription(MAIN, 0x11, "/old", callback=0xC1)
    system.publisher(MAIN, 0x21, "/out")
    system.annotate(MAIN, "periodic_async", [0x11], [0x21])
    system.subscription(MAIN, 0x11, "/new", callback=0xC2)
    system.annotate(MAIN, "periodic_async", [0x11], [0x21])
    assert annotations(analyse(system)) == [
        ("periodic_async", ["/old"], ["/out"]),
        ("periodic_async", ["/new"], ["/out"]),
    ]


@pytest.mark.thorough
def test_objects_that_were_never_initialised(system: RosSystem, analyse: Analyse) -> None:
    """A publisher is known by what it published, a subscription by its callback's takes."""
    system.add("ros2:rclcpp_subscription_init", MAIN, subscription_handle=0x11, subscription=0x2011)
    system.subscription_callback(MAIN, 0x2011, 0xC1)
    system.annotate(MAIN, "periodic_async", [0x11, 0x99], [0x21, 0x98])
    system.take(MAIN, 0x11, 777)
    system.start(MAIN, 0xC1)
    system.end(MAIN, 0xC1)
    published = system.publish(MAIN, 0x21, 888, rmw=0)
    analysis = analyse(system)
    assert annotations(analysis) == [("periodic_async", ["?"], ["?"])]
    assert findings(analysis) == [("unknown_annotation_handle", 2)]
    assert analysis.rows(
        "SELECT b.start_ns, l.kind, i.take_id FROM link_causal AS l "
        "JOIN publication AS b USING (publication_id) "
        "JOIN callback_instance AS i USING (callback_instance_id)"
    ) == [(published, "periodic_async", 1)]


@pytest.mark.thorough
def test_annotations_without_anything_known(system: RosSystem, analyse: Analyse) -> None:
    """They are rows, and two that name different handles are two."""
    system.annotate(MAIN, "partial_sync", [0x11], [0x21])
    system.annotate(MAIN, "partial_sync", [0x12], [0x21])
    system.annotate(MAIN, "partial_sync", [0x12], [0x21])
    system.annotate(MAIN, "periodic_async", [], [])
    analysis = analyse(system)
    assert annotations(analysis) == [
        ("partial_sync", [], []),
        ("partial_sync", [], []),
        ("periodic_async", [], []),
    ]
    assert findings(analysis) == [("unknown_annotation_handle", 4)]
