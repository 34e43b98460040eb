"""Messages from publication to take, by equal stamps."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

TALKER = Thread(100)
LISTENER = Thread(200)
LINKS = (
    "SELECT l.publication_id, l.take_id, l.method, l.candidate_count FROM link_transport AS l "
    "ORDER BY l.take_id, l.publication_id"
)


@pytest.fixture
def pair(system: RosSystem) -> RosSystem:
    """A publisher and a subscription of /a in two processes."""
    system.publisher(TALKER, 0x10, "/a")
    system.subscription(LISTENER, 0x20, "/a", callback=0xCB)
    return system


def test_equal_stamps_on_one_topic(pair: RosSystem, analyse: Analyse) -> None:
    for stamp in (1, 2):
        pair.publish(TALKER, 0x10, stamp)
    for stamp in (2, 1, 3):
        pair.take(LISTENER, 0x20, stamp)
    assert analyse(pair).rows(LINKS) == [(2, 1, "exact", 1), (1, 2, "exact", 1)]


def test_latency_is_from_the_end_of_the_call_to_the_take(pair: RosSystem, analyse: Analyse) -> None:
    published = pair.publish(TALKER, 0x10, 1)
    taken = pair.take(LISTENER, 0x20, 1)
    assert analyse(pair).rows(
        "SELECT latency_ns, is_self_loop, is_loss_affected FROM link_transport"
    ) == [(taken - published - 20, False, False)]


def test_stamps_of_dds_and_caret(pair: RosSystem, analyse: Analyse) -> None:
    pair.publish_dds(TALKER, 0x10, 1)
    pair.publish(TALKER, 0x10, layers="rclcpp rcl")
    pair.add("ros2_caret:dds_write", TALKER, message=0xA)
    pair.add("ros2_caret:dds_bind_addr_to_stamp", TALKER, addr=0, source_stamp=2)
    for stamp in (1, 2):
        pair.take(LISTENER, 0x20, stamp)
    assert analyse(pair).rows(LINKS) == [(1, 1, "exact", 1), (2, 2, "exact", 1)]


def test_zero_is_no_stamp(pair: RosSystem, analyse: Analyse) -> None:
    """Nor is nothing."""
    pair.publish(TALKER, 0x10, 0)
    pair.publish(TALKER, 0x10, None)
    pair.take(LISTENER, 0x20, 0)
    assert analyse(pair).rows(LINKS) == []


@pytest.mark.thorough
def test_one_process_may_stamp_two_topics_alike(pair: RosSystem, analyse: Analyse) -> None:
    pair.publisher(TALKER, 0x11, "/b")
    pair.subscription(LISTENER, 0x21, "/b")
    for handle in (0x11, 0x10):
        pair.publish(TALKER, handle, 1)
    for handle in (0x20, 0x21):
        pair.take(LISTENER, handle, 1)
    assert analyse(pair).rows(LINKS) == [(2, 1, "exact", 1), (1, 2, "exact", 1)]


def test_topics_that_differ_are_no_link(pair: RosSystem, analyse: Analyse) -> None:
    """However alone the stamp is."""
    pair.publisher(TALKER, 0x11, "/b")
    pair.publish(TALKER, 0x11, 1)
    pair.take(LISTENER, 0x20, 1)
    assert analyse(pair).rows(LINKS) == []


def test_every_subscription_has_its_own_take(pair: RosSystem, analyse: Analyse) -> None:
    pair.subscription(LISTENER, 0x21, "/a")
    pair.subscription(Thread(300), 0x20, "/a")
    pair.publish(TALKER, 0x10, 1)
    for thread, handle in ((LISTENER, 0x20), (LISTENER, 0x21), (Thread(300), 0x20)):
        pair.take(thread, handle, 1)
    assert analyse(pair).rows(LINKS) == [(1, n, "exact", 1) for n in (1, 2, 3)]


@pytest.mark.thorough
def test_equal_topic_and_stamp_pair_in_order(pair: RosSystem, analyse: Analyse) -> None:
    """The k-th publication belongs to the k-th take of each subscription; it is a guess."""
    pair.subscription(LISTENER, 0x21, "/a")
    for _ in range(3):
        pair.publish(TALKER, 0x10, 1)
    for handle in (0x20, 0x21, 0x20, 0x20, 0x20, 0x21):
        pair.take(LISTENER, handle, 1)
    assert analyse(pair).rows(LINKS) == [
        (1, 1, "exact", 4),
        (1, 2, "exact", 3),
        (2, 3, "exact", 4),
        (3, 4, "exact", 4),
        (2, 6, "exact", 3),
    ]


def test_more_takes_than_publications_are_a_guess(pair: RosSystem, analyse: Analyse) -> None:
    """The publication of one take was lost, and it may be that of either."""
    pair.publish(TALKER, 0x10, 1)
    pair.publish(TALKER, 0x10, 2)
    for stamp in (1, 1, 2):
        pair.take(LISTENER, 0x20, stamp)
    assert analyse(pair).rows(LINKS) == [(1, 1, "exact", 2), (2, 3, "exact", 1)]


@pytest.mark.thorough
def test_a_topic_unknown_where_it_was_published(system: RosSystem, analyse: Analyse) -> None:
    """The stamp alone is unique; the link teaches the publisher its topic."""
    system.subscription(LISTENER, 0x20, "/a")
    system.publish(TALKER, 0x10, 1)
    system.take(LISTENER, 0x20, 1)
    model = analyse(system)
    assert model.rows(LINKS) == [(1, 1, "exact_stamp", 1)]
    assert model.rows("SELECT topic_name, is_inferred FROM publisher") == [("/a", True)]


def test_a_topic_unknown_where_it_was_taken(system: RosSystem, analyse: Analyse) -> None:
    system.publisher(TALKER, 0x10, "/a")
    system.publish(TALKER, 0x10, 1)
    system.take(LISTENER, 0x20, 1)
    model = analyse(system)
    assert model.rows(LINKS) == [(1, 1, "exact_stamp", 1)]
    assert model.rows("SELECT topic_name, is_inferred FROM subscription") == [("/a", True)]


@pytest.mark.thorough
def test_both_topics_unknown(system: RosSystem, analyse: Analyse) -> None:
    system.publish(TALKER, 0x10, 1)
    system.take(LISTENER, 0x20, 1)
    assert analyse(system).rows(LINKS) == [(1, 1, "exact_stamp", 1)]


def test_an_unknown_topic_with_two_candidates_is_no_link(
    system: RosSystem, analyse: Analyse
) -> None:
    system.publish(TALKER, 0x10, 1)
    system.publish(TALKER, 0x11, 1)
    system.take(LISTENER, 0x20, 1)
    assert analyse(system).rows(LINKS) == []


def test_a_known_topic_beats_an_unknown_one(pair: RosSystem, analyse: Analyse) -> None:
    pair.publish(TALKER, 0x77, 1)
    pair.publish(TALKER, 0x10, 1)
    pair.take(LISTENER, 0x20, 1)
    assert analyse(pair).rows(LINKS) == [(2, 1, "exact", 1)]


def test_one_publication_is_not_on_two_topics(system: RosSystem, analyse: Analyse) -> None:
    """Its topic is unknown, and takes of two topics have its stamp: it can be only one of them."""
    system.subscription(LISTENER, 0x20, "/a")
    system.subscription(LISTENER, 0x21, "/b")
    system.publish(TALKER, 0x10, 1)
    system.take(LISTENER, 0x20, 1)
    system.take(LISTENER, 0x21, 1)
    assert len(analyse(system).rows(LINKS)) <= 1


@pytest.mark.thorough
def test_clocks_apart_make_a_negative_latency(system: RosSystem, analyse: Analyse) -> None:
    """Equal stamps need no clocks."""
    talker, listener = Thread(100, trace=1), Thread(100, trace=0)
    system.add_source(0, "alpha", "boot-a")
    system.add_source(1, "beta", "boot-b")
    system.publisher(talker, 0x10, "/a")
    system.subscription(listener, 0x20, "/a")
    taken = system.take(listener, 0x20, 1)
    system.wait(1_000)
    published = system.publish(talker, 0x10, 1)
    model = analyse(system)
    assert model.rows(LINKS) == [(1, 1, "exact", 1)]
    assert model.value("SELECT latency_ns FROM link_transport") == taken - published - 20 < 0


def test_a_node_that_hears_itself_on_tf_is_a_self_loop(system: RosSystem, analyse: Analyse) -> None:
    """So does the listener node of its process; other topics and processes are ordinary."""
    other = Thread(200)
    system.node(TALKER, 0x1, "driver")
    system.node(TALKER, 0x2, "transform_listener_impl_5f")
    system.node(TALKER, 0x3, "planner")
    system.node(other, 0x1, "transform_listener_impl_60")
    expected = {}
    for stamp, topic in enumerate(("/tf", "/tf_static", "/a"), start=1):
        system.publisher(TALKER, stamp, topic, node=0x1)
        for thread, node in ((TALKER, 0x1), (TALKER, 0x2), (TALKER, 0x3), (other, 0x1)):
            handle = 0x20 + 0x10 * stamp + node
            system.subscription(thread, handle, topic, node=node)
            loop = topic != "/a" and thread is TALKER and node != 0x3
            expected[topic, thread.pid, node] = loop
        system.publish(Thread(100, 101), stamp, stamp)
        for thread, node in ((TALKER, 0x1), (TALKER, 0x2), (TALKER, 0x3), (other, 0x1)):
            system.take(thread, 0x20 + 0x10 * stamp + node, stamp)
    model = analyse(system)
    found = model.rows(
        "SELECT s.topic_name, p.pid, n.node_handle, l.is_self_loop FROM link_transport AS l "
        "JOIN take AS t USING (take_id) JOIN subscription AS s USING (subscription_id) "
        "JOIN node AS n ON s.node_id = n.node_id JOIN process AS p ON s.process_id = p.process_id"
    )
    assert {(topic, pid, node): loop for topic, pid, node, loop in found} == expected
    loops = sum(expected.values())
    assert model.value("SELECT count(*) FROM flow_edge WHERE link_kind = 'transport'") == (
        len(expected) - loops
    )
    assert model.rows(
        "SELECT p.topic_name, (SELECT count(*) FROM flow_forward('publication', b.publication_id) "
        "WHERE kind = 'take') FROM publication AS b JOIN publisher AS p USING (publisher_id) "
        "ORDER BY b.publication_id"
    ) == [("/tf", 2), ("/tf_static", 2), ("/a", 4)]
