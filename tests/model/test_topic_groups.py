"""Topics that messages tell of objects whose initialisation was not traced."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import thorough

TALKER = Thread(100)
LISTENER = Thread(200)
LINKS = "SELECT publication_id, take_id, method FROM link_transport ORDER BY take_id"
TOPICS = "SELECT publisher_handle, topic_name FROM publisher ORDER BY publisher_handle"


def test_one_message_names_the_topic_of_all(system: RosSystem, analyse: Analyse) -> None:
    """Two publishers stamp alike: which message is whose, others of theirs tell."""
    system.subscription(LISTENER, 0x20, "/a")
    system.subscription(LISTENER, 0x21, "/b")
    for stamp, handles in ((1, (0x10,)), (2, (0x11,)), (3, (0x10, 0x11))):
        for handle in handles:
            system.publish(TALKER, handle, stamp)
        for handle in handles:
            system.take(LISTENER, handle + 0x10, stamp)
    model = analyse(system)
    assert model.rows(LINKS) == [(n, n, "exact_stamp") for n in (1, 2, 3, 4)]
    assert model.rows(TOPICS) == [(0x10, "/a"), (0x11, "/b")]


@pytest.mark.thorough
def test_a_name_is_not_needed(system: RosSystem, analyse: Analyse) -> None:
    """Nothing was initialised in the trace at all."""
    for stamp, handles in ((1, (0x10,)), (2, (0x11,)), (3, (0x10, 0x11))):
        for handle in handles:
            system.publish(TALKER, handle, stamp)
        for handle in reversed(handles):
            system.take(LISTENER, handle + 0x10, stamp)
    model = analyse(system)
    assert model.rows(LINKS) == [
        (1, 1, "exact_stamp"),
        (2, 2, "exact_stamp"),
        (4, 3, "exact_stamp"),
        (3, 4, "exact_stamp"),
    ]
    assert model.rows(TOPICS) == [(0x10, None), (0x11, None)]


def test_topics_travel_over_several_steps(system: RosSystem, analyse: Analyse) -> None:
    """A known publisher, an unknown subscription, an unknown publisher that it hears too."""
    system.publisher(TALKER, 0x10, "/a")
    other = Thread(300)
    for thread, handle, stamp in ((TALKER, 0x10, 1), (other, 0x11, 2)):
        system.publish(thread, handle, stamp)
        system.take(LISTENER, 0x20, stamp)
    model = analyse(system)
    assert model.rows(TOPICS) == [(0x10, "/a"), (0x11, "/a")]
    assert model.column("SELECT topic_name FROM subscription") == ["/a"]


def test_contradictions_teach_nothing(system: RosSystem, analyse: Analyse) -> None:
    """An address was used again for another topic, or stamps agree by chance."""
    system.subscription(LISTENER, 0x20, "/a")
    system.subscription(LISTENER, 0x21, "/b")
    for stamp, handle in ((1, 0x20), (2, 0x21)):
        system.publish(TALKER, 0x10, stamp)
        system.take(LISTENER, handle, stamp)
    model = analyse(system)
    assert model.rows(TOPICS) == [(0x10, None)]
    assert model.rows(LINKS) == [(1, 1, "exact_stamp"), (2, 2, "exact_stamp")]


@pytest.mark.parametrize(
    ("of_publisher", "of_reader", "topic"), [(10, 11, None), thorough(11, 10, None), (11, 11, "/a")]
)
def test_less_than_a_tenth_on_both_sides_is_chance(
    system: RosSystem, analyse: Analyse, of_publisher: int, of_reader: int, topic: str | None
) -> None:
    """One message to a reader of another topic: of so many to its own, of so many it has there."""
    system.publisher(TALKER, 0x11, "/b")
    system.subscription(LISTENER, 0x20, "/a")
    system.subscription(LISTENER, 0x21, "/b")
    pairs = [(0x10, 0x20)] * of_publisher + [(0x10, 0x21)] + [(0x11, 0x21)] * of_reader
    for stamp, (publisher, reader) in enumerate(pairs, start=1):
        system.publish(TALKER, publisher, stamp)
        system.take(LISTENER, reader, stamp)
    assert analyse(system).rows(TOPICS) == [(0x10, topic), (0x11, "/b")]
