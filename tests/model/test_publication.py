"""One publish() is one publication, whatever layers it went through."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import WRITER, RosSystem
from support.staged_events import STEP_NS, Thread
from support.thorough import thorough

MAIN = Thread(100)
LAYERS = (
    "SELECT intra_ns, rclcpp_ns, rcl_ns, rmw_ns, dds_ns, source_timestamp_ns "
    "FROM publication ORDER BY publication_id"
)


def at(first: int, *positions: int | None) -> tuple[int | None, ...]:
    """Times of layers by their position in the call."""
    return tuple(None if n is None else first + n * STEP_NS for n in positions)


def test_layers_of_a_stamping_rmw(system: RosSystem, analyse: Analyse) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    first = system.publish(MAIN, 0x10, 777)
    model = analyse(system)
    assert model.rows(LAYERS) == [(None, *at(first, 0, 1, 2), None, 777)]
    assert model.rows("SELECT start_ns, end_ns FROM publication") == [at(first, 0, 2)]


def test_layers_of_a_stamping_dds(system: RosSystem, analyse: Analyse) -> None:
    """Its two events come in either order."""
    system.publisher(MAIN, 0x10, "/chatter")
    pre = system.publish_dds(MAIN, 0x10, 777, layers="rclcpp rcl rmw write_pre write")
    post = system.publish_dds(MAIN, 0x10, 778, layers="rclcpp rcl rmw write write_pre")
    model = analyse(system)
    assert model.rows(LAYERS) == [
        (None, *at(pre, 0, 1, 2, 4), 777),
        (None, *at(post, 0, 1, 2, 3), 778),
    ]
    assert model.rows("SELECT start_ns, end_ns FROM publication ORDER BY 1") == [
        at(pre, 0, 4),
        at(post, 0, 4),
    ]


def test_write_with_its_data_needs_no_write_pre(system: RosSystem, analyse: Analyse) -> None:
    """Cyclone DDS names the message in the write itself."""
    system.publisher(MAIN, 0x10, "/chatter")
    first = system.publish_dds(MAIN, 0x10, 777, layers="rclcpp rcl rmw")
    system.add("dds:write", MAIN, writer=0x99, data=0xA, timestamp=777)
    assert analyse(system).rows(LAYERS) == [(None, *at(first, 0, 1, 2, 3), 777)]


def test_calls_that_begin_below_rclcpp(system: RosSystem, analyse: Analyse) -> None:
    """Serialized messages, rclpy, and layers that were lost; nothing comes before them."""
    system.publisher(MAIN, 0x10, "/chatter")
    threads = [Thread(100, 101 + n) for n in range(3)]
    first = [
        system.publish(thread, 0x10, 777 + n, layers=layers)
        for n, (thread, layers) in enumerate(zip(threads, ("rcl rmw", "rmw", "rcl"), strict=True))
    ]
    model = analyse(system)
    assert model.rows(LAYERS) == [
        (None, None, *at(first[0], 0, 1), None, 777),
        (None, None, None, first[1], None, 778),
        (None, None, first[2], None, None, None),
    ]
    assert model.column("SELECT publisher_id FROM publication") == [1, 1, 1]


@pytest.mark.thorough
def test_a_layer_with_another_message_is_another_call(system: RosSystem, analyse: Analyse) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    system.publish(MAIN, 0x10, message=0xA, layers="rclcpp")
    system.publish(MAIN, 0x10, message=0xB, layers="rcl")
    system.publish(MAIN, 0x10, 777, message=0xC, layers="rmw")
    model = analyse(system)
    assert model.rows(
        "SELECT rclcpp_ns IS NOT NULL, rcl_ns IS NOT NULL, rmw_ns IS NOT NULL, source_timestamp_ns "
        "FROM publication ORDER BY publication_id"
    ) == [(True, False, False, None), (False, True, False, None), (False, False, True, 777)]


@pytest.mark.thorough
def test_the_same_message_published_twice_is_two_calls(system: RosSystem, analyse: Analyse) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    for stamp in (777, 778):
        system.publish(MAIN, 0x10, stamp)
    model = analyse(system)
    assert model.rows(
        "SELECT publication_id, publisher_id, source_timestamp_ns FROM publication ORDER BY ALL"
    ) == [(1, 1, 777), (2, 1, 778)]


def test_nothing_between_the_layers_but_the_thread_counts(
    system: RosSystem, analyse: Analyse
) -> None:
    """Another thread of the process publishes the same pointer at the same time."""
    other = Thread(100, 101)
    system.publisher(MAIN, 0x10, "/chatter")
    system.publisher(MAIN, 0x11, "/other")
    for layer in ("rclcpp", "rcl", "rmw"):
        system.publish(MAIN, 0x10, 777, layers=layer)
        system.publish(other, 0x11, 888, layers=layer)
    assert analyse(system).rows(
        "SELECT publisher_id, tid, rmw_ns - rclcpp_ns, source_timestamp_ns "
        "FROM publication JOIN thread USING (thread_id) ORDER BY ALL"
    ) == [(1, 100, 4 * STEP_NS, 777), (2, 101, 4 * STEP_NS, 888)]


@pytest.mark.thorough
def test_an_event_of_the_thread_between_two_layers_splits(
    system: RosSystem, analyse: Analyse
) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    system.publish(MAIN, 0x10, layers="rclcpp")
    system.start(MAIN, 0xC9)
    system.publish(MAIN, 0x10, 777, layers="rcl rmw")
    assert analyse(system).column("SELECT source_timestamp_ns FROM publication ORDER BY 1") == [
        777,
        None,
    ]


def test_a_gap_between_two_layers_splits(system: RosSystem, analyse: Analyse) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    system.publish(MAIN, 0x10, layers="rclcpp rcl")
    system.lose()
    system.publish(MAIN, 0x10, 777, layers="rmw")
    assert analyse(system).rows(
        "SELECT rcl_ns IS NOT NULL, source_timestamp_ns FROM publication ORDER BY publication_id"
    ) == [(True, None), (False, 777)]


def test_the_stamp_of_a_built_in_writer_is_not_that_of_the_message(
    system: RosSystem, analyse: Analyse
) -> None:
    """DDS announces itself with writers of its own, which may write inside a publish() call."""
    system.writer(MAIN, 0x10, "/chatter")
    system.publisher(MAIN, 0x10, "/chatter")
    system.publish_dds(MAIN, 0x10, 777, layers="rclcpp rcl rmw")
    system.add("dds:write", MAIN, writer=0xBEEF, timestamp=555)
    system.publish_dds(MAIN, 0x10, 777, layers="write_pre write")
    model = analyse(system)
    assert 555 not in model.column(
        "SELECT source_timestamp_ns FROM publication WHERE publisher_id IS NOT NULL"
    )
    assert model.column("SELECT publisher_id FROM publication WHERE source_timestamp_ns = 555") == [
        None
    ]
    assert model.column("SELECT publisher_id FROM publication WHERE source_timestamp_ns = 777") == [
        1
    ]


def test_a_write_of_another_writer_is_no_layer_of_the_call(
    system: RosSystem, analyse: Analyse
) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    system.publish_dds(MAIN, 0x10, 0, layers="rclcpp rcl rmw write_pre")
    system.add("dds:write", MAIN, writer=0xBEEF, timestamp=555)
    assert analyse(system).rows(
        "SELECT publisher_id, source_timestamp_ns FROM publication ORDER BY publication_id"
    ) == [(1, None), (None, 555)]


def intra(system: RosSystem, handle: int, *buffers: int, message: int = 0xD) -> int:
    first = system.add("ros2:rclcpp_intra_publish", MAIN, publisher_handle=handle, message=message)
    for buffer in buffers:
        system.add(
            "ros2:rclcpp_ring_buffer_enqueue", MAIN, buffer=buffer, index=0, size=1, overwritten=0
        )
    return first


def test_intra_and_inter_process_are_one_call(system: RosSystem, analyse: Analyse) -> None:
    """Messages may differ: the one for other processes can be a copy."""
    system.publisher(MAIN, 0x10, "/chatter")
    first = intra(system, 0x10, 0xB1, 0xB2)
    system.publish(MAIN, 0x10, 777, message=0xA)
    assert analyse(system).rows(LAYERS) == [(first, *at(first, 3, 4, 5), None, 777)]


@pytest.mark.thorough
def test_intra_process_alone_is_a_call_even_without_a_reader(
    system: RosSystem, analyse: Analyse
) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    first = intra(system, 0x10, 0xB1)
    second = intra(system, 0x10)
    assert analyse(system).rows("SELECT intra_ns, publisher_id FROM publication ORDER BY 1") == [
        (first, 1),
        (second, 1),
    ]


@pytest.mark.thorough
def test_adjacent_calls_of_two_publishers_stay_two(system: RosSystem, analyse: Analyse) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    system.publisher(MAIN, 0x11, "/other")
    intra(system, 0x10, 0xB1)
    system.publish(MAIN, 0x11, 777)
    assert analyse(system).rows(
        "SELECT publisher_id, intra_ns IS NULL, source_timestamp_ns "
        "FROM publication ORDER BY publication_id"
    ) == [(1, False, None), (2, True, 777)]


@pytest.mark.thorough
def test_a_gap_between_intra_and_inter_process_splits(system: RosSystem, analyse: Analyse) -> None:
    """Behind the gap may be the next call of the same publisher."""
    system.publisher(MAIN, 0x10, "/chatter")
    intra(system, 0x10, 0xB1)
    system.lose()
    system.publish(MAIN, 0x10, 777)
    assert analyse(system).rows(
        "SELECT intra_ns IS NULL, source_timestamp_ns FROM publication ORDER BY publication_id"
    ) == [(False, None), (True, 777)]


def test_a_replay_of_kept_messages_is_no_publication(system: RosSystem, analyse: Analyse) -> None:
    """A transient-local publisher fills the buffer of a subscription that joins late."""
    system.publisher(MAIN, 0x10, "/chatter")
    for index in range(3):
        system.add(
            "ros2:rclcpp_ring_buffer_enqueue", MAIN, buffer=0xB1, index=index, size=1, overwritten=0
        )
    system.publish(MAIN, 0x10, 777)
    assert analyse(system).rows("SELECT intra_ns, source_timestamp_ns FROM publication") == [
        (None, 777)
    ]


def test_layers_of_caret(system: RosSystem, analyse: Analyse) -> None:
    """Its hooks tell the stamp after the write; with Fast DDS without the address."""
    system.publisher(MAIN, 0x10, "/chatter")
    first = []
    for stamp, address in ((777, 0xA), (778, 0)):
        first.append(system.publish(MAIN, 0x10, layers="rclcpp rcl"))
        system.add("ros2_caret:dds_write", MAIN, message=0xA)
        system.add("ros2_caret:dds_bind_addr_to_stamp", MAIN, addr=address, source_stamp=stamp)
    model = analyse(system)
    assert model.rows(LAYERS) == [
        (None, *at(time, 0, 1, None, None), 777 + n) for n, time in enumerate(first)
    ]
    assert model.column("SELECT end_ns FROM publication ORDER BY 1") == [
        time + 3 * STEP_NS for time in first
    ]


@pytest.mark.parametrize(
    ("hook", "fields", "stamp"),
    [
        thorough("ros2_caret:dds_write", {"message": 0xA}, None),
        ("ros2_caret:dds_bind_addr_to_stamp", {"source_stamp": 777}, 777),
    ],
)
def test_a_hook_of_caret_behind_the_last_layer_is_one_more(
    system: RosSystem, analyse: Analyse, hook: str, fields: dict[str, int], stamp: int | None
) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    time = system.publish(MAIN, 0x10)
    system.add(hook, MAIN, **fields)
    model = analyse(system)
    assert model.rows("SELECT end_ns, source_timestamp_ns FROM publication") == [
        (time + 3 * STEP_NS, stamp)
    ]


def test_what_only_the_middleware_publishes_has_no_publisher(
    system: RosSystem, analyse: Analyse
) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    system.publish(MAIN, 0x66, 555, layers="rmw")
    system.add("dds:write_pre", MAIN, writer=0x67, data=0x1)
    system.add("dds:write", MAIN, writer=0x67, timestamp=556)
    model = analyse(system)
    assert model.rows(
        "SELECT publisher_id, source_timestamp_ns FROM publication ORDER BY publication_id"
    ) == [(None, 555), (None, 556)]
    assert model.value("SELECT count(*) FROM publisher") == 1


def test_the_handle_of_galactic_stands_in_rclcpp_publish(
    system: RosSystem, analyse: Analyse
) -> None:
    system.publisher(MAIN, 0x10, "/chatter")
    system.add("ros2:rclcpp_publish", MAIN, publisher_handle=0x10, message=0xA)
    assert analyse(system).column("SELECT publisher_id FROM publication") == [1]


def test_dds_writer_names_the_publisher_of_a_lone_write(
    system: RosSystem, analyse: Analyse
) -> None:
    """All other layers were lost."""
    system.publisher(MAIN, 0x10, "/chatter")
    system.add("dds:create_writer", MAIN, writer=0x10 + WRITER, topic_name="rt/other")
    system.writer(MAIN, 0x11, "/chatter")
    system.publisher(MAIN, 0x12, "/chatter")
    system.publish_dds(MAIN, 0x11, 777, layers="write_pre write")
    assert analyse(system).rows(
        "SELECT p.topic_name, p.publisher_handle FROM publication "
        "JOIN publisher AS p USING (publisher_id)"
    ) == [("/chatter", 0x12)]
