"""Objects whose initialisation was not traced: what they are told by, and where nothing tells."""

from __future__ import annotations

import pytest
from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread

from msgflow.db.finding import broken_rules

MAIN = Thread(100)
OTHER = Thread(100, 101)
SOURCE = Thread(200)
CALLBACKS = (
    "SELECT callback_handle, kind, coalesce(timer_id, subscription_id, service_id) "
    "FROM callback ORDER BY 1"
)
TIMERS = "SELECT timer_handle, period_ns, is_inferred FROM timer ORDER BY 1"


def run(system: RosSystem, callback: int, thread: Thread = MAIN, *, intra: bool = False) -> int:
    """A callback begins and ends."""
    at = system.start(thread, callback, intra=intra)
    system.end(thread, callback)
    return at


def fire(system: RosSystem, handle: int, callback: int, thread: Thread = MAIN) -> int:
    """An executor waits, names a handle, and the callback runs."""
    system.idle(thread)
    system.ready(thread)
    system.execute(thread, handle)
    return run(system, callback, thread)


def receive(system: RosSystem, handle: int, callback: int, thread: Thread = MAIN) -> None:
    """An executor takes a message in the round that it is in."""
    system.ready(thread)
    system.execute(thread, handle)
    system.take(thread, handle, 777)
    run(system, callback, thread)


def dequeue(system: RosSystem, buffer: int, callback: int | None, slot: int = 0) -> int:
    """A message is taken out of a ring buffer."""
    at = system.add("ros2:rclcpp_ring_buffer_dequeue", MAIN, buffer=buffer, index=slot, size=0)
    if callback is not None:
        run(system, callback, intra=True)
    return at


def publish_intra(system: RosSystem, handle: int, buffer: int, slot: int = 0) -> None:
    """A message is put into a ring buffer."""
    system.add("ros2:rclcpp_intra_publish", OTHER, publisher_handle=handle, message=0xA)
    system.add(
        "ros2:rclcpp_ring_buffer_enqueue", OTHER, buffer=buffer, index=slot, size=1, overwritten=0
    )


def uncertain(analysis: Analysis) -> list[tuple[str, int]]:
    return analysis.rows(
        "SELECT name, count FROM store.finding WHERE name IN "
        "('eliminated_owner', 'unknown_owner', 'ambiguous_buffer') ORDER BY 1"
    )


def test_a_timer_that_lost_its_initialisation(system: RosSystem, analyse: Analyse) -> None:
    """What else names its handle is enough."""
    system.node(MAIN, 0x1, "clock")
    system.add("ros2:rclcpp_timer_callback_added", MAIN, timer_handle=0x20, callback=0xCB)
    system.add("ros2:rclcpp_timer_link_node", MAIN, timer_handle=0x20, node_handle=0x1)
    system.timer(MAIN, 0x21, 0xCC)
    run(system, 0xCB)
    analysis = analyse(system)
    assert analysis.rows(TIMERS) == [(0x20, None, True), (0x21, 5_000_000, False)]
    assert analysis.rows("SELECT node, label FROM callback_label ORDER BY callback_id") == [
        ("/clock", "Timer(0x20)"),
        ("/clock", "Timer(5 ms)"),
    ]
    assert "timers" in analysis.column("SELECT subject FROM store.finding")
    assert uncertain(analysis) == []


def test_a_handle_used_before_its_initialisation_is_another_timer(
    system: RosSystem, analyse: Analyse
) -> None:
    system.add("ros2:rclcpp_timer_callback_added", MAIN, timer_handle=0x20, callback=0xCB)
    system.timer(MAIN, 0x20, 0xCC)
    assert analyse(system).rows(
        "SELECT c.callback_handle, t.period_ns FROM callback AS c JOIN timer AS t USING (timer_id) "
        "ORDER BY 1"
    ) == [(0xCB, None), (0xCC, 5_000_000)]


def test_the_first_use_of_a_handle_stands_for_its_timer(
    system: RosSystem, analyse: Analyse
) -> None:
    for handle, callback in ((0x20, 0xCB), (0x21, 0xCC)):
        system.add("ros2:rclcpp_timer_callback_added", MAIN, timer_handle=handle, callback=callback)
    for handle in (0x21, 0x20):
        system.add("ros2:rclcpp_timer_link_node", MAIN, timer_handle=handle, node_handle=0x1)
    assert analyse(system).column("SELECT timer_handle FROM timer ORDER BY timer_id") == [
        0x20,
        0x21,
    ]


def test_timers_of_equal_handles_in_two_processes(system: RosSystem, analyse: Analyse) -> None:
    """Of one process, the timers lost their initialisation; each is one, whatever names it."""
    system.node(SOURCE, 0x1, "source")
    for handle, period in ((0x20, 5), (0x21, 7)):
        system.add("ros2:rcl_timer_init", MAIN, timer_handle=handle, period=period)
    for handle, callback in ((0x20, 0xCB), (0x21, 0xCC)):
        system.add("ros2:rclcpp_timer_callback_added", MAIN, timer_handle=handle, callback=callback)
    for handle, callback in ((0x20, 0xCD), (0x21, 0xCE)):
        system.add(
            "ros2:rclcpp_timer_callback_added", SOURCE, timer_handle=handle, callback=callback
        )
        system.add("ros2:rclcpp_timer_link_node", SOURCE, timer_handle=handle, node_handle=0x1)
    assert analyse(system).rows(
        "SELECT c.callback_handle, t.timer_handle, t.period_ns, n.full_name FROM callback AS c "
        "JOIN timer AS t USING (timer_id) LEFT JOIN node AS n ON t.node_id = n.node_id ORDER BY 1"
    ) == [
        (0xCB, 0x20, 5, None),
        (0xCC, 0x21, 7, None),
        (0xCD, 0x20, None, "/source"),
        (0xCE, 0x21, None, "/source"),
    ]


def test_an_executor_names_the_handle(system: RosSystem, analyse: Analyse) -> None:
    """It was initialised, though the callback was not seen to be attached."""
    system.add("ros2:rcl_timer_init", MAIN, timer_handle=0x20, period=7)
    system.add("ros2:rclcpp_timer_link_node", MAIN, timer_handle=0x21, node_handle=0x1)
    system.subscription(MAIN, 0x22, "/a")
    for handle, callback in ((0x20, 0xC0), (0x21, 0xC1), (0x22, 0xC2)):
        fire(system, handle, callback)
    analysis = analyse(system)
    assert analysis.rows(
        "SELECT c.callback_handle, c.kind, t.timer_handle, s.topic_name FROM callback AS c "
        "LEFT JOIN timer AS t USING (timer_id) "
        "LEFT JOIN subscription AS s ON c.subscription_id = s.subscription_id ORDER BY 1"
    ) == [
        (0xC0, "timer", 0x20, None),
        (0xC1, "timer", 0x21, None),
        (0xC2, "subscription", None, "/a"),
    ]
    assert uncertain(analysis) == []


def test_what_runs_without_a_take_is_a_timer(system: RosSystem, analyse: Analyse) -> None:
    """Where takes are traced: what an executor names is a timer or a subscription."""
    fire(system, 0x20, 0xC0)
    fire(system, 0x21, 0xC1)
    receive(system, 0x30, 0xC2)
    fire(system, 0x20, 0xC0)
    analysis = analyse(system)
    assert analysis.rows(TIMERS) == [(0x20, None, True), (0x21, None, True)]
    assert analysis.rows(CALLBACKS) == [
        (0xC0, "timer", 1),
        (0xC1, "timer", 2),
        (0xC2, "subscription", 1),
    ]
    assert uncertain(analysis) == [("eliminated_owner", 2)]


def test_takes_that_were_not_recorded(system: RosSystem, analyse: Analyse) -> None:
    """Then a subscription would look the same."""
    fire(system, 0x20, 0xC0)
    analysis = analyse(system)
    assert analysis.rows(CALLBACKS) == [(0xC0, "unknown", None)]
    assert uncertain(analysis) == [("unknown_owner", 1)]


def test_two_callbacks_of_one_handle(system: RosSystem, analyse: Analyse) -> None:
    receive(system, 0x30, 0xC9)
    fire(system, 0x20, 0xC0)
    fire(system, 0x20, 0xC1)
    analysis = analyse(system)
    assert analysis.rows(CALLBACKS)[:2] == [(0xC0, "unknown", None), (0xC1, "unknown", None)]
    assert analysis.rows(TIMERS) == []


@pytest.mark.thorough
def test_two_handles_before_one_callback(system: RosSystem, analyse: Analyse) -> None:
    receive(system, 0x30, 0xC9)
    fire(system, 0x20, 0xC0)
    fire(system, 0x21, 0xC0)
    assert analyse(system).rows(CALLBACKS)[0] == (0xC0, "unknown", None)


@pytest.mark.thorough
def test_something_else_in_between(system: RosSystem, analyse: Analyse) -> None:
    receive(system, 0x30, 0xC9)
    system.execute(MAIN, 0x20)
    system.publish(MAIN, 0x10, 1)
    run(system, 0xC0)
    assert analyse(system).rows(CALLBACKS)[0] == (0xC0, "unknown", None)


def test_a_gap_in_between_tells_nothing(system: RosSystem, analyse: Analyse) -> None:
    """Neither for nor against."""
    receive(system, 0x30, 0xC9)
    fire(system, 0x20, 0xC0)
    system.execute(MAIN, 0x21)
    system.lose()
    run(system, 0xC0)
    system.execute(MAIN, 0x22)
    system.lose()
    run(system, 0xC1)
    assert analyse(system).rows(CALLBACKS) == [
        (0xC0, "timer", 1),
        (0xC1, "unknown", None),
        (0xC9, "subscription", 1),
    ]


@pytest.mark.thorough
def test_a_known_subscription_without_a_take(system: RosSystem, analyse: Analyse) -> None:
    """Loaned messages: what has no take in that process may be either."""
    system.subscription(MAIN, 0x30, "/a", callback=0xCB)
    receive(system, 0x31, 0xC9)
    fire(system, 0x30, 0xCB)
    fire(system, 0x20, 0xC0)
    fire(system, 0x20, 0xC0, SOURCE)
    receive(system, 0x31, 0xC9, SOURCE)
    assert analyse(system).rows(
        "SELECT p.pid, c.kind FROM callback AS c JOIN process AS p USING (process_id) "
        "WHERE c.callback_handle = 192 ORDER BY 1"
    ) == [(100, "unknown"), (200, "timer")]


def test_timers_come_first_in_a_round(system: RosSystem, analyse: Analyse) -> None:
    """What runs after a message of the same round is none."""
    fire(system, 0x20, 0xC0)
    receive(system, 0x30, 0xC9)
    system.ready(MAIN)
    system.execute(MAIN, 0x21)
    run(system, 0xC1)
    analysis = analyse(system)
    assert analysis.rows(CALLBACKS) == [
        (0xC0, "unknown", None),
        (0xC1, "unknown", None),
        (0xC9, "subscription", 1),
    ]
    assert uncertain(analysis) == [("unknown_owner", 2)]


@pytest.mark.thorough
def test_a_gap_may_hide_the_begin_of_a_round(system: RosSystem, analyse: Analyse) -> None:
    receive(system, 0x30, 0xC9)
    system.lose()
    system.ready(MAIN)
    system.execute(MAIN, 0x21)
    run(system, 0xC1)
    assert analyse(system).rows(CALLBACKS)[0] == (0xC1, "timer", 1)


def test_several_threads_keep_no_such_order(system: RosSystem, analyse: Analyse) -> None:
    """The timer's callback group may have been busy."""
    receive(system, 0x30, 0xC9, OTHER)
    receive(system, 0x30, 0xC9)
    system.ready(MAIN)
    system.execute(MAIN, 0x21)
    run(system, 0xC1)
    assert analyse(system).rows(CALLBACKS)[0] == (0xC1, "timer", 1)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("handles", "kind"), [((), "unknown"), ((0x20,), "service"), ((0x20, 0x41), "unknown")]
)
def test_a_service_is_not_named(
    system: RosSystem, analyse: Analyse, handles: tuple[int, ...], kind: str
) -> None:
    """Unless executors name nothing, or requests are traced, of which there is none here."""
    for handle in handles[:1]:
        fire(system, handle, 0xC9)
    for handle in handles[1:]:
        system.take_request(MAIN, handle, 1, gid=7)
    system.idle(MAIN)
    system.ready(MAIN)
    run(system, 0xC1)
    analysis = analyse(system)
    assert analysis.rows(CALLBACKS)[0][:2] == (0xC1, kind)
    if kind == "service":
        assert analysis.rows("SELECT service_id, is_inferred FROM service") == [(1, True)]


def test_a_service_that_lost_its_initialisation(system: RosSystem, analyse: Analyse) -> None:
    """It has one row with both handles; that of another, which nobody called, has one."""
    for handle, callback in ((0x40, 0xC1), (0x41, 0xC2)):
        system.add(
            "ros2:rclcpp_service_callback_added", MAIN, service_handle=handle, callback=callback
        )
    system.take_request(MAIN, 0x40, 1, gid=7)
    run(system, 0xC1)
    analysis = analyse(system)
    assert analysis.rows(
        "SELECT s.service_handle, s.rmw_handle, s.is_inferred, c.callback_handle "
        "FROM service AS s JOIN callback AS c USING (service_id) ORDER BY 1"
    ) == [(0x40, 0x1040, True, 0xC1), (0x41, None, True, 0xC2)]
    assert analysis.rows(TIMERS) == []
    assert uncertain(analysis) == []


def test_a_ring_buffer_belongs_to_the_callback_behind(system: RosSystem, analyse: Analyse) -> None:
    """Its subscription is a placeholder that learns its topic; flows go through."""
    system.publisher(OTHER, 0x10, "/a")
    system.publisher(MAIN, 0x11, "/b")
    for slot in (0, 1):
        publish_intra(system, 0x10, 0xB0, slot)
        system.add("ros2:rclcpp_ring_buffer_dequeue", MAIN, buffer=0xB0, index=slot, size=0)
        system.start(MAIN, 0xC1, intra=True)
        system.publish(MAIN, 0x11, 5 + slot)
        system.end(MAIN, 0xC1)
        system.take(OTHER, 0x31, 5 + slot)
        run(system, 0xC2, OTHER)
    analysis = analyse(system)
    assert analysis.rows("SELECT label FROM callback_label ORDER BY callback_id") == [
        ("Subscription(/a)",),
        ("Subscription(/b)",),
    ]
    assert analysis.rows("SELECT topics FROM flow_path([1], NULL, NULL) WHERE is_path") == [
        (["/a", "/b"],)
    ]
    assert analysis.value("SELECT count(*) FROM take WHERE subscription_id IS NULL") == 0
    assert uncertain(analysis) == []
    assert analysis.rows("SELECT DISTINCT status FROM stat_delivery") == [("delivered",)]


@pytest.mark.thorough
def test_a_placeholder_of_a_buffer_is_not_said_to_miss_messages(
    system: RosSystem, analyse: Analyse
) -> None:
    """What comes through the middleware is perhaps taken by the same subscription elsewhere."""
    system.publisher(OTHER, 0x10, "/a")
    publish_intra(system, 0x10, 0xB0)
    dequeue(system, 0xB0, 0xC1)
    system.publisher(SOURCE, 0x10, "/a")
    system.publish(SOURCE, 0x10, 9)
    analysis = analyse(system)
    assert analysis.rows("SELECT topic_name, is_inferred FROM subscription") == [("/a", True)]
    assert analysis.rows("SELECT publication_id, status FROM stat_delivery") == [(1, "delivered")]
    assert broken_rules(analysis.connection) == []


@pytest.mark.thorough
def test_several_callbacks_behind_a_ring_buffer(system: RosSystem, analyse: Analyse) -> None:
    """The address may have been used again: nobody can tell."""
    dequeue(system, 0xB0, 0xC1)
    dequeue(system, 0xB0, 0xC2)
    dequeue(system, 0xB1, 0xC3)
    dequeue(system, 0xB2, 0xC3)
    dequeue(system, 0xB3, 0xC4)
    dequeue(system, 0xB3, None)
    dequeue(system, 0xB4, None)
    analysis = analyse(system)
    assert analysis.column("SELECT subscription_id FROM take ORDER BY take_id") == [
        None,
        None,
        None,
        None,
        1,
        1,
        2,
    ]
    assert uncertain(analysis) == [("ambiguous_buffer", 3), ("unknown_owner", 3)]


@pytest.mark.thorough
def test_a_ring_buffer_of_a_known_callback(system: RosSystem, analyse: Analyse) -> None:
    """Only which buffer it reads was lost, also for a message that led to nothing."""
    system.subscription(MAIN, 0x30, "/a", callback=0xC1)
    dequeue(system, 0xB0, 0xC1)
    dequeue(system, 0xB0, None)
    analysis = analyse(system)
    assert analysis.column("SELECT subscription_id FROM take") == [1, 1]
    assert analysis.rows("SELECT topic_name, is_inferred FROM subscription") == [("/a", False)]


@pytest.mark.thorough
def test_an_intra_process_callback_without_a_buffer(system: RosSystem, analyse: Analyse) -> None:
    """Before Iron nothing else shows of the message; where a gap hid the dequeue it is the same."""
    run(system, 0xC1, intra=True)
    dequeue(system, 0xB0, 0xC2)
    system.lose()
    run(system, 0xC2, intra=True)
    run(system, 0xC1, intra=True)
    analysis = analyse(system)
    assert analysis.rows(CALLBACKS) == [(0xC1, "subscription", 1), (0xC2, "subscription", 2)]
    assert analysis.column("SELECT subscription_id FROM take ORDER BY take_id") == [1, 2, 2, 1]
