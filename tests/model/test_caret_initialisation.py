"""Initialisation that CARET reports again, as a recording that starts late shows it."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RMW, RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
RECORDER = Thread(100, 109, "caret")


def again(system: RosSystem, name: str, at: int, **fields: object) -> None:
    system.add(f"ros2_caret:{name}", RECORDER, init_timestamp=at, **fields)


def report(system: RosSystem, topic: str = "/a", at: int = 20) -> None:
    """A node with a publisher, reported by kind, not in the order in which they were made."""
    again(
        system,
        "rcl_publisher_init",
        at,
        publisher_handle=0x10,
        node_handle=0x1,
        rmw_publisher_handle=0x10 + RMW,
        topic_name=topic,
        queue_depth=10,
    )
    again(system, "rcl_node_init", 10, node_handle=0x1, rmw_handle=0, node_name="n", namespace="/")


def objects(system: RosSystem, analyse: Analyse) -> list[tuple[object, ...]]:
    return analyse(system).rows(
        "SELECT p.topic_name, n.full_name, p.is_inferred, b.source_timestamp_ns "
        "FROM publication AS b LEFT JOIN publisher AS p USING (publisher_id) "
        "LEFT JOIN node AS n ON p.node_id = n.node_id ORDER BY b.publication_id"
    )


def test_also_what_happens_before_the_report_is_known(system: RosSystem, analyse: Analyse) -> None:
    system.publish(MAIN, 0x10, 1)
    report(system)
    system.publish(MAIN, 0x10, 2)
    assert objects(system, analyse) == [("/a", "/n", False, 1), ("/a", "/n", False, 2)]


def test_what_was_recorded_when_it_happened_is_not_doubled(
    system: RosSystem, analyse: Analyse
) -> None:
    system.node(MAIN, 0x1, "n")
    system.publisher(MAIN, 0x10, "/a")
    system.publish(MAIN, 0x10, 1)
    report(system)
    report(system)
    model = analyse(system)
    assert model.value("SELECT count(*) FROM publisher") == 1
    assert model.value("SELECT count(*) FROM process") == 1


@pytest.mark.thorough
def test_reported_twice_is_one_object(system: RosSystem, analyse: Analyse) -> None:
    report(system)
    report(system)
    system.publish(MAIN, 0x10, 1)
    assert objects(system, analyse) == [("/a", "/n", False, 1)]
    assert analyse(system).value("SELECT count(*) FROM publisher") == 1


def test_the_later_of_two_objects_at_one_address_counts(
    system: RosSystem, analyse: Analyse
) -> None:
    report(system, "/new", at=30)
    report(system, "/old", at=20)
    system.publish(MAIN, 0x10, 1)
    assert [row[0] for row in objects(system, analyse)] == ["/new"]
