"""Which publisher a publication belongs to, and what is known of publishers."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import WRITER, RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
WORKER = Thread(100, 101)
TOPICS = (
    "SELECT p.topic_name, b.source_timestamp_ns FROM publication AS b "
    "LEFT JOIN publisher AS p USING (publisher_id) ORDER BY b.publication_id"
)


def test_what_a_publisher_is(system: RosSystem, analyse: Analyse) -> None:
    """The GID is 16 bytes, whatever the trace has behind them."""
    system.node(MAIN, 0x1, "talker", "/robot")
    gid = list(range(1, 17))
    system.add("ros2:rmw_publisher_init", MAIN, rmw_publisher_handle=0x20, gid=gid + [255] * 8)
    created = system.add(
        "ros2:rcl_publisher_init",
        MAIN,
        publisher_handle=0x10,
        node_handle=0x1,
        rmw_publisher_handle=0x20,
        topic_name="/chatter",
        queue_depth=7,
    )
    system.add("ros2:rmw_publisher_init", MAIN, rmw_publisher_handle=0x21, gid=[0] * 16)
    system.add(
        "ros2:rcl_publisher_init",
        MAIN,
        publisher_handle=0x11,
        node_handle=0x1,
        rmw_publisher_handle=0x21,
        topic_name="/rosout",
        queue_depth=10,
    )
    model = analyse(system)
    assert model.rows(
        "SELECT p.topic_name, n.full_name, publisher_handle, rmw_handle, gid, queue_depth, "
        "is_internal, p.is_inferred FROM publisher AS p JOIN node AS n USING (node_id) ORDER BY 3"
    ) == [
        ("/chatter", "/robot/talker", 0x10, 0x20, bytes(gid), 7, False, False),
        ("/rosout", "/robot/talker", 0x11, 0x21, None, 10, True, False),
    ]
    assert model.column("SELECT created_ns FROM publisher ORDER BY 1")[0] == created - 10


def test_internal_topics(system: RosSystem, analyse: Analyse) -> None:
    topics = ["/parameter_events", "/rosout", "/robot/arm/transition_event", "/rosout_agg", "/tf"]
    for number, topic in enumerate(topics):
        system.publisher(MAIN, 0x10 + number, topic)
    internal = analyse(system).rows("SELECT topic_name, is_internal FROM publisher ORDER BY 1")
    assert dict(internal) == {topic: topic in topics[:3] for topic in topics}


def test_a_handle_is_that_of_the_publisher_initialised_last(
    system: RosSystem, analyse: Analyse
) -> None:
    system.publisher(MAIN, 0x10, "/old")
    system.publish(MAIN, 0x10, 1)
    system.publisher(MAIN, 0x10, "/new")
    system.publish(MAIN, 0x10, 2)
    assert analyse(system).rows(TOPICS) == [("/old", 1), ("/new", 2)]


def test_a_handle_means_nothing_in_another_process(system: RosSystem, analyse: Analyse) -> None:
    other = Thread(200)
    system.publisher(MAIN, 0x10, "/mine")
    system.publisher(other, 0x10, "/yours")
    system.publish(other, 0x10, 1)
    system.publish(MAIN, 0x10, 2)
    system.publish(WORKER, 0x10, 3)
    assert analyse(system).rows(TOPICS) == [("/yours", 1), ("/mine", 2), ("/mine", 3)]


def test_handles_never_initialised_are_placeholders(system: RosSystem, analyse: Analyse) -> None:
    """One for each handle and process; valid only until the handle is initialised."""
    other = Thread(200)
    for stamp in (1, 2):
        system.publish(MAIN, 0x10, stamp)
    system.publish(MAIN, 0x11, 3)
    system.publish(other, 0x10, 4)
    system.publisher(MAIN, 0x10, "/chatter")
    system.publish(MAIN, 0x10, 5)
    model = analyse(system)
    assert model.rows(TOPICS) == [(None, 1), (None, 2), (None, 3), (None, 4), ("/chatter", 5)]
    assert model.rows(
        "SELECT pid, publisher_handle, is_inferred, count(*) FROM publication "
        "JOIN publisher AS p USING (publisher_id) JOIN process AS r ON p.process_id = r.process_id "
        "GROUP BY ALL ORDER BY ALL"
    ) == [
        (100, 0x10, False, 1),
        (100, 0x10, True, 2),
        (100, 0x11, True, 1),
        (200, 0x10, True, 1),
    ]
    assert model.rows(
        "SELECT count FROM store.finding WHERE name = 'inferred_object' AND subject = 'publishers'"
    ) == [(3,)]


def test_rosout_by_its_rmw_handle(system: RosSystem, analyse: Analyse) -> None:
    """Its rcl handle was on the stack of its initialisation and never comes again."""
    system.publisher(MAIN, 0x10, "/rosout")
    system.publisher(MAIN, 0x11, "/rosout")
    system.publish(MAIN, 0xFF, 1, rmw=0x1011, layers="rcl rmw")
    model = analyse(system)
    assert model.rows(TOPICS) == [("/rosout", 1)]
    assert model.column("SELECT publisher_id FROM publication") == [2]


@pytest.mark.thorough
def test_rosout_by_its_dds_writer(system: RosSystem, analyse: Analyse) -> None:
    system.writer(MAIN, 0x10, "/rosout")
    system.publisher(MAIN, 0x10, "/rosout")
    system.writer(MAIN, 0x11, "/chatter")
    system.publisher(MAIN, 0x11, "/chatter")
    system.publish_dds(MAIN, 0xFF, 1, writer=0x10 + WRITER, layers="rcl rmw write_pre write")
    assert analyse(system).rows(TOPICS) == [("/rosout", 1)]


def test_dds_writer_by_its_gid(system: RosSystem, analyse: Analyse) -> None:
    """Two writers of one topic: prefix and entity are the GID of the publisher."""
    for number in (1, 2):
        gid = [number] * 16
        system.add(
            "dds:create_writer",
            MAIN,
            writer=0x70 + number,
            topic_name="rt/rosout",
            gid_prefix=gid[:12],
            gid_entity=gid[12:],
        )
        system.add(
            "ros2:rmw_publisher_init", MAIN, rmw_publisher_handle=0x20 + number, gid=gid + [9] * 8
        )
        system.add(
            "ros2:rcl_publisher_init",
            MAIN,
            publisher_handle=0x10 + number,
            node_handle=0x1,
            rmw_publisher_handle=0x20 + number,
            topic_name="/rosout",
            queue_depth=1,
        )
    for stamp, writer in enumerate((0x72, 0x71)):
        system.publish_dds(MAIN, 0xFF, stamp, writer=writer, layers="rcl rmw write_pre write")
    assert analyse(system).column(
        "SELECT publisher_handle FROM publication JOIN publisher USING (publisher_id) "
        "ORDER BY publication_id"
    ) == [0x12, 0x11]


def test_dds_writer_by_its_topic_where_the_publisher_has_no_gid(
    system: RosSystem, analyse: Analyse
) -> None:
    """Foxy: a writer belongs to the publisher that is initialised next, and to no other."""
    for number, topic in ((1, "/a"), (2, "/a"), (3, "/b")):
        if number != 2:
            system.add(
                "dds:create_writer",
                MAIN,
                writer=0x70 + number,
                topic_name=f"rt{topic}",
                gid_prefix=[number] * 12,
                gid_entity=[number] * 4,
            )
        system.add(
            "ros2:rcl_publisher_init",
            MAIN,
            publisher_handle=0x10 + number,
            node_handle=0x1,
            rmw_publisher_handle=0x20 + number,
            topic_name=topic,
            queue_depth=1,
        )
    for stamp, writer in enumerate((0x73, 0x71)):
        system.publish_dds(MAIN, 0xFF, stamp, writer=writer, layers="write_pre write")
    assert analyse(system).column(
        "SELECT publisher_handle FROM publication JOIN publisher USING (publisher_id) "
        "ORDER BY publication_id"
    ) == [0x13, 0x11]


def test_rosout_by_being_the_only_one_of_its_process(system: RosSystem, analyse: Analyse) -> None:
    """Humble without DDS events; what passed rclcpp is not from a logger."""
    system.publisher(MAIN, 0x10, "/rosout")
    system.add("ros2:rcl_publish", MAIN, publisher_handle=0xFF, message=0xA)
    system.add("ros2:rmw_publish", MAIN, message=0xA)
    system.add("ros2:rclcpp_publish", MAIN, message=0xB)
    system.add("ros2:rcl_publish", MAIN, publisher_handle=0xFE, message=0xB)
    model = analyse(system)
    assert model.rows(TOPICS) == [("/rosout", None), (None, None)]
    assert model.column("SELECT is_inferred FROM publisher ORDER BY publisher_id") == [False, True]


def test_one_of_several_rosout_of_a_process_is_not_guessed(
    system: RosSystem, analyse: Analyse
) -> None:
    """The topic is known, the node is not."""
    system.publisher(MAIN, 0x10, "/rosout")
    system.publisher(MAIN, 0x11, "/rosout")
    system.add("ros2:rcl_publish", MAIN, publisher_handle=0xFF, message=0xA)
    model = analyse(system)
    assert model.rows(
        "SELECT topic_name, is_internal, is_inferred FROM publication "
        "JOIN publisher USING (publisher_id)"
    ) == [("/rosout", True, True)]
    assert model.rows("SELECT * FROM store.finding WHERE subject = 'publishers'") == []


def test_a_publisher_with_another_rmw_handle_is_not_rosout(
    system: RosSystem, analyse: Analyse
) -> None:
    """Its own initialisation was lost; that of /rosout says which rmw handle /rosout has."""
    system.publisher(MAIN, 0x10, "/rosout")
    system.publish(MAIN, 0x30, 1, layers="rcl rmw")
    assert analyse(system).rows(TOPICS) == [(None, 1)]
