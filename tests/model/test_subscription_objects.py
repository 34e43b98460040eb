"""Two rclcpp objects on one rcl subscription, created in an order that looks backwards."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
CALLBACKS = (
    "SELECT callback_handle, s.topic_name FROM callback AS c "
    "LEFT JOIN subscription AS s USING (subscription_id) ORDER BY c.callback_id"
)


def construct(
    system: RosSystem,
    handle: int,
    topic: str,
    objects: tuple[int, int],
    callbacks: tuple[int, int],
    thread: Thread = MAIN,
) -> None:
    """A subscription with intra-process communication, as rclcpp makes it."""
    intra, inter = objects
    system.subscription(thread, handle, topic)
    system.buffer(thread, handle + 0xB000, intra)
    system.subscription_callback(thread, intra, callbacks[0])
    for pointer in objects:
        system.add(
            "ros2:rclcpp_subscription_init",
            thread,
            subscription_handle=handle,
            subscription=pointer,
        )
    system.subscription_callback(thread, inter, callbacks[1])


def test_a_callback_may_be_added_before_its_object_is_initialised(
    system: RosSystem, analyse: Analyse
) -> None:
    construct(system, 0x10, "/a", (0x51, 0x52), (0xC1, 0xC2))
    construct(system, 0x11, "/b", (0x53, 0x54), (0xC3, 0xC4))
    assert analyse(system).rows(CALLBACKS) == [
        (0xC1, "/a"),
        (0xC2, "/a"),
        (0xC3, "/b"),
        (0xC4, "/b"),
    ]


def test_an_address_used_again_is_the_new_object(system: RosSystem, analyse: Analyse) -> None:
    """The object of the same construction counts, not the one that was there before."""
    construct(system, 0x10, "/old", (0x51, 0x52), (0xC1, 0xC2))
    construct(system, 0x11, "/new", (0x51, 0x52), (0xC3, 0xC4))
    construct(system, 0x12, "/swapped", (0x52, 0x51), (0xC5, 0xC6))
    assert analyse(system).rows(CALLBACKS) == [
        (0xC1, "/old"),
        (0xC2, "/old"),
        (0xC3, "/new"),
        (0xC4, "/new"),
        (0xC5, "/swapped"),
        (0xC6, "/swapped"),
    ]


def test_constructions_on_two_threads_do_not_mix(system: RosSystem, analyse: Analyse) -> None:
    """The same addresses one after the other, a thread of its own for each."""
    construct(system, 0x10, "/a", (0x51, 0x52), (0xC1, 0xC2))
    construct(system, 0x11, "/b", (0x51, 0x52), (0xC3, 0xC4), Thread(100, 101))
    construct(system, 0x10, "/c", (0x51, 0x52), (0xC5, 0xC6), Thread(200))
    assert [topic for _, topic in analyse(system).rows(CALLBACKS)] == [
        "/a",
        "/a",
        "/b",
        "/b",
        "/c",
        "/c",
    ]


@pytest.mark.thorough
def test_a_buffer_used_again_belongs_to_the_new_subscription(
    system: RosSystem, analyse: Analyse
) -> None:
    """Buffers are read by the subscription that had them at that time."""
    construct(system, 0x10, "/old", (0x51, 0x52), (0xC1, 0xC2))
    dequeue = {"buffer": 0xB010, "index": 0, "size": 0}
    system.add("ros2:rclcpp_ring_buffer_dequeue", MAIN, **dequeue)
    construct(system, 0x10, "/new", (0x53, 0x54), (0xC3, 0xC4))
    system.add("ros2:rclcpp_ring_buffer_dequeue", MAIN, **dequeue)
    assert analyse(system).column(
        "SELECT topic_name FROM take JOIN subscription USING (subscription_id) ORDER BY take_id"
    ) == ["/old", "/new"]


def test_a_subscription_without_rclcpp_objects(system: RosSystem, analyse: Analyse) -> None:
    """rclpy, and generic subscriptions before Jazzy."""
    system.node(MAIN, 0x1, "listener")
    system.subscription(MAIN, 0x10, "/chatter")
    taken = system.take(MAIN, 0x10, 777, layers="rmw rcl")
    model = analyse(system)
    assert model.rows(
        "SELECT t.taken_ns, s.topic_name, n.full_name, s.queue_depth, s.is_internal "
        "FROM take AS t JOIN subscription AS s USING (subscription_id) "
        "JOIN node AS n ON s.node_id = n.node_id"
    ) == [(taken, "/chatter", "/listener", 10, False)]
    assert model.rows(CALLBACKS) == []


def test_a_callback_added_to_an_unknown_object_is_one_of_a_subscription(
    system: RosSystem, analyse: Analyse
) -> None:
    system.subscription_callback(MAIN, 0x51, 0xC1)
    assert analyse(system).rows(
        "SELECT callback_handle, kind, subscription_id, symbol FROM callback"
    ) == [(0xC1, "subscription", None, "fc1")]
