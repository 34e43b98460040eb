"""Why messages were not taken, and why the publication of a take is not known."""

from __future__ import annotations

import pytest
from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread

TALKER = Thread(100)
LISTENER = Thread(200)
OTHER = Thread(300)
MS = 1_000_000
REASONS = """
SELECT b.source_timestamp_ns, d.status, d.reason
FROM stat_delivery AS d JOIN publication AS b USING (publication_id) ORDER BY 1, d.subscription_id
"""
ORPHANS = """
SELECT t.source_timestamp_ns, o.reason
FROM stat_orphan AS o JOIN take AS t USING (take_id) ORDER BY t.taken_ns
"""


class Pair(RosSystem):
    """A talker that publishes on /a and a listener that takes from it, in processes of their own.

    Each has an executor, as the listener's waits tell what was in its queue.
    """

    def create(self, depth: int = 10) -> None:
        """Make the publisher, then the subscription."""
        self.publisher(TALKER, 0x10, "/a")
        self.add_subscription(depth)

    def add_subscription(self, depth: int = 10, handle: int = 0x30) -> None:
        """rcl_subscription_init of /a with this depth, with its callback."""
        self.subscription(LISTENER, handle, "/a", callback=0xC2, depth=depth)

    def send(self, *stamps: int) -> None:
        """Publish messages."""
        for stamp in stamps:
            self.publish(TALKER, 0x10, stamp)

    def hear(self, stamp: int, *, handle: int = 0x30) -> None:
        """Take a message and run the callback, with the executor around it."""
        self.ready(LISTENER)
        self.execute(LISTENER, handle)
        self.take(LISTENER, handle, stamp)
        self.start(LISTENER, 0xC2)
        self.end(LISTENER, 0xC2)
        self.ready(LISTENER)
        self.idle(LISTENER)

    def send_and_hear(self, stamp: int) -> None:
        """Publish a message that is taken at once."""
        self.send(stamp)
        self.hear(stamp)

    def go_on(self) -> None:
        """All processes are seen once more, so that none ends before the others."""
        for thread in (TALKER, LISTENER):
            self.ready(thread)


@pytest.fixture
def pair() -> Pair:
    return Pair()


def reasons(analysis: Analysis) -> dict[int, str | None]:
    """Return stamp -> reason, which is None for what was delivered."""
    return {stamp: reason for stamp, _, reason in analysis.rows(REASONS)}


def test_what_was_taken_has_no_reason(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.send_and_hear(1)
    assert analyse(pair).rows(REASONS) == [(1, "delivered", None)]


@pytest.mark.thorough
def test_before_the_subscription_there_was(pair: Pair, analyse: Analyse) -> None:
    pair.publisher(TALKER, 0x10, "/a")
    pair.send(1)
    pair.add_subscription()
    pair.send_and_hear(2)
    assert analyse(pair).rows(REASONS) == [
        (1, "not_connected", "before_subscription"),
        (2, "delivered", None),
    ]


@pytest.mark.thorough
def test_before_discovery_nothing_arrives(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.send(1, 2)
    pair.send_and_hear(3)
    assert reasons(analyse(pair)) == {
        1: "before_discovery",
        2: "before_discovery",
        3: None,
    }


@pytest.mark.thorough
def test_a_process_that_is_seen_no_more_has_ended(pair: Pair, analyse: Analyse) -> None:
    """Others go on for much longer than a message ever took."""
    pair.create()
    pair.send_and_hear(1)
    pair.send(2)
    pair.wait(50 * MS)
    pair.send(3)
    assert reasons(analyse(pair)) == {
        1: None,
        2: "subscription_ended",
        3: "subscription_ended",
    }


def test_at_the_end_of_the_trace_messages_are_pending(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.send_and_hear(1)
    pair.send(2)
    assert reasons(analyse(pair)) == {1: None, 2: "pending_at_end"}


@pytest.mark.thorough
def test_a_subscription_ends_where_its_handle_is_used_again(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.send_and_hear(1)
    pair.add_subscription()
    pair.send_and_hear(2)
    assert analyse(pair).rows(REASONS) == [
        (1, "delivered", None),
        (1, "not_connected", "before_subscription"),
        (2, "not_connected", "subscription_ended"),
        (2, "delivered", None),
    ]


def test_a_gap_of_the_receiver_may_hide_the_take(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.send_and_hear(1)
    pair.send(2)
    pair.lose()
    pair.wait(100)
    pair.send_and_hear(3)
    pair.send(4)
    pair.send_and_hear(5)
    assert reasons(analyse(pair)) == {
        1: None,
        2: "receiver_gap",
        3: None,
        4: "lost_in_transport",
        5: None,
    }


def test_an_attempt_that_took_nothing(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.send_and_hear(1)
    pair.send(2)
    pair.take(LISTENER, 0x30, 0, taken=0, layers="rmw")
    pair.send_and_hear(3)
    model = analyse(pair)
    assert reasons(model) == {1: None, 2: "take_failed", 3: None}
    assert model.value("SELECT count(*) FROM failed_take") == 1


@pytest.mark.thorough
def test_a_callback_that_looks_for_a_message_and_finds_none(pair: Pair, analyse: Analyse) -> None:
    """It was told of none: the two were not connected yet."""
    pair.create()
    pair.send(1)
    pair.start(LISTENER, 0xC9)
    pair.take(LISTENER, 0x30, 0, taken=0, layers="rmw")
    pair.end(LISTENER, 0xC9)
    pair.send_and_hear(2)
    assert reasons(analyse(pair)) == {1: "before_discovery", 2: None}


@pytest.mark.thorough
def test_where_nothing_was_ever_taken_nothing_was_overwritten(pair: Pair, analyse: Analyse) -> None:
    pair.create(depth=2)
    pair.send(1, 2, 3, 4)
    pair.go_on()
    assert reasons(analyse(pair)) == {
        1: "unknown",
        2: "unknown",
        3: "pending_at_end",
        4: "pending_at_end",
    }


def test_a_queue_that_was_full(pair: Pair, analyse: Analyse) -> None:
    """Of five messages the newest two fit; nobody can tell whether fewer were overwritten."""
    pair.create(depth=2)
    pair.send_and_hear(1)
    pair.send(2, 3, 4, 5, 6)
    pair.hear(5)
    pair.hear(6)
    model = analyse(pair)
    assert reasons(model) == {
        1: None,
        2: "overwritten",
        3: "overwritten",
        4: "overwritten",
        5: None,
        6: None,
    }
    assert ("dropped",) in model.rows("SELECT DISTINCT status FROM stat_delivery")


@pytest.mark.thorough
def test_without_a_depth_nobody_can_tell(pair: Pair, analyse: Analyse) -> None:
    pair.create(depth=0)
    pair.send_and_hear(1)
    pair.send(2, 3)
    pair.hear(3)
    assert analyse(pair).rows(REASONS)[1] == (2, "unknown", "unknown")


@pytest.mark.thorough
def test_a_reader_that_waits_has_nothing_in_its_queue(pair: Pair, analyse: Analyse) -> None:
    """It waited for longer than messages take: the message did not come, whatever the depth."""
    pair.create(depth=1)
    pair.send_and_hear(1)
    pair.send(2)
    pair.wait(20 * MS)
    pair.send_and_hear(3)
    pair.go_on()
    assert reasons(analyse(pair)) == {1: None, 2: "not_delivered", 3: None}


@pytest.mark.thorough
def test_a_reader_that_is_busy_tells_nothing(pair: Pair, analyse: Analyse) -> None:
    pair.create(depth=1)
    pair.send_and_hear(1)
    pair.ready(LISTENER)
    pair.start(LISTENER, 0xC9)
    pair.send(2)
    pair.wait(20 * MS)
    pair.send(3)
    pair.end(LISTENER, 0xC9)
    pair.ready(LISTENER)
    pair.idle(LISTENER)
    pair.hear(3)
    assert reasons(analyse(pair)) == {1: None, 2: "overwritten", 3: None}


def test_a_take_that_cannot_be_identified_may_be_any(pair: Pair, analyse: Analyse) -> None:
    """A callback that ran without a take traced was handed some message."""
    pair.create()
    pair.send_and_hear(1)
    pair.send(2)
    pair.start(LISTENER, 0xC2)
    pair.end(LISTENER, 0xC2)
    pair.send_and_hear(3)
    model = analyse(pair)
    assert reasons(model) == {1: None, 2: "unknown", 3: None}
    assert model.rows(ORPHANS) == [(None, "no_stamp")]


def test_hosts_with_clocks_apart_are_compared_by_messages(pair: Pair, analyse: Analyse) -> None:
    """Beta's clock is a second behind: takes seem to precede."""
    pair.add_source(1, "beta", "boot-b")
    listener, second = Thread(200, trace=1), 1_000 * MS
    base = 5 * second
    pair.publisher(TALKER, 0x10, "/a")
    pair.subscription(listener, 0x30, "/a", callback=0xC2)
    for number in range(4):
        sent = base + number * 30 * MS
        pair.add("ros2:rclcpp_publish", TALKER, ts=sent, message=0xA)
        pair.publish(TALKER, 0x10, number + 1, layers="rcl rmw")
        if number != 2:
            pair.add(
                "ros2:rmw_take",
                listener,
                ts=sent - second,
                message=0xB,
                taken=1,
                rmw_subscription_handle=0x1030,
                source_timestamp=number + 1,
            )
            pair.take(listener, 0x30, 0, layers="rcl rclcpp")
    assert reasons(analyse(pair)) == {1: None, 2: None, 3: "lost_in_transport", 4: None}


def test_no_stamp(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.hear(0)
    assert analyse(pair).rows(ORPHANS) == [(None, "no_stamp")]


def stamped(system: Pair) -> int:
    """Publish and take a message whose stamp is of the clock of the trace; return that."""
    stamp = system.publish(TALKER, 0x10, 0)
    system.events[-1][1]["timestamp"] = stamp
    system.hear(stamp)
    return stamp


@pytest.mark.thorough
def test_a_stamp_of_before_the_trace(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.hear(5)
    assert analyse(pair).rows(ORPHANS) == [(5, "before_tracing")]


@pytest.mark.thorough
def test_a_stamp_in_a_gap_of_the_publisher(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    stamped(pair)
    pair.lose()
    stamp = pair.now + 1
    pair.wait(100)
    pair.hear(stamp)
    pair.send(pair.now)
    assert (stamp, "publisher_gap") in analyse(pair).rows(ORPHANS)


@pytest.mark.thorough
def test_a_stamp_after_the_last_event_of_every_publisher(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    stamped(pair)
    pair.wait(20 * MS)
    stamp = pair.now
    pair.hear(stamp)
    assert analyse(pair).rows(ORPHANS) == [(stamp, "publisher_trace_ends")]


def test_a_publisher_that_is_not_traced(pair: Pair, analyse: Analyse) -> None:
    """The known publisher is seen before and after, and nothing is lost."""
    pair.create()
    stamped(pair)
    stamp = pair.now + 5
    pair.hear(stamp)
    stamped(pair)
    assert analyse(pair).rows(ORPHANS) == [(stamp, "publisher_not_traced")]


def test_more_takes_of_a_stamp_than_publications(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    stamp = stamped(pair)
    pair.hear(stamp)
    stamped(pair)
    assert analyse(pair).rows(ORPHANS) == [(stamp, "ambiguous")]


def test_every_take_and_message_is_accounted_for(pair: Pair, analyse: Analyse) -> None:
    """Two subscriptions, two publishers, some messages of each missing on a side."""
    pair.create(depth=1)
    pair.publisher(OTHER, 0x10, "/a")
    pair.subscription(OTHER, 0x30, "/a")
    pair.send(1, 2)
    pair.hear(2)
    pair.publish(OTHER, 0x10, 3)
    pair.take(OTHER, 0x30, 2)
    pair.take(OTHER, 0x30, 77)
    model = analyse(pair)
    assert model.value("SELECT count(*) FROM stat_delivery") == 3 * 2
    assert model.value(
        "SELECT (SELECT count(*) FROM take) = (SELECT count(DISTINCT take_id) FROM "
        "link_transport) + (SELECT count(*) FROM stat_orphan)"
    )


def test_a_gap_goes_before_the_end_of_a_process(pair: Pair, analyse: Analyse) -> None:
    """What came into the gap may have been taken there; what came long after it was not."""
    pair.create()
    pair.send_and_hear(1)
    pair.send(2)
    pair.lose()
    pair.wait(50 * MS)
    pair.send(3)
    pair.wait(50 * MS)
    pair.send(4)
    assert reasons(analyse(pair)) == {
        1: None,
        2: "receiver_gap",
        3: "subscription_ended",
        4: "subscription_ended",
    }


@pytest.mark.thorough
def test_a_gap_goes_before_a_failed_take(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.send_and_hear(1)
    pair.send(2)
    pair.lose()
    pair.wait(100)
    pair.take(LISTENER, 0x30, 0, taken=0, layers="rmw")
    pair.send_and_hear(3)
    assert reasons(analyse(pair)) == {1: None, 2: "receiver_gap", 3: None}


@pytest.mark.thorough
def test_what_cannot_be_identified_goes_before_a_failed_take(pair: Pair, analyse: Analyse) -> None:
    """Either may have been for the message."""
    pair.create()
    pair.send_and_hear(1)
    pair.send(2)
    pair.take(LISTENER, 0x30, 0, taken=0, layers="rmw")
    pair.start(LISTENER, 0xC2)
    pair.end(LISTENER, 0xC2)
    pair.send_and_hear(3)
    assert reasons(analyse(pair)) == {1: None, 2: "unknown", 3: None}


def test_what_cannot_be_identified_goes_before_discovery(pair: Pair, analyse: Analyse) -> None:
    """The callback may have been handed the message."""
    pair.create()
    pair.send(1)
    pair.start(LISTENER, 0xC2)
    pair.end(LISTENER, 0xC2)
    pair.send_and_hear(2)
    assert reasons(analyse(pair)) == {1: "unknown", 2: None}


def test_discovery_goes_before_waiting(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.idle(LISTENER)
    pair.send(1)
    pair.wait(20 * MS)
    pair.send_and_hear(2)
    pair.go_on()
    assert reasons(analyse(pair)) == {1: "before_discovery", 2: None}


@pytest.mark.thorough
def test_a_gap_may_hide_that_the_two_knew_each_other(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.send(1)
    pair.add_packet(1_000, pair.now)
    pair.lose()
    pair.wait(100)
    pair.ready(LISTENER)
    pair.send(2)
    pair.send_and_hear(3)
    assert reasons(analyse(pair)) == {1: "receiver_gap", 2: "unknown", 3: None}


@pytest.mark.thorough
@pytest.mark.parametrize(("late_ns", "reason"), [(300, "not_delivered"), (310, "overwritten")])
def test_a_reader_that_gets_no_cpu_seems_to_wait(
    pair: Pair, analyse: Analyse, late_ns: int, reason: str
) -> None:
    """What it takes after the wait had been there for long: the wait says nothing of its queue.

    The usual delay is 30 ns here.
    """
    pair.create(depth=1)
    pair.send_and_hear(1)
    pair.send(2)
    pair.wait(20 * MS)
    pair.send(3)
    pair.wait(late_ns - 10)
    pair.hear(3)
    pair.go_on()
    assert reasons(analyse(pair)) == {1: None, 2: reason, 3: None}


class Dual(Pair):
    """A session has the initialisation, another one starts later and has the rest."""

    def __init__(self) -> None:
        super().__init__()
        self.add_source(1, "alpha", "boot")
        self.talker, self.listener = Thread(100, trace=1), Thread(200, trace=1)
        self.create()
        self.wait(MS)


@pytest.mark.thorough
def test_before_the_receiver_is_recorded(analyse: Analyse) -> None:
    """The second session reaches the talker first: that the message was taken does not show."""
    dual = Dual()
    dual.publish(dual.talker, 0x10, 1)
    dual.publish(dual.talker, 0x10, 2)
    dual.take(dual.listener, 0x30, 2)
    assert reasons(analyse(dual)) == {1: "receiver_gap", 2: None}


@pytest.mark.thorough
def test_before_the_sender_is_recorded(analyse: Analyse) -> None:
    """The other way round: what was on its way then was stamped before the tracing of its sender.

    Though the trace of the initialisation begins earlier.
    """
    dual = Dual()
    dual.ready(dual.listener)
    dual.wait(20)
    stamp = dual.now
    dual.take(dual.listener, 0x30, stamp)
    dual.wait(MS)
    dual.publish(dual.talker, 0x10, dual.now)
    assert analyse(dual).rows(ORPHANS) == [(stamp, "before_tracing")]


def paused(pair: Pair, begin: int, end: int) -> None:
    """All streams of the trace are silent from `begin` to `end`."""
    pair.add_packet(1_000, begin)
    pair.add_packet(end, pair.now)


@pytest.mark.thorough
def test_processes_leave_one_after_the_other_before_a_pause(pair: Pair, analyse: Analyse) -> None:
    """The talker was told to stop first: what it sent then is not in the trace."""
    pair.create()
    stamped(pair)
    pair.wait(5 * MS)
    stamp = pair.now
    pair.wait(5 * MS)
    pair.hear(stamp)
    begin = pair.now
    pair.wait(30 * MS)
    end = pair.now
    pair.ready(LISTENER)
    pair.wait(5 * MS)
    later = pair.now
    pair.wait(5 * MS)
    pair.hear(later)
    stamped(pair)
    paused(pair, begin, end)
    assert analyse(pair).rows(ORPHANS) == [(stamp, "publisher_gap"), (later, "publisher_gap")]


@pytest.mark.thorough
def test_a_publisher_without_a_topic_may_be_the_sender(pair: Pair, analyse: Analyse) -> None:
    """Its initialisation was lost, and what it published in the gap as well."""
    pair.create()
    pair.publish(OTHER, 0x77, 3)
    stamped(pair)
    pair.add_source(1, "alpha", "boot")
    pair.publish(Thread(300, trace=1), 0x77, 4)
    pair.lose(trace=1)
    stamp = pair.now + 1
    pair.wait(MS)
    pair.hear(stamp)
    pair.publish(Thread(300, trace=1), 0x77, 5)
    stamped(pair)
    assert (stamp, "publisher_gap") in analyse(pair).rows(ORPHANS)


@pytest.mark.thorough
def test_a_publisher_without_a_topic_that_was_recorded_is_not(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    pair.publish(OTHER, 0x77, 3)
    stamped(pair)
    pair.wait(5 * MS)
    stamp = pair.now + 5
    pair.hear(stamp)
    pair.wait(5 * MS)
    pair.publish(OTHER, 0x77, 4)
    stamped(pair)
    assert analyse(pair).rows(ORPHANS) == [(stamp, "publisher_not_traced")]


@pytest.mark.thorough
def test_a_publisher_that_was_created_later_is_not(pair: Pair, analyse: Analyse) -> None:
    """Of those that there were, all had ended."""
    pair.create()
    stamped(pair)
    pair.wait(20 * MS)
    stamp = pair.now
    pair.hear(stamp)
    pair.wait(20 * MS)
    pair.publisher(OTHER, 0x10, "/a")
    pair.publish(OTHER, 0x10, pair.now)
    assert analyse(pair).rows(ORPHANS) == [(stamp, "publisher_trace_ends")]


def test_the_event_with_the_stamp_was_lost(pair: Pair, analyse: Analyse) -> None:
    pair.create()
    stamped(pair)
    pair.lose()
    pair.wait(100)
    pair.take(LISTENER, 0x30, 0, layers="rcl rclcpp")
    pair.wait(100)
    pair.take(LISTENER, 0x30, 0, layers="rcl rclcpp")
    assert analyse(pair).rows(ORPHANS) == [(None, "receiver_gap"), (None, "no_stamp")]
