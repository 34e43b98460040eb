"""Messages between nodes of one process, by the slots of ring buffers."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import few, thorough

TALKER = Thread(100)
LISTENER = Thread(100, 101)
LINKS = (
    "SELECT b.intra_ns, t.taken_ns, l.method FROM link_transport AS l "
    "JOIN publication AS b USING (publication_id) JOIN take AS t ON l.take_id = t.take_id "
    "WHERE t.method = 'ring_buffer' ORDER BY t.take_id"
)


class Intra:
    """A publisher and a subscription of /a in one process, with the buffer between them."""

    def __init__(self, system: RosSystem) -> None:
        self.system = system
        system.publisher(TALKER, 0x10, "/a")
        system.subscription(LISTENER, 0x20, "/a", callback=0xCB)
        system.buffer(LISTENER, 0xB0, 0x20 + 0x2000)

    def publish(self, *slots: int, buffer: int = 0xB0) -> int:
        at = self.system.add(
            "ros2:rclcpp_intra_publish", TALKER, publisher_handle=0x10, message=0xA
        )
        for slot in slots:
            self.enqueue(slot, buffer=buffer)
        return at

    def enqueue(self, slot: int, *, buffer: int = 0xB0) -> int:
        return self.system.add(
            "ros2:rclcpp_ring_buffer_enqueue",
            TALKER,
            buffer=buffer,
            index=slot,
            size=1,
            overwritten=0,
        )

    def dequeue(self, slot: int, *, buffer: int = 0xB0) -> int:
        at = self.system.add(
            "ros2:rclcpp_ring_buffer_dequeue", LISTENER, buffer=buffer, index=slot, size=0
        )
        self.system.start(LISTENER, 0xCB, intra=True)
        self.system.end(LISTENER, 0xCB)
        return at


@pytest.fixture
def intra(system: RosSystem) -> Intra:
    return Intra(system)


def test_the_latest_message_of_the_slot(intra: Intra, analyse: Analyse) -> None:
    first, second = intra.publish(0), intra.publish(1)
    taken = [intra.dequeue(0), intra.dequeue(1)]
    third = intra.publish(0)
    taken.append(intra.dequeue(0))
    assert analyse(intra.system).rows(LINKS) == [
        (published, at, "ring_buffer")
        for published, at in zip((first, second, third), taken, strict=True)
    ]


def test_an_overwritten_message_is_not_received(intra: Intra, analyse: Analyse) -> None:
    intra.publish(0)
    second = intra.publish(0)
    taken = intra.dequeue(0)
    assert analyse(intra.system).rows(LINKS) == [(second, taken, "ring_buffer")]


def test_a_message_is_taken_out_once(intra: Intra, analyse: Analyse) -> None:
    published = intra.publish(0)
    taken = intra.dequeue(0)
    intra.dequeue(0)
    assert analyse(intra.system).rows(LINKS) == [(published, taken, "ring_buffer")]


@pytest.mark.parametrize("event", few(["clear", "construct"], "clear"))
def test_a_buffer_cleared_or_made_anew_is_empty(intra: Intra, analyse: Analyse, event: str) -> None:
    intra.publish(0)
    if event == "clear":
        intra.system.add("ros2:rclcpp_ring_buffer_clear", LISTENER, buffer=0xB0)
    else:
        intra.system.buffer(LISTENER, 0xB0, 0x20 + 0x2000)
    intra.dequeue(0)
    assert analyse(intra.system).rows(LINKS) == []


def test_a_gap_may_hide_another_use_of_the_slot(intra: Intra, analyse: Analyse) -> None:
    intra.publish(0)
    intra.system.lose(cpu=3)
    intra.dequeue(0)
    assert analyse(intra.system).rows(LINKS) == []


@pytest.mark.parametrize("is_lossy", [False, True])
def test_a_gap_of_the_trace_in_which_the_message_was_put_in_counts_too(
    intra: Intra, analyse: Analyse, is_lossy: bool
) -> None:
    """A process may be recorded by two sessions: a snapshot, and one that runs all the time."""
    system, talker = intra.system, Thread(100, trace=1)
    system.add_source(0, "alpha", "boot", "runtime")
    system.add_source(1, "alpha", "boot", "snapshot")
    system.add("ros2:rclcpp_intra_publish", talker, publisher_handle=0x10, message=0xA)
    system.add(
        "ros2:rclcpp_ring_buffer_enqueue", talker, buffer=0xB0, index=0, size=1, overwritten=0
    )
    if is_lossy:
        system.lose(cpu=3, trace=1)
    intra.dequeue(0)
    assert len(analyse(system).rows(LINKS)) == (not is_lossy)


@pytest.mark.thorough
def test_a_gap_may_have_begun_before_the_message(intra: Intra, analyse: Analyse) -> None:
    """One that was over by then hides nothing."""
    published = [intra.publish(0)]
    taken = [intra.dequeue(0)]
    begin = intra.system.start(TALKER, 0xC1)
    intra.publish(0)
    middle = intra.system.end(TALKER, 0xC1)
    intra.dequeue(0)
    published.append(intra.publish(0))
    taken.append(intra.dequeue(0))
    intra.system.add_packet(0, 10_000, cpu=0)
    intra.system.add_packet(0, middle, last_event=begin, discarded=3, cpu=3)
    intra.system.add_packet(middle, 10_000, cpu=3)
    assert analyse(intra.system).rows(LINKS) == [
        (one, at, "ring_buffer") for one, at in zip(published, taken, strict=True)
    ]


@pytest.mark.parametrize(("stay", "is_linked"), [(1_999, True), (2_000, False)])
def test_a_gap_too_short_for_the_buffer_to_come_round(
    intra: Intra, analyse: Analyse, stay: int, is_linked: bool
) -> None:
    """It has two slots, and messages came a microsecond apart, or more."""
    for slot, pause in ((0, 980), (1, 5_000)):
        intra.publish(slot)
        intra.system.wait(pause)
    for slot in (0, 1):
        intra.dequeue(slot)
    published = intra.publish(0)
    put = published + 10
    # What comes behind the gap says nothing of how fast they come.
    intra.system.add_packet(0, put + 600, last_event=put + 500, discarded=3, cpu=3)
    intra.system.add_packet(put + 600, 50_000, cpu=3)
    intra.system.add_packet(0, 50_000, cpu=0)
    intra.system.wait(stay - 10)
    taken = intra.dequeue(0)
    assert taken == put + stay
    rows = analyse(intra.system).rows(LINKS)
    assert len(rows) == 2 + is_linked
    assert ((published, taken, "ring_buffer") in rows) is is_linked


def test_buffers_of_other_processes_are_others(intra: Intra, analyse: Analyse) -> None:
    intra.publish(0)
    other = Thread(200)
    intra.system.add("ros2:rclcpp_ring_buffer_dequeue", other, buffer=0xB0, index=0, size=0)
    assert analyse(intra.system).rows(LINKS) == []


def test_one_message_into_several_buffers(intra: Intra, analyse: Analyse) -> None:
    intra.system.subscription(LISTENER, 0x21, "/a", callback=0xCC)
    intra.system.buffer(LISTENER, 0xB1, 0x21 + 0x2000)
    published = intra.publish(0)
    intra.enqueue(0, buffer=0xB1)
    taken = [intra.dequeue(0), intra.dequeue(0, buffer=0xB1)]
    assert analyse(intra.system).rows(LINKS) == [(published, at, "ring_buffer") for at in taken]


def test_a_replay_for_a_late_subscription_is_no_publication(intra: Intra, analyse: Analyse) -> None:
    """Which message is replayed is not said."""
    intra.publish(0, buffer=0xB9)
    intra.system.start(TALKER, 0xC9)
    intra.enqueue(0)
    intra.system.end(TALKER, 0xC9)
    intra.dequeue(0)
    model = analyse(intra.system)
    assert model.rows(LINKS) == []
    assert model.value("SELECT count(*) FROM publication") == 1


def test_the_copy_through_the_middleware_is_a_message_too(intra: Intra, analyse: Analyse) -> None:
    """It is taken without a callback, and has the same publication."""
    intra.publish(0)
    intra.system.publish(TALKER, 0x10, 777)
    intra.dequeue(0)
    intra.system.take(LISTENER, 0x20, 777)
    model = analyse(intra.system)
    assert model.rows(
        "SELECT l.publication_id, l.method, i.callback_instance_id IS NOT NULL "
        "FROM link_transport AS l LEFT JOIN callback_instance AS i USING (take_id) "
        "ORDER BY l.take_id"
    ) == [(1, "ring_buffer", True), (1, "exact", False)]


REASONS = "SELECT o.reason FROM stat_orphan AS o JOIN take AS t USING (take_id) ORDER BY t.taken_ns"


def test_behind_a_gap_what_was_put_in_is_lost(intra: Intra, analyse: Analyse) -> None:
    """Once a later message is known, so is that those before it have left the buffer."""
    intra.publish(0)
    intra.dequeue(0)
    intra.system.lose()
    intra.system.wait(1_000)
    intra.dequeue(1)
    intra.publish(2)
    intra.dequeue(2)
    intra.dequeue(0)
    assert analyse(intra.system).column(REASONS) == ["publisher_gap", "no_stamp"]


@pytest.mark.thorough
def test_what_is_kept_for_who_comes_late_has_no_publication(intra: Intra, analyse: Analyse) -> None:
    intra.enqueue(0)
    intra.dequeue(0)
    assert analyse(intra.system).column(REASONS) == ["no_stamp"]


def test_the_copy_by_the_middleware_is_no_delivery(intra: Intra, analyse: Analyse) -> None:
    """The second message is overwritten in the buffer; its copy reaches no callback."""
    system = intra.system
    intra.publish(0)
    system.publish(TALKER, 0x10, 1)
    intra.dequeue(0)
    intra.publish(1)
    system.add("ros2:rcl_publish", TALKER, publisher_handle=0x10, message=0xA)
    system.add("ros2:rmw_publish", TALKER, rmw_publisher_handle=0x1010, message=0xA, timestamp=2)
    system.take(LISTENER, 0x20, 2)
    intra.publish(2)
    intra.dequeue(2)
    model = analyse(system)
    assert model.rows("SELECT method, is_copy FROM link_transport ORDER BY take_id") == [
        ("ring_buffer", False),
        ("exact", True),
        ("ring_buffer", False),
    ]
    assert model.value("SELECT count(*) FROM stat_delivery WHERE status = 'delivered'") == 2
    assert model.value("SELECT count(*) FROM derive.flow_transport") == 2
    assert (
        model.value(
            "SELECT count(*) FROM stat_delivery WHERE status <> 'delivered' AND publication_id IN "
            "(SELECT publication_id FROM link_transport WHERE is_copy)"
        )
        == 1
    )


@pytest.mark.thorough
@pytest.mark.parametrize("is_reader", [True, False])
def test_a_copy_for_a_reader_that_never_gets_its_turn(
    intra: Intra, analyse: Analyse, *, is_reader: bool
) -> None:
    """Its second callback, for the buffer, shows that it reads one; nothing was taken from it."""
    system = intra.system
    if is_reader:
        system.add(
            "ros2:rclcpp_subscription_init", LISTENER, subscription_handle=0x20, subscription=0x3020
        )
        system.subscription_callback(LISTENER, 0x3020, 0xCC)
    intra.publish(0)
    system.publish(TALKER, 0x10, 1)
    system.take(LISTENER, 0x20, 1)
    model = analyse(system)
    assert model.rows("SELECT method, is_copy FROM link_transport") == [("exact", is_reader)]
    delivered = "SELECT count(*) FROM stat_delivery WHERE status = 'delivered'"
    assert model.value(delivered) == (0 if is_reader else 1)


@pytest.mark.parametrize(
    ("called_by_buffer", "called_by_take", "is_in_process", "shows_intra", "is_copy"),
    [
        (True, False, True, False, True),
        # No callback shows that its subscription reads a buffer.
        (False, False, True, False, False),
        # One message of the publisher came to a callback through the middleware.
        thorough(True, True, True, False, False),
        # Another process passes nothing on in this one.
        thorough(True, False, False, False, False),
        # Where publishers show that they pass messages on, this one would have.
        thorough(True, False, True, True, False),
    ],
)
def test_copies_before_publishers_said_that_they_pass_messages_on(
    system: RosSystem,
    analyse: Analyse,
    *,
    called_by_buffer: bool,
    called_by_take: bool,
    is_in_process: bool,
    shows_intra: bool,
    is_copy: bool,
) -> None:
    """Humble and older: callbacks tell alone what came from within the process."""
    talker = TALKER if is_in_process else Thread(200)
    system.publisher(talker, 0x10, "/a")
    system.publisher(TALKER, 0x11, "/b")
    system.subscription(LISTENER, 0x20, "/a", callback=0xCB)
    system.add(
        "ros2:rclcpp_subscription_init", LISTENER, subscription_handle=0x20, subscription=0x3020
    )
    system.subscription_callback(LISTENER, 0x3020, 0xCC)
    for number in (1, 2):
        system.publish(talker, 0x10, number)
        system.take(LISTENER, 0x20, number)
        if called_by_take and number == 1:
            system.start(LISTENER, 0xCB)
            system.end(LISTENER, 0xCB)
        if called_by_buffer:
            system.start(LISTENER, 0xCC, intra=True)
            system.end(LISTENER, 0xCC)
        system.idle(LISTENER)
    if shows_intra:
        system.add("ros2:rclcpp_intra_publish", TALKER, publisher_handle=0x11, message=0xA)
    model = analyse(system)
    assert model.rows("SELECT method, is_copy FROM link_transport ORDER BY take_id") == [
        ("exact", is_copy),
        ("exact", is_copy),
    ]
