"""Which message a callback ran with, and what a callback belongs to."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
STAMPS = (
    "SELECT i.start_ns, t.source_timestamp_ns, t.method FROM callback_instance AS i "
    "LEFT JOIN take AS t USING (take_id) ORDER BY i.callback_instance_id"
)


def test_the_callback_directly_behind_the_take(system: RosSystem, analyse: Analyse) -> None:
    """On its own thread only; an event between them is enough to know nothing."""
    other = Thread(100, 101)
    system.subscription(MAIN, 0x10, "/chatter", callback=0xCB)
    system.ready(other)
    system.take(MAIN, 0x10, 777)
    elsewhere = system.start(other, 0xCB)
    direct = system.start(MAIN, 0xCB)
    system.end(MAIN, 0xCB)
    system.end(other, 0xCB)
    system.take(MAIN, 0x10, 778)
    system.ready(MAIN)
    late = system.start(MAIN, 0xCB)
    system.end(MAIN, 0xCB)
    assert analyse(system).rows(STAMPS) == [
        (elsewhere, None, "callback_only"),
        (direct, 777, "rmw"),
        (late, None, "callback_only"),
    ]


def test_what_the_executor_said_in_between_stands_beside_a_loss_elsewhere(
    system: RosSystem, analyse: Analyse
) -> None:
    """A copy that leads to no callback, then a timer; other CPUs lose events all the while."""
    system.take(MAIN, 0x10, 777)
    system.ready(MAIN)
    system.execute(MAIN, 0x20)
    late = system.start(MAIN, 0xDD)
    system.end(MAIN, 0xDD)
    system.take(MAIN, 0x10, 778)
    direct = system.start(MAIN, 0xCB)
    end = system.end(MAIN, 0xCB)
    system.add_packet(0, end)
    system.add_packet(0, end, last_event=1, discarded=9, cpu=1)
    model = analyse(system)
    assert model.rows(STAMPS) == [(late, None, None), (direct, 778, "rmw")]
    # What the executor named before it, a loss may hide: nothing says that it is a timer.
    assert model.column("SELECT kind FROM callback ORDER BY callback_handle") == [
        "subscription",
        "unknown",
    ]


@pytest.mark.thorough
def test_initialisation_between_them_does_not_matter(system: RosSystem, analyse: Analyse) -> None:
    """Nor do events of providers that say nothing about the call."""
    system.subscription(MAIN, 0x10, "/chatter", callback=0xCB)
    system.take(MAIN, 0x10, 777)
    system.add("ros2_caret:on_data_available", MAIN, source_stamp=1)
    start = system.start(MAIN, 0xCB)
    assert analyse(system).rows(STAMPS) == [(start, 777, "rmw")]


def test_an_executor_may_take_a_batch_first(system: RosSystem, analyse: Analyse) -> None:
    """As that of r2r does: each callback has the oldest message of its own subscription."""
    for handle, topic, callback in ((0x10, "/a", 0xCA), (0x11, "/b", 0xCB)):
        system.subscription(MAIN, handle, topic, callback=callback)
    called = []
    for handle, stamp in ((0x10, 1), (0x11, 2), (0x10, 3)):
        system.take(MAIN, handle, stamp)
    for callback in (0xCB, 0xCA, 0xCA, 0xCA):
        called.append(system.start(MAIN, callback))
        system.end(MAIN, callback)
    system.take(MAIN, 0x10, 4)
    system.take(MAIN, 0x11, 5)
    called.append(system.start(MAIN, 0xCA))
    system.end(MAIN, 0xCA)
    system.take(MAIN, 0x10, 6)
    # An executor that says what it does next does not keep messages for later.
    system.ready(MAIN)
    called.append(system.start(MAIN, 0xCB))
    assert analyse(system).column(
        "SELECT t.source_timestamp_ns FROM callback_instance AS i LEFT JOIN take AS t"
        " USING (take_id) ORDER BY i.callback_instance_id"
    ) == [2, 1, 3, None, 4, None]
    assert len(called) == 6


def test_a_take_is_not_for_the_callback_of_another_subscription(
    system: RosSystem, analyse: Analyse
) -> None:
    system.subscription(MAIN, 0x10, "/chatter", callback=0xCB)
    system.subscription(MAIN, 0x11, "/other", callback=0xCC)
    system.take(MAIN, 0x10, 777)
    start = system.start(MAIN, 0xCC)
    system.end(MAIN, 0xCC)
    model = analyse(system)
    assert model.rows(STAMPS) == [(start, None, "callback_only")]
    assert model.rows("SELECT method, subscription_id FROM take ORDER BY take_id") == [
        ("rmw", 1),
        ("callback_only", 2),
    ]


@pytest.mark.thorough
def test_a_take_is_not_for_a_timer(system: RosSystem, analyse: Analyse) -> None:
    system.subscription(MAIN, 0x10, "/chatter", callback=0xCB)
    system.timer(MAIN, 0x20, 0xDD)
    system.take(MAIN, 0x10, 777)
    start = system.start(MAIN, 0xDD)
    assert analyse(system).rows(STAMPS) == [(start, None, None)]


def test_an_intra_process_callback_takes_from_the_buffer_only(
    system: RosSystem, analyse: Analyse
) -> None:
    """The copy that came through the middleware is a take without a callback."""
    system.subscription(MAIN, 0x10, "/chatter")
    system.buffer(MAIN, 0xB1, 0x5B)
    system.subscription_callback(MAIN, 0x5B, 0xC1)
    system.add("ros2:rclcpp_subscription_init", MAIN, subscription_handle=0x10, subscription=0x5B)
    system.add("ros2:rclcpp_subscription_init", MAIN, subscription_handle=0x10, subscription=0x5C)
    system.subscription_callback(MAIN, 0x5C, 0xC2)
    system.add("ros2:rclcpp_ring_buffer_dequeue", MAIN, buffer=0xB1, index=0, size=0)
    dequeued = system.start(MAIN, 0xC1, intra=True)
    system.end(MAIN, 0xC1)
    system.take(MAIN, 0x10, 777)
    copied = system.start(MAIN, 0xC1, intra=True)
    system.end(MAIN, 0xC1)
    system.take(MAIN, 0x10, 778)
    inter = system.start(MAIN, 0xC2)
    system.end(MAIN, 0xC2)
    system.add("ros2:rclcpp_ring_buffer_dequeue", MAIN, buffer=0xB1, index=0, size=0)
    flagged = system.start(MAIN, 0xC2)
    model = analyse(system)
    assert model.rows(STAMPS) == [
        (dequeued, None, "ring_buffer"),
        (copied, None, "callback_only"),
        (inter, 778, "rmw"),
        (flagged, None, "callback_only"),
    ]
    assert model.rows("SELECT DISTINCT subscription_id FROM take") == [(1,)]
    assert model.rows("SELECT callback_handle, kind, subscription_id FROM callback ORDER BY 1") == [
        (0xC1, "subscription", 1),
        (0xC2, "subscription", 1),
    ]


def test_nothing_is_bound_across_a_gap(system: RosSystem, analyse: Analyse) -> None:
    system.subscription(MAIN, 0x10, "/chatter", callback=0xCB)
    system.take(MAIN, 0x10, 777)
    system.lose()
    start = system.start(MAIN, 0xCB)
    assert analyse(system).rows(STAMPS) == [(start, None, "callback_only")]


def test_a_callback_never_initialised_learns_its_subscription(
    system: RosSystem, analyse: Analyse
) -> None:
    """From the takes that it ran with, the majority."""
    for handle in (0x10, 0x11, 0x12):
        system.subscription(MAIN, handle, f"/{handle}")
    for handle in (0x10, 0x11, 0x12, 0x11):
        system.take(MAIN, handle, 777)
        system.start(MAIN, 0xCB)
        system.end(MAIN, 0xCB)
    system.start(MAIN, 0xDD)
    system.end(MAIN, 0xDD)
    model = analyse(system)
    assert model.rows("SELECT callback_handle, kind, subscription_id FROM callback ORDER BY 1") == [
        (0xCB, "subscription", 2),
        (0xDD, "unknown", None),
    ]
    assert model.value("SELECT count(*) FROM callback_instance WHERE take_id IS NOT NULL") == 4


@pytest.mark.thorough
def test_everything_is_unknown_in_a_trace_that_starts_late(
    system: RosSystem, analyse: Analyse
) -> None:
    """Handles without initialisation still bind, by the order of events alone."""
    system.take(MAIN, 0x10, 777)
    start = system.start(MAIN, 0xCB)
    system.end(MAIN, 0xCB)
    model = analyse(system)
    assert model.rows(STAMPS) == [(start, 777, "rmw")]
    assert model.rows(
        "SELECT kind, s.is_inferred FROM callback JOIN subscription AS s USING (subscription_id)"
    ) == [("subscription", True)]


@pytest.mark.thorough
def test_an_address_is_that_of_the_callback_added_last(system: RosSystem, analyse: Analyse) -> None:
    system.timer(MAIN, 0x20, 0xCB)
    system.start(MAIN, 0xCB)
    system.end(MAIN, 0xCB)
    system.subscription(MAIN, 0x10, "/chatter", callback=0xCB)
    system.take(MAIN, 0x10, 777)
    system.start(MAIN, 0xCB)
    system.end(MAIN, 0xCB)
    assert analyse(system).rows(
        "SELECT c.kind, i.take_id FROM callback_instance AS i JOIN callback AS c "
        "USING (callback_id) ORDER BY i.callback_instance_id"
    ) == [("timer", None), ("subscription", 1)]


def test_symbols(system: RosSystem, analyse: Analyse) -> None:
    """Three texts mean that there is none; a callback only registered belongs to nothing."""
    for number, symbol in enumerate(("run()", "UNKNOWN", "UNKNOWN_demangling_failed", "(null)")):
        system.add("ros2:rcl_timer_init", MAIN, timer_handle=0x20 + number, period=1)
        system.add(
            "ros2:rclcpp_timer_callback_added",
            MAIN,
            timer_handle=0x20 + number,
            callback=0xC0 + number,
        )
        system.add("ros2:rclcpp_callback_register", MAIN, callback=0xC0 + number, symbol=symbol)
    system.add("ros2:rclcpp_callback_register", MAIN, callback=0xD0, symbol="lonely()")
    assert analyse(system).rows(
        "SELECT callback_handle, kind, symbol FROM callback ORDER BY 1"
    ) == [
        (0xC0, "timer", "run()"),
        (0xC1, "timer", None),
        (0xC2, "timer", None),
        (0xC3, "timer", None),
        (0xD0, "unknown", "lonely()"),
    ]


def test_a_service_callback(system: RosSystem, analyse: Analyse) -> None:
    system.node(MAIN, 0x1, "server")
    system.add(
        "ros2:rcl_service_init",
        MAIN,
        service_handle=0x30,
        node_handle=0x1,
        rmw_service_handle=0x31,
        service_name="/add",
    )
    system.add("ros2:rclcpp_service_callback_added", MAIN, service_handle=0x30, callback=0xCE)
    start = system.start(MAIN, 0xCE)
    model = analyse(system)
    assert model.rows(
        "SELECT c.kind, s.service_name, n.full_name FROM callback AS c JOIN service AS s "
        "USING (service_id) JOIN node AS n ON c.node_id = n.node_id"
    ) == [("service", "/add", "/server")]
    assert model.rows(STAMPS) == [(start, None, None)]
