"""Publications inside a run of a callback."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
LINKS = (
    "SELECT b.source_timestamp_ns, i.start_ns, l.kind, l.wait_ns FROM publication AS b "
    "LEFT JOIN link_causal AS l USING (publication_id) "
    "LEFT JOIN callback_instance AS i USING (callback_instance_id) ORDER BY b.publication_id"
)


def test_inside_and_outside(system: RosSystem, analyse: Analyse) -> None:
    other = Thread(100, 101)
    system.publish(MAIN, 0x10, 1)
    start = system.start(MAIN, 0xC1)
    system.publish(MAIN, 0x10, 2)
    system.publish(other, 0x10, 3)
    system.publish(MAIN, 0x10, 4)
    system.end(MAIN, 0xC1)
    system.publish(MAIN, 0x10, 5)
    assert analyse(system).rows(LINKS) == [
        (1, None, None, None),
        (2, start, "direct", 0),
        (3, None, None, None),
        (4, start, "direct", 0),
        (5, None, None, None),
    ]


def test_the_innermost_run_counts(system: RosSystem, analyse: Analyse) -> None:
    """Also behind a nested run that has ended, and between two nested ones."""
    outer = system.start(MAIN, 0xC1)
    system.publish(MAIN, 0x10, 1)
    first = system.start(MAIN, 0xC2)
    system.publish(MAIN, 0x10, 2)
    system.end(MAIN, 0xC2)
    system.publish(MAIN, 0x10, 3)
    second = system.start(MAIN, 0xC2)
    inner = system.start(MAIN, 0xC1)
    system.publish(MAIN, 0x10, 4)
    system.end(MAIN, 0xC1)
    system.publish(MAIN, 0x10, 5)
    system.end(MAIN, 0xC2)
    system.publish(MAIN, 0x10, 6)
    system.end(MAIN, 0xC1)
    runs = [(stamp, start) for stamp, start, _, _ in analyse(system).rows(LINKS)]
    assert runs == [(1, outer), (2, first), (3, outer), (4, inner), (5, second), (6, outer)]


@pytest.mark.thorough
def test_in_a_run_that_never_ended(system: RosSystem, analyse: Analyse) -> None:
    """It links its publications until something comes that cannot be inside."""
    start = system.start(MAIN, 0xC1)
    system.publish(MAIN, 0x10, 1)
    system.ready(MAIN)
    system.publish(MAIN, 0x10, 2)
    last = system.start(MAIN, 0xC1)
    system.publish(MAIN, 0x10, 3)
    runs = [(stamp, run) for stamp, run, _, _ in analyse(system).rows(LINKS)]
    assert runs == [(1, start), (2, None), (3, last)]


def test_a_nested_run_whose_end_is_lost_may_have_gone_on(
    system: RosSystem, analyse: Analyse
) -> None:
    outer = system.start(MAIN, 0xC1)
    inner = system.start(MAIN, 0xC2)
    system.publish(MAIN, 0x10, 1)
    system.ready(MAIN)
    system.publish(MAIN, 0x10, 2)
    nested = system.start(MAIN, 0xC2)
    system.publish(MAIN, 0x10, 3)
    system.end(MAIN, 0xC2)
    system.publish(MAIN, 0x10, 4)
    system.end(MAIN, 0xC1)
    assert analyse(system).rows(
        "SELECT b.source_timestamp_ns, i.start_ns, l.candidate_count FROM link_causal AS l "
        "JOIN publication AS b USING (publication_id) "
        "JOIN callback_instance AS i USING (callback_instance_id) ORDER BY b.publication_id"
    ) == [(1, inner, 1), (2, outer, 2), (3, nested, 1), (4, outer, 1)]


def test_not_across_a_gap(system: RosSystem, analyse: Analyse) -> None:
    start = system.start(MAIN, 0xC1)
    system.publish(MAIN, 0x10, 1)
    system.lose()
    system.publish(MAIN, 0x10, 2)
    system.end(MAIN, 0xC1)
    runs = [(stamp, run) for stamp, run, _, _ in analyse(system).rows(LINKS)]
    assert runs == [(1, start), (2, None)]


def test_order_decides_where_times_are_equal(system: RosSystem, analyse: Analyse) -> None:
    """Everything in one nanosecond: a publication before, inside, nested and behind."""
    steps = ["publish", "start", "publish", "start", "publish", "end", "publish", "end", "publish"]
    callbacks = {"start": iter((0xC1, 0xC2)), "end": iter((0xC2, 0xC1))}
    for stamp, step in enumerate(steps, start=1):
        if step == "publish":
            fields = {"publisher_handle": 0x10, "message": stamp}
            system.add("ros2:rcl_publish", MAIN, ts=5_000, **fields)
            fields = {"rmw_publisher_handle": 0x1010, "message": stamp, "timestamp": stamp}
            system.add("ros2:rmw_publish", MAIN, ts=5_000, **fields)
        else:
            fields = {"callback": next(callbacks[step])}
            if step == "start":
                fields["is_intra_process"] = 0
            system.add(f"ros2:callback_{step}", MAIN, ts=5_000, **fields)
    assert analyse(system).rows(
        "SELECT b.source_timestamp_ns, i.callback_instance_id FROM publication AS b "
        "LEFT JOIN link_causal AS l USING (publication_id) "
        "LEFT JOIN callback_instance AS i USING (callback_instance_id) ORDER BY 1"
    ) == [(1, None), (3, 1), (5, 2), (7, 1), (9, None)]


def test_all_layers_of_a_call_are_one_effect(system: RosSystem, analyse: Analyse) -> None:
    """The call counts where it began."""
    system.publisher(MAIN, 0x10, "/chatter")
    system.subscription(MAIN, 0x11, "/input", callback=0xC1)
    system.take(MAIN, 0x11, 777)
    system.start(MAIN, 0xC1)
    system.add("ros2:rclcpp_intra_publish", MAIN, publisher_handle=0x10, message=0xD)
    system.publish(MAIN, 0x10, 1)
    system.end(MAIN, 0xC1)
    assert analyse(system).rows(
        "SELECT take_id, subscription_id, publication_id, publisher_id, candidate_count, "
        "is_loss_affected FROM store.link_causal"
    ) == [(1, 1, 1, 1, 1, False)]
