"""What counts as a take: a message that was handed over, however it was."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import WRITER, RosSystem
from support.staged_events import STEP_NS, Thread

MAIN = Thread(100)
MIDDLEWARE = Thread(100, 109, "dds.udp")
TAKES = "SELECT taken_ns, method, source_timestamp_ns, subscription_id FROM take ORDER BY take_id"


@pytest.fixture
def listener(system: RosSystem) -> RosSystem:
    """A system with a subscription, id 1, and its callback 0xCB."""
    system.subscription(MAIN, 0x10, "/chatter", callback=0xCB)
    return system


def test_a_take_is_at_the_moment_of_its_rmw_layer(listener: RosSystem, analyse: Analyse) -> None:
    listener.execute(MAIN, 0x10)
    taken = listener.take(MAIN, 0x10, 777)
    assert analyse(listener).rows(TAKES) == [(taken, "rmw", 777, 1)]


def test_a_read_of_dds_belongs_to_its_take(listener: RosSystem, analyse: Analyse) -> None:
    """One that follows a failed read does too; the failed one is no take."""
    for taken in (0, 1):
        listener.add("dds:read", MAIN, reader=0x99, buffer=0xB)
        rmw = listener.take(MAIN, 0x10, 777, taken=taken, layers="rmw rcl"[: 3 + 4 * taken])
    listener.add("dds:read", MAIN, reader=0x99, buffer=0xB)
    assert analyse(listener).rows(TAKES) == [(rmw, "rmw", 777, 1)]


def test_a_failed_take_is_none(listener: RosSystem, analyse: Analyse) -> None:
    listener.take(MAIN, 0x10, 0, taken=0, layers="rmw")
    listener.take(MAIN, 0x10, 777, taken=0, layers="rmw")
    listener.take(MAIN, 0x10, 778)
    assert analyse(listener).column("SELECT source_timestamp_ns FROM take") == [778]


@pytest.mark.thorough
def test_a_failed_take_does_not_lend_its_stamp(listener: RosSystem, analyse: Analyse) -> None:
    """rclcpp_take comes even where nothing was taken."""
    listener.take(MAIN, 0x10, 777, taken=0, layers="rmw rclcpp")
    assert analyse(listener).rows(TAKES) == []


def test_takes_of_the_middleware_itself_are_none(listener: RosSystem, analyse: Analyse) -> None:
    """Its discovery reads ros_discovery_info; nothing above rmw sees that."""
    listener.take(MIDDLEWARE, 0x66, 776, layers="rmw")
    listener.take(MIDDLEWARE, 0x66, 0, layers="rmw")
    taken = listener.take(MAIN, 0x10, 777)
    model = analyse(listener)
    assert model.rows(TAKES) == [(taken, "rmw", 777, 1)]
    assert model.value("SELECT count(*) FROM subscription") == 1


def test_a_zero_stamp_is_unknown(listener: RosSystem, analyse: Analyse) -> None:
    taken = listener.take(MAIN, 0x10, 0)
    assert analyse(listener).rows(TAKES) == [(taken, "rmw", None, 1)]


def test_rmw_takes_count_where_no_rcl_take_is_traced(system: RosSystem, analyse: Analyse) -> None:
    system.subscription(MAIN, 0x10, "/chatter", callback=0xCB)
    taken = system.take(MAIN, 0x10, 777, layers="rmw")
    start = system.start(MAIN, 0xCB)
    model = analyse(system)
    assert model.rows(TAKES) == [(taken, "rmw", 777, 1)]
    assert model.rows("SELECT start_ns, take_id FROM callback_instance") == [(start, 1)]


@pytest.mark.thorough
def test_a_layer_with_another_message_is_no_part(listener: RosSystem, analyse: Analyse) -> None:
    """It is a take of its own, and little is known about it."""
    first = listener.take(MAIN, 0x10, 777, message=0xB, layers="rmw")
    second = listener.take(MAIN, 0x10, 0, message=0xBB, layers="rcl rclcpp")
    assert analyse(listener).rows(TAKES) == [
        (first, "rmw", 777, 1),
        (second, "rmw", None, None),
    ]


def test_the_first_event_of_a_thread_begins_its_take(system: RosSystem, analyse: Analyse) -> None:
    """Takes of several threads stay apart, though nothing comes before them."""
    threads = [Thread(100, 101 + n) for n in range(3)]
    system.subscription(MAIN, 0x10, "/chatter")
    times = [system.take(thread, 0x10, 777 + n) for n, thread in enumerate(threads)]
    assert analyse(system).rows(TAKES) == [
        (taken, "rmw", 777 + n, 1) for n, taken in enumerate(times)
    ]


@pytest.mark.thorough
def test_a_take_whose_upper_layers_were_lost_is_still_one(
    listener: RosSystem, analyse: Analyse
) -> None:
    listener.take(MAIN, 0x10, 777)
    listener.take(MAIN, 0x10, 778, layers="rmw")
    listener.lose()
    listener.ready(MAIN)
    assert analyse(listener).column("SELECT source_timestamp_ns FROM take ORDER BY 1") == [777, 778]


def test_a_gap_splits_the_layers(listener: RosSystem, analyse: Analyse) -> None:
    """What was taken before the gap may not be what was handed over behind it."""
    listener.take(MAIN, 0x10, 777, layers="rmw")
    listener.lose()
    listener.take(MAIN, 0x10, 0, layers="rcl rclcpp")
    listener.start(MAIN, 0xCB)
    assert analyse(listener).rows(
        "SELECT t.source_timestamp_ns FROM callback_instance JOIN take AS t USING (take_id)"
    ) == [(None,)]


def test_handles_never_initialised_are_placeholders(system: RosSystem, analyse: Analyse) -> None:
    system.take(MAIN, 0x10, 777)
    system.take(MAIN, 0x10, 778)
    system.take(MAIN, 0x11, 779)
    system.subscription(MAIN, 0x10, "/chatter")
    system.take(MAIN, 0x10, 780)
    assert analyse(system).rows(
        "SELECT source_timestamp_ns, topic_name, s.rmw_handle, is_inferred FROM take "
        "JOIN subscription AS s USING (subscription_id) ORDER BY take_id"
    ) == [
        (777, None, 0x1010, True),
        (778, None, 0x1010, True),
        (779, None, 0x1011, True),
        (780, "/chatter", 0x1010, False),
    ]


@pytest.mark.thorough
def test_a_handle_is_that_of_the_subscription_initialised_last(
    system: RosSystem, analyse: Analyse
) -> None:
    system.subscription(MAIN, 0x10, "/old")
    system.take(MAIN, 0x10, 1)
    system.subscription(MAIN, 0x10, "/new")
    system.take(MAIN, 0x10, 2)
    assert analyse(system).rows(
        "SELECT topic_name, source_timestamp_ns FROM take JOIN subscription USING (subscription_id)"
        " ORDER BY take_id"
    ) == [("/old", 1), ("/new", 2)]


def test_a_dequeue_is_a_take_of_the_subscription_of_the_buffer(
    system: RosSystem, analyse: Analyse
) -> None:
    system.subscription(MAIN, 0x10, "/chatter")
    system.add("ros2:rclcpp_subscription_init", MAIN, subscription_handle=0x10, subscription=0x5B)
    system.buffer(MAIN, 0xB1, 0x5B)
    system.add("ros2:rclcpp_construct_ring_buffer", MAIN, buffer=0xB2, capacity=1)
    taken = system.add("ros2:rclcpp_ring_buffer_dequeue", MAIN, buffer=0xB1, index=0, size=0)
    assert analyse(system).rows(TAKES) == [(taken, "ring_buffer", None, 1)]


def test_dispatch_of_caret_is_a_take(system: RosSystem, analyse: Analyse) -> None:
    """Where the official layers are suppressed; else it is one more layer of theirs."""
    system.subscription(MAIN, 0x10, "/chatter", callback=0xCB)
    for stamp, layers in ((777, ""), (778, "rmw rcl rclcpp")):
        if layers:
            system.take(MAIN, 0x10, stamp, layers=layers)
        system.add(
            "ros2:dispatch_subscription_callback",
            MAIN,
            message=0xB,
            callback=0xCB,
            source_stamp=stamp,
            message_timestamp=0,
        )
        system.start(MAIN, 0xCB)
        system.end(MAIN, 0xCB)
    model = analyse(system)
    assert model.rows(
        "SELECT method, source_timestamp_ns, subscription_id FROM take ORDER BY take_id"
    ) == [("caret", 777, 1), ("rmw", 778, 1)]
    assert model.column("SELECT take_id FROM callback_instance ORDER BY 1") == [1, 2]


def test_a_callback_without_a_take_was_called_with_a_message_all_the_same(
    listener: RosSystem, analyse: Analyse
) -> None:
    """Loaned messages, and intra-process ones before Iron; a timer takes nothing."""
    listener.timer(MAIN, 0x20, 0xDD)
    start = listener.start(MAIN, 0xCB, intra=True)
    listener.end(MAIN, 0xCB)
    other = listener.start(MAIN, 0xCB)
    listener.end(MAIN, 0xCB)
    listener.start(MAIN, 0xDD)
    model = analyse(listener)
    assert model.rows(TAKES) == [
        (start, "callback_only", None, 1),
        (other, "callback_only", None, 1),
    ]
    assert model.column("SELECT take_id FROM callback_instance ORDER BY start_ns") == [1, 2, None]


def test_the_time_between_layers_is_kept_out(listener: RosSystem, analyse: Analyse) -> None:
    """taken_ns is the rmw layer even where dds:read came long before."""
    read = listener.add("dds:read", MAIN, reader=WRITER, buffer=0xB)
    listener.wait(500)
    taken = listener.take(MAIN, 0x10, 777)
    assert taken - read == 500 + STEP_NS
    assert analyse(listener).column("SELECT taken_ns FROM take") == [taken]


def test_when_a_message_arrived(system: RosSystem, analyse: Analyse) -> None:
    """CARET's hook, on a thread of the middleware, of the process that takes, before the take."""
    listener = Thread(MAIN.pid, 109, "dds.udp")
    system.subscription(MAIN, 0x10, "/a")
    for stamp in (1, 2, 2, 3):
        system.add("ros2_caret:on_data_available", listener, source_stamp=stamp)
    system.add("ros2_caret:on_data_available", Thread(900), source_stamp=4)
    for stamp in (1, 2, 4, 5):
        system.take(MAIN, 0x10, stamp)
    system.add("ros2_caret:on_data_available", listener, source_stamp=5)
    assert analyse(system).rows(
        "SELECT t.source_timestamp_ns, t.taken_ns - a.waited_ns, a.is_ambiguous "
        "FROM data_arrival AS a JOIN take AS t USING (take_id) ORDER BY take_id"
    ) == [(1, 1_030, False), (2, 1_040, True)]


def test_readers_that_belong_to_no_subscription(system: RosSystem, analyse: Analyse) -> None:
    """Those of a process without ROS, of topics of ROS, and of a node that has no subscription."""
    system.subscription(MAIN, 0x10, "/a")
    for thread, topic in ((MAIN, "rt/a"), (MAIN, "rt/b"), (Thread(900), "rt/a")):
        system.add("dds:create_reader", thread, reader=0xA, topic_name=topic)
    for topic in ("rq/look_upRequest", "DCPSParticipant"):
        system.add("dds:create_reader", Thread(900), reader=0xB, topic_name=topic)
    assert analyse(system).rows(
        "SELECT pid, topic_name FROM untraced_reader JOIN process USING (process_id) ORDER BY ALL"
    ) == [(100, "/b"), (900, "/a")]


def test_the_time_of_a_simulation(system: RosSystem, analyse: Analyse) -> None:
    moments = [(system.add("ros2_caret:sim_time", MAIN, stamp=stamp), stamp) for stamp in (5, 7)]
    query = "SELECT at_ns, simulated_ns FROM simulated_time ORDER BY at_ns"
    assert analyse(system).rows(query) == moments
