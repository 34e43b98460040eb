"""Agnocast: nodes, topics, callbacks and messages that pass neither rcl nor the middleware."""

from __future__ import annotations

import pytest
from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread

SENSOR, FILTER, OTHER = Thread(100, name="sensor"), Thread(200, name="filter"), Thread(200, 201)
MILLISECOND = 1_000_000
LINKS = (
    "SELECT e.entry_id, l.method, l.candidate_count, l.latency_ns FROM link_transport AS l "
    "JOIN agnocast_entry AS e USING (take_id) ORDER BY l.take_id"
)
STATUS = (
    "SELECT e.entry_id, d.status, d.reason FROM stat_delivery AS d "
    "JOIN agnocast_entry AS e USING (publication_id) ORDER BY 1"
)


class Agnocast:
    """What processes that use Agnocast record, by hand."""

    def __init__(self, system: RosSystem) -> None:
        self.system = system
        self.callables = 0xCA0

    def node(self, thread: Thread, handle: int, name: str) -> None:
        self.system.add(
            "agnocast:agnocast_node_init",
            thread,
            node_handle=handle,
            node_name=name,
            namespace="/",
        )

    def publisher(
        self, thread: Thread, handle: int, topic: str = "/points", node: int = 0x1
    ) -> None:
        self.system.add(
            "agnocast:agnocast_publisher_init",
            thread,
            publisher_handle=handle,
            node_handle=node,
            topic_name=topic,
            queue_depth=1,
        )

    def subscription(
        self,
        thread: Thread,
        handle: int,
        number: int,
        topic: str = "/points",
        *,
        node: int = 0x2,
        depth: int = 1,
    ) -> int:
        """One that is polled has number 0; returns what names its callback."""
        callback = thread.pid << 32 | number if number else 0
        self.system.add(
            "agnocast:agnocast_subscription_init",
            thread,
            subscription_handle=handle,
            node_handle=node,
            callback_group=0x9,
            symbol="Filter::cb" if number else "dummy_take",
            topic_name=topic,
            queue_depth=depth,
            pid_callback_info_id=callback,
        )
        return callback

    def timer(self, thread: Thread, handle: int, period: int, node: int = 0x1) -> None:
        self.system.add(
            "agnocast:agnocast_timer_init",
            thread,
            timer_handle=handle,
            node_handle=node,
            callback_group=0x9,
            symbol="tick",
            period=period,
        )

    def publish(self, thread: Thread, handle: int, entry: int) -> int:
        return self.system.add(
            "agnocast:agnocast_publish", thread, publisher_handle=handle, entry_id=entry
        )

    def create(self, thread: Thread, callback: int, entry: int, address: int | None = None) -> int:
        self.callables = address or self.callables + 1
        self.system.add(
            "agnocast:agnocast_create_callable",
            thread,
            callable=self.callables,
            entry_id=entry,
            pid_callback_info_id=callback,
        )
        return self.callables

    def start(self, thread: Thread, address: int) -> None:
        self.system.add("agnocast:agnocast_callable_start", thread, callable=address)

    def end(self, thread: Thread, address: int) -> None:
        self.system.add("agnocast:agnocast_callable_end", thread, callable=address)

    def run(self, thread: Thread, callback: int, entry: int, address: int | None = None) -> None:
        """The callback of a message, as since 2.2."""
        made = self.create(thread, callback, entry, address)
        self.start(thread, made)
        self.end(thread, made)

    def tick(self, thread: Thread, timer: int) -> None:
        self.system.add(
            "agnocast:agnocast_create_timer_callable", thread, callable=0xAA, timer_handle=timer
        )
        self.start(thread, 0xAA)
        self.end(thread, 0xAA)

    def poll(self, thread: Thread, handle: int, entry: int, message: int = 0xB) -> None:
        self.system.add(
            "agnocast:agnocast_take",
            thread,
            subscription_handle=handle,
            message=message,
            entry_id=entry,
        )


@pytest.fixture
def agnocast(system: RosSystem) -> Agnocast:
    """A publisher on /points in one process, a subscription with callback 1 in another."""
    made = Agnocast(system)
    made.node(SENSOR, 0x1, "sensor")
    made.publisher(SENSOR, 0x10)
    made.node(FILTER, 0x2, "filter")
    made.subscription(FILTER, 0x20, 1)
    return made


CALLBACK = FILTER.pid << 32 | 1


def links(analyse: Analyse, agnocast: Agnocast) -> list[tuple[object, ...]]:
    return [row[:3] for row in analyse(agnocast.system).rows(LINKS)]


def test_objects_are_those_of_the_model(agnocast: Agnocast, analyse: Analyse) -> None:
    """Nodes of its own, and one of rclcpp that uses it."""
    agnocast.system.node(SENSOR, 0x3, "rclcpp_node")
    agnocast.publisher(SENSOR, 0x11, "/more", node=0x3)
    agnocast.timer(SENSOR, 0x30, 5)
    agnocast.tick(SENSOR, 0x30)
    model = analyse(agnocast.system)
    assert model.rows(
        "SELECT n.full_name, p.topic_name, p.queue_depth, p.rmw_handle, p.is_agnocast "
        "FROM publisher AS p JOIN node AS n USING (node_id) ORDER BY publisher_id"
    ) == [("/sensor", "/points", 1, None, True), ("/rclcpp_node", "/more", 1, None, True)]
    assert model.rows(
        "SELECT n.full_name, s.topic_name, s.is_agnocast, c.kind, c.callback_handle, c.symbol "
        "FROM subscription AS s JOIN node AS n USING (node_id) "
        "JOIN callback AS c USING (subscription_id)"
    ) == [("/filter", "/points", True, "subscription", CALLBACK, "Filter::cb")]
    assert model.rows(
        "SELECT n.full_name, c.symbol, count(i.callback_instance_id) FROM timer AS t "
        "JOIN node AS n USING (node_id) JOIN callback AS c USING (timer_id) "
        "LEFT JOIN callback_instance AS i USING (callback_id) GROUP BY ALL"
    ) == [("/sensor", "tick", 1)]


def test_topic_and_number_link_a_message(agnocast: Agnocast, analyse: Analyse) -> None:
    agnocast.publisher(SENSOR, 0x11, "/other")
    agnocast.publish(SENSOR, 0x11, 7)
    sent = agnocast.publish(SENSOR, 0x10, 7)
    agnocast.run(FILTER, CALLBACK, 7)
    model = analyse(agnocast.system)
    assert model.rows(LINKS) == [(7, "agnocast", 1, 10)]
    assert model.rows(
        "SELECT b.end_ns, t.method, i.start_ns - t.taken_ns FROM link_transport AS l "
        "JOIN publication AS b USING (publication_id) JOIN take AS t USING (take_id) "
        "JOIN callback_instance AS i USING (take_id)"
    ) == [(sent, "agnocast", 10)]


def test_a_receipt_may_come_before_the_event_of_the_publication(
    agnocast: Agnocast, analyse: Analyse
) -> None:
    made = agnocast.create(FILTER, CALLBACK, 3)
    agnocast.publish(SENSOR, 0x10, 3)
    agnocast.start(FILTER, made)
    assert analyse(agnocast.system).rows(LINKS) == [(3, "agnocast", 1, -10)]


def test_before_2_2_a_callable_waits_in_a_queue(agnocast: Agnocast, analyse: Analyse) -> None:
    """One thread fetches two messages; another one runs their callables, in this order."""
    for entry in (1, 2):
        agnocast.publish(SENSOR, 0x10, entry)
    first, second = (agnocast.create(FILTER, CALLBACK, entry) for entry in (1, 2))
    for address in (second, first):
        agnocast.start(OTHER, address)
        agnocast.end(OTHER, address)
    assert analyse(agnocast.system).rows(
        "SELECT e.entry_id, h.tid FROM callback_instance AS i JOIN thread AS h USING (thread_id) "
        "JOIN agnocast_entry AS e USING (take_id) ORDER BY i.start_ns"
    ) == [(2, 201), (1, 201)]


def test_an_address_is_used_again(agnocast: Agnocast, analyse: Analyse) -> None:
    """Where the making of a callable was lost, its run is not of the message before."""
    for entry in (1, 2):
        agnocast.publish(SENSOR, 0x10, entry)
    agnocast.run(FILTER, CALLBACK, 1, address=0xCA)
    agnocast.start(FILTER, 0xCA)
    agnocast.end(FILTER, 0xCA)
    agnocast.run(FILTER, CALLBACK, 2, address=0xCA)
    assert analyse(agnocast.system).rows(
        "SELECT c.kind, e.entry_id, i.end_ns - i.start_ns FROM callback_instance AS i "
        "JOIN callback AS c USING (callback_id) LEFT JOIN agnocast_entry AS e USING (take_id) "
        "ORDER BY i.start_ns"
    ) == [("subscription", 1, 10), ("unknown", None, 10), ("subscription", 2, 10)]


def test_numbers_begin_again(agnocast: Agnocast, analyse: Analyse) -> None:
    """The topic died, and another publisher is made: message 1 is another one then."""
    for entry in (1, 2):
        agnocast.publish(SENSOR, 0x10, entry)
        agnocast.run(FILTER, CALLBACK, entry)
    again = Thread(300, name="sensor")
    agnocast.node(again, 0x5, "sensor")
    agnocast.publisher(again, 0x50, node=0x5)
    later = Thread(400, name="filter")
    agnocast.node(later, 0x6, "filter")
    number = agnocast.subscription(later, 0x60, 1, node=0x6)
    agnocast.publish(again, 0x50, 1)
    agnocast.run(later, number, 1)
    # Of it nothing was recorded but the take.
    agnocast.run(later, number, 2)
    model = analyse(agnocast.system)
    assert model.rows(
        "SELECT e.entry_id, b.process_id, t.process_id FROM link_transport AS l "
        "JOIN agnocast_entry AS e USING (take_id) JOIN take AS t USING (take_id) "
        "JOIN publication AS b ON l.publication_id = b.publication_id ORDER BY take_id"
    ) == [(1, 1, 2), (2, 1, 2), (1, 3, 4)]
    assert model.rows(LINKS)[-1][2] == 1


def test_of_two_messages_with_one_number_the_link_is_marked(
    agnocast: Agnocast, analyse: Analyse
) -> None:
    """Containers share a clock, but not the memory: both publishers were there before."""
    other = Thread(300, name="sensor")
    agnocast.publisher(other, 0x50)
    agnocast.publish(SENSOR, 0x10, 1)
    agnocast.system.wait(1_000)
    agnocast.publish(other, 0x50, 1)
    agnocast.run(FILTER, CALLBACK, 1)
    assert links(analyse, agnocast) == [(1, "agnocast", 2)]


def test_hosts_have_numbers_of_their_own(agnocast: Agnocast, analyse: Analyse) -> None:
    agnocast.system.add_source(1, "robot2", "clock-2")
    far = Thread(200, trace=1, name="filter")
    number = agnocast.subscription(far, 0x20, 1)
    agnocast.publish(SENSOR, 0x10, 1)
    agnocast.run(far, number, 1)
    model = analyse(agnocast.system)
    assert model.rows(LINKS) == []
    assert model.rows("SELECT reason FROM stat_orphan") == [("unknown",)]


def test_what_was_passed_over_is_dropped(agnocast: Agnocast, analyse: Analyse) -> None:
    for entry in (1, 2, 3):
        agnocast.publish(SENSOR, 0x10, entry)
    agnocast.run(FILTER, CALLBACK, 3)
    assert analyse(agnocast.system).rows(STATUS) == [
        (1, "dropped", "overwritten"),
        (2, "dropped", "overwritten"),
        (3, "delivered", None),
    ]


def test_a_subscription_of_ros_on_the_same_topic_is_not_meant(
    agnocast: Agnocast, analyse: Analyse
) -> None:
    """Only a bridge passes messages from one to the other."""
    agnocast.system.subscription(FILTER, 0x70, "/points", callback=0x71)
    agnocast.publish(SENSOR, 0x10, 1)
    agnocast.run(FILTER, CALLBACK, 1)
    assert analyse(agnocast.system).rows(STATUS) == [(1, "delivered", None)]


def test_polls(agnocast: Agnocast, analyse: Analyse) -> None:
    """Number 0 is nothing without a message; the same message may be taken again."""
    agnocast.subscription(FILTER, 0x21, 0)
    agnocast.publisher(FILTER, 0x12, "/filtered", node=0x2)
    agnocast.timer(FILTER, 0x30, MILLISECOND, node=0x2)
    for entry, message in ((0, 0), (0, 0xB), (0, 0xB)):
        if entry == 0 == message:
            agnocast.poll(FILTER, 0x21, entry, message)
            agnocast.publish(SENSOR, 0x10, 0)
            continue
        agnocast.system.add(
            "agnocast:agnocast_create_timer_callable", FILTER, callable=0xAA, timer_handle=0x30
        )
        agnocast.start(FILTER, 0xAA)
        agnocast.poll(FILTER, 0x21, entry, message)
        agnocast.publish(FILTER, 0x12, 5)
        agnocast.end(FILTER, 0xAA)
    model = analyse(agnocast.system)
    assert [row[:3] for row in model.rows(LINKS)] == [(0, "agnocast", 1)] * 2
    assert model.rows("SELECT kind, count(*) FROM link_causal GROUP BY 1 ORDER BY 1") == [
        ("direct", 2),
        ("polled", 2),
    ]


@pytest.mark.parametrize(
    ("recorded", "period", "distance", "has_groups"),
    [
        (100, 100 * MILLISECOND, 99 * MILLISECOND, False),
        (2, 2_000 * MILLISECOND, 2_100 * MILLISECOND, False),
        (50 * MILLISECOND, 50 * MILLISECOND, 50 * MILLISECOND, False),
        (100, None, None, False),
        (100, 100, None, True),
    ],
)
def test_the_unit_of_a_period(
    agnocast: Agnocast,
    analyse: Analyse,
    recorded: int,
    period: int | None,
    distance: int | None,
    has_groups: bool,
) -> None:
    """Since 2.3, which has groups, it is nanoseconds; before, what comes closest."""
    agnocast.timer(SENSOR, 0x30, recorded)
    if has_groups:
        agnocast.system.add(
            "agnocast:agnocast_add_callback_group",
            SENSOR,
            executor_addr=0xE,
            callback_group_addr=0x9,
            group_type_name="mutually_exclusive",
        )
    for _ in range(4 if distance else 1):
        agnocast.tick(SENSOR, 0x30)
        agnocast.system.wait(distance or 0)
    assert analyse(agnocast.system).rows("SELECT period_ns FROM timer") == [(period,)]


def test_a_bridge_makes_one_flow(agnocast: Agnocast, analyse: Analyse) -> None:
    """Agnocast to ROS 2, and back."""
    bridge, far = Thread(300, name="bridge"), Thread(400, name="far")
    system = agnocast.system
    system.node(bridge, 0x3, "bridge")
    number = agnocast.subscription(bridge, 0x31, 1, node=0x3)
    system.publisher(bridge, 0x32, "/points", node=0x3)
    system.node(far, 0x4, "far")
    system.subscription(far, 0x41, "/points", node=0x4, callback=0x42)
    agnocast.publisher(far, 0x43, "/back", node=0x4)
    agnocast.publish(SENSOR, 0x10, 1)
    made = agnocast.create(bridge, number, 1)
    agnocast.start(bridge, made)
    system.publish(bridge, 0x32, 777)
    agnocast.end(bridge, made)
    system.take(far, 0x41, 777)
    system.add("ros2:callback_start", far, callback=0x42, is_intra_process=0)
    agnocast.publish(far, 0x43, 1)
    system.add("ros2:callback_end", far, callback=0x42)
    model = analyse(system)
    assert model.rows("SELECT method FROM link_transport ORDER BY take_id") == [
        ("agnocast",),
        ("exact",),
    ]
    assert model.rows("SELECT kind FROM link_causal") == [("direct",), ("direct",)]


def test_executors_and_groups(agnocast: Agnocast, analyse: Analyse) -> None:
    agnocast.system.add(
        "agnocast:agnocast_construct_executor",
        FILTER,
        executor_addr=0xE,
        executor_type_name="agnocast_multi_threaded_executor",
    )
    agnocast.system.add(
        "agnocast:agnocast_add_callback_group",
        FILTER,
        executor_addr=0xE,
        callback_group_addr=0x9,
        group_type_name="reentrant",
    )
    agnocast.run(OTHER, CALLBACK, 1)
    model = analyse(agnocast.system)
    assert model.rows(
        "SELECT e.kind, e.is_inferred, t.tid FROM executor AS e "
        "JOIN executor_thread USING (executor_id) JOIN thread AS t USING (thread_id)"
    ) == [("agnocast_multi_threaded_executor", False, 201)]
    assert model.rows(
        "SELECT g.kind, c.callback_handle FROM callback_group AS g "
        "JOIN callback_group_member USING (callback_group_id) "
        "JOIN callback AS c USING (callback_id)"
    ) == [("reentrant", CALLBACK)]


def test_caret_reports_what_was_created_before(system: RosSystem, analyse: Analyse) -> None:
    """Under the same names, more than once, in any order."""
    made = Agnocast(system)
    made.publish(SENSOR, 0x10, 1)
    made.run(FILTER, CALLBACK, 1)
    for _ in range(2):
        made.subscription(FILTER, 0x20, 1)
        made.publisher(SENSOR, 0x10)
        made.node(FILTER, 0x2, "filter")
        made.node(SENSOR, 0x1, "sensor")
    initialised = [row for name, row in system.events if name.endswith("_init")]
    for row in initialised:
        row["init_timestamp"] = 5 if "topic_name" in row else 4
    model = analyse(system)
    assert model.rows(LINKS)[0][:3] == (1, "agnocast", 1)
    assert model.rows("SELECT full_name, is_inferred FROM node ORDER BY 1") == [
        ("/filter", False),
        ("/sensor", False),
    ]
    assert model.value("SELECT count(*) FROM publisher") == 1
    assert model.value("SELECT count(*) FROM process") == 2


def findings(model: Analysis) -> list[str]:
    return [
        name
        for (name,) in model.connection.execute(
            "SELECT DISTINCT name FROM main.finding ORDER BY 1"
        ).fetchall()
    ]


def test_its_executors_are_not_taken_for_others(agnocast: Agnocast, analyse: Analyse) -> None:
    agnocast.system.add("ros2:rclcpp_executor_get_next_ready", SENSOR)
    for entry in (1, 2, 3):
        agnocast.publish(SENSOR, 0x10, entry)
        agnocast.run(FILTER, CALLBACK, entry)
    found = findings(analyse(agnocast.system))
    assert "agnocast_callbacks" in found
    assert not {"executor_without_events", "process_without_ros"} & set(found)
