"""Messages that callbacks take by themselves (polling subscriptions)."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import thorough

PLANNER = Thread(200)
LINKS = (
    "SELECT b.source_timestamp_ns, t.source_timestamp_ns, l.kind, l.callback_instance_id "
    "FROM link_causal AS l JOIN publication AS b USING (publication_id) "
    "LEFT JOIN take AS t ON l.take_id = t.take_id WHERE l.kind <> 'direct' ORDER BY ALL"
)


@pytest.fixture
def planner(system: RosSystem) -> RosSystem:
    """A timer 0xC9 that polls /a and /b and publishes /plan, and a callback 0xC8 of /c."""
    system.subscription(PLANNER, 0x20, "/a")
    system.subscription(PLANNER, 0x21, "/b")
    system.subscription(PLANNER, 0x22, "/c", callback=0xC8)
    system.publisher(PLANNER, 0x11, "/plan")
    system.timer(PLANNER, 0x30, callback=0xC9)
    return system


def test_the_last_of_each_topic_before_the_publication(
    planner: RosSystem, analyse: Analyse
) -> None:
    planner.start(PLANNER, 0xC9)
    planner.publish(PLANNER, 0x11, 1)
    planner.take(PLANNER, 0x20, 11)
    planner.publish(PLANNER, 0x11, 2)
    planner.take(PLANNER, 0x21, 12)
    planner.take(PLANNER, 0x20, 13)
    planner.publish(PLANNER, 0x11, 3)
    planner.publish(PLANNER, 0x11, 4)
    planner.take(PLANNER, 0x20, 14)
    planner.end(PLANNER, 0xC9)
    planner.start(PLANNER, 0xC9)
    planner.publish(PLANNER, 0x11, 5)
    planner.end(PLANNER, 0xC9)
    assert analyse(planner).rows(LINKS) == [
        (2, 11, "polled", None),
        (3, 12, "polled", None),
        (3, 13, "polled", None),
        (4, 12, "polled", None),
        (4, 13, "polled", None),
    ]


@pytest.mark.thorough
def test_beside_the_message_that_the_callback_is_for(planner: RosSystem, analyse: Analyse) -> None:
    planner.take(PLANNER, 0x22, 10)
    planner.start(PLANNER, 0xC8)
    planner.take(PLANNER, 0x20, 11)
    planner.publish(PLANNER, 0x11, 1)
    planner.end(PLANNER, 0xC8)
    assert analyse(planner).rows(LINKS) == [(1, 11, "polled", None)]


@pytest.mark.thorough
def test_callbacks_nested_in_it_have_their_own(planner: RosSystem, analyse: Analyse) -> None:
    """And it has none of theirs."""
    planner.start(PLANNER, 0xC9)
    planner.take(PLANNER, 0x20, 11)
    planner.take(PLANNER, 0x22, 12)
    planner.start(PLANNER, 0xC8)
    planner.take(PLANNER, 0x21, 13)
    planner.publish(PLANNER, 0x11, 1)
    planner.end(PLANNER, 0xC8)
    planner.publish(PLANNER, 0x11, 2)
    planner.take(PLANNER, 0x21, 14)
    planner.publish(PLANNER, 0x11, 3)
    planner.end(PLANNER, 0xC9)
    assert analyse(planner).rows(LINKS) == [
        (1, 13, "polled", None),
        (2, 11, "polled", None),
        (3, 11, "polled", None),
        (3, 14, "polled", None),
    ]


def test_not_on_another_thread_nor_behind_the_callback(
    planner: RosSystem, analyse: Analyse
) -> None:
    planner.start(PLANNER, 0xC9)
    planner.take(PLANNER, 0x20, 11)
    planner.publish(Thread(200, 201), 0x11, 1)
    planner.end(PLANNER, 0xC9)
    planner.publish(PLANNER, 0x11, 2)
    assert analyse(planner).rows(LINKS) == []


def test_not_across_a_gap(planner: RosSystem, analyse: Analyse) -> None:
    """On a CPU that the thread may have visited."""
    planner.start(PLANNER, 0xC9)
    taken = planner.take(PLANNER, 0x20, 11)
    published = planner.publish(PLANNER, 0x11, 2)
    planner.end(PLANNER, 0xC9)
    planner.add_packet(0, 10_000, cpu=0)
    planner.add_packet(0, published - 1, last_event=taken - 100, discarded=3, cpu=1)
    assert analyse(planner).rows(LINKS) == []


@pytest.mark.parametrize(
    ("from_taken", "until_taken", "count"),
    [(-50, 0, 1), (-50, 1, 0), thorough(0, 0, 0), thorough(0, 5, 0)],
)
def test_a_gap_that_touches_the_take(
    planner: RosSystem, analyse: Analyse, from_taken: int, until_taken: int, count: int
) -> None:
    """Behind it, or before: from the last event of a packet to its end."""
    planner.start(PLANNER, 0xC9)
    taken = planner.take(PLANNER, 0x20, 11)
    planner.publish(PLANNER, 0x11, 2)
    planner.end(PLANNER, 0xC9)
    planner.add_packet(0, taken + until_taken, last_event=taken + from_taken, discarded=3, cpu=1)
    assert len(analyse(planner).rows(LINKS)) == count


@pytest.mark.thorough
def test_a_gap_parts_only_those_on_either_side(planner: RosSystem, analyse: Analyse) -> None:
    """It is in one of two messages' ways, and in the way to one of two publications."""
    planner.add_source(1, "beta", "other boot")
    other = Thread(300, trace=1)
    planner.publisher(other, 0x61, "/b")
    planner.start(PLANNER, 0xC9)
    planner.take(PLANNER, 0x20, 11)
    before = planner.publish(PLANNER, 0x11, 2)
    planner.wait(1_000)
    after = planner.take(PLANNER, 0x21, 12)
    planner.publish(PLANNER, 0x11, 3)
    planner.end(PLANNER, 0xC9)
    planner.add_packet(0, after - 10, last_event=before + 100, discarded=3, cpu=1)
    planner.add_packet(0, 10_000, last_event=100, discarded=3, trace=1)
    assert analyse(planner).rows(LINKS) == [(2, 11, "polled", None), (3, 12, "polled", None)]


@pytest.mark.thorough
def test_a_gap_in_the_callback_marks_what_follows(planner: RosSystem, analyse: Analyse) -> None:
    planner.start(PLANNER, 0xC9)
    planner.wait(1_000)
    taken = planner.take(PLANNER, 0x20, 11)
    planner.publish(PLANNER, 0x11, 2)
    planner.end(PLANNER, 0xC9)
    planner.add_packet(0, taken - 10, last_event=taken - 500, discarded=3, cpu=1)
    assert analyse(planner).rows(
        "SELECT is_loss_affected FROM link_causal WHERE kind = 'polled'"
    ) == [(True,)]


def test_a_subscription_that_has_a_callback_too(planner: RosSystem, analyse: Analyse) -> None:
    planner.take(PLANNER, 0x22, 10)
    planner.start(PLANNER, 0xC8)
    planner.end(PLANNER, 0xC8)
    planner.start(PLANNER, 0xC9)
    planner.take(PLANNER, 0x22, 11)
    planner.publish(PLANNER, 0x11, 1)
    planner.end(PLANNER, 0xC9)
    assert analyse(planner).rows(LINKS) == [(1, 11, "polled", None)]


@pytest.mark.thorough
def test_a_callback_of_another_thread_took_nothing(planner: RosSystem, analyse: Analyse) -> None:
    other = Thread(200, 201)
    planner.timer(other, 0x31, callback=0xC6)
    planner.start(PLANNER, 0xC9)
    planner.start(other, 0xC6)
    planner.take(PLANNER, 0x20, 11)
    planner.publish(other, 0x11, 1)
    planner.take(other, 0x21, 12)
    planner.end(other, 0xC6)
    planner.publish(PLANNER, 0x11, 2)
    planner.end(PLANNER, 0xC9)
    assert analyse(planner).rows(LINKS) == [(2, 11, "polled", None)]


def test_a_copy_of_an_intra_process_message_is_not_polled(
    planner: RosSystem, analyse: Analyse
) -> None:
    """An executor that spins in a callback takes it, and has a callback for the original only."""
    planner.subscription(PLANNER, 0x23, "/d", callback=0xC7)
    planner.start(PLANNER, 0xC9)
    planner.start(PLANNER, 0xC7, intra=True)
    planner.end(PLANNER, 0xC7)
    planner.take(PLANNER, 0x23, 11)
    planner.take(PLANNER, 0x20, 12)
    planner.publish(PLANNER, 0x11, 1)
    planner.end(PLANNER, 0xC9)
    assert analyse(planner).rows(LINKS) == [(1, 12, "polled", None)]
