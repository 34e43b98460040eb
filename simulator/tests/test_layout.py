"""Traces of every release look as that release's do."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from support.thorough import few

from msgflow_sim import Publisher, layouts, scenarios, simulate

SHARED = Path(__file__).parents[3] / "shared" / "traces"
# Recorded traces and the layout that theirs is; what recordings of that kind also declare.
RECORDED = {
    "tracecompass-ros2": ("humble-fastdds", set()),
    "sync_1_1": ("humble-fastdds", set()),
    "sync_1_1_humble": ("humble", {"message_link_periodic_async", "message_link_partial_sync"}),
    "sync_1_1_jazzy": ("rolling", set()),
    "services": ("rolling", set()),
}
TAKES = ("ros2:rmw_take", "ros2:rcl_take", "ros2:rclcpp_take")
LETTERS = {
    "ros2:rclcpp_publish": "a",
    "ros2:rcl_publish": "b",
    "ros2:rmw_publish": "c",
    "dds:write_pre": "p",
    "dds:write": "w",
}
# What follows each other on a thread when a message is published.
ORDERS = {
    "foxy-fastdds": "pw",
    "foxy-cyclonedds": "w",
    "galactic": "ab",
    "galactic-fastdds": "abpw",
    "galactic-cyclonedds": "abw",
    "humble": "abc",
    "humble-fastdds": "abcpw",
    "humble-fastdds-write-first": "abcwp",
    "humble-cyclonedds": "abcw",
    "iron": "abc",
    "jazzy": "abc",
    "kilted": "abc",
    "rolling": "abc",
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Simulates the pipeline in a layout, once."""
    done = {}

    def make(name):
        if name not in done:
            directory = tmp_path_factory.mktemp("layout") / name
            done[name] = simulate("pipeline", directory, factor=0.05, layout=name)
        return done[name]

    return make


def _published(events):
    """Letters of the layers on each process's main thread, other events as spaces."""
    texts = defaultdict(str)
    for event in events:
        if event.pid == event.tid:
            texts[event.pid] += LETTERS.get(event.name, " ")
    return " ".join(texts.values())


@pytest.mark.parametrize("name", few(layouts(), "foxy", "humble", "rolling"))
def test_only_declared_events_occur(made, read, name):
    recording = read(made(name))
    declared = {event.name: event for event in layouts()[name].events}
    assert {event.name for event in recording.events} <= declared.keys()
    for event in recording.events:
        assert [f.name for f in declared[event.name].fields] == list(event.fields)
    counts = recording.meta["hosts"]["alpha"]["events"]
    assert sum(counts.values()) == len(recording.events) > 500


@pytest.mark.parametrize("name", list(RECORDED))
def test_declares_what_recorded_traces_declare(bt2, name):
    if not (SHARED / name).is_dir():
        pytest.skip("the recorded traces (../shared/traces) are not here")
    layout, more = RECORDED[name]
    recorded = {}
    for message in bt2.TraceCollectionMessageIterator(str(SHARED / name)):
        if type(message).__name__ == "_StreamBeginningMessageConst":
            recorded = {c.name: c for c in message.stream.cls.values()}
            break
    # What applications declare of filters is no tracepoint of ROS 2.
    declared = {
        event.name: event
        for event in layouts()[layout].events
        if event.name != "ros2:message_link_approximate_sync"
    }
    assert declared.keys() == recorded.keys() - {f"ros2:{event}" for event in more}
    for event in declared.values():
        members = recorded[event.name].payload_field_class
        lengths = [f"_{f.name}_length" for f in event.fields if f.kind.name == "SEQUENCE"]
        named = [member for member in members if member not in lengths]
        assert [field.name for field in event.fields] == named
        for field in event.fields:
            length = getattr(members[field.name].field_class, "length", 0)
            assert length == field.length, f"{event.name}.{field.name}"


@pytest.mark.parametrize("name", few(ORDERS, "foxy-cyclonedds", "galactic-fastdds", "humble"))
def test_layers_of_a_publication_follow_each_other(made, read, name):
    text = _published(read(made(name)).events)
    order = ORDERS[name]
    assert len(re.findall(order, text)) > 50
    # /rosout does not pass rclcpp, the middleware's own messages only its own layer.
    for number, letter in enumerate(order):
        earlier = f"(?<!{order[number - 1]})" if number else ""
        starts = len(re.findall(f"{earlier}{letter}", text))
        assert len(re.findall(f"{earlier}{order[number:]}", text)) == starts or letter in "pw"


@pytest.mark.parametrize("name", few(layouts(), "foxy", "humble", "rolling"))
def test_source_stamps_lie_where_the_release_makes_them(made, read, name):
    recording = read(made(name))
    published = recording.truth(
        "SELECT rmw_ns, source_timestamp_ns FROM publication WHERE rmw_ns IS NOT NULL"
    )
    distances = [stamp - rmw for rmw, stamp in published]
    if layouts()[name].is_stamped_by_rmw:
        assert all(-1000 < distance < 0 for distance in distances)
    else:
        assert all(300 < distance < 350_000 for distance in distances)
        assert max(distances) > 2 * min(distances)
    stamps = {stamp for _, stamp in published}
    taken = [
        event.fields["source_timestamp"]
        for event in recording.events
        if event.name == "ros2:rmw_take" and event.fields["source_timestamp"]
    ]
    assert set(taken) <= stamps
    written = [
        e.fields["timestamp"]
        for e in recording.events
        if e.name == "dds:write" and "timestamp" in e.fields
    ]
    assert stamps <= set(written) or not written


def test_a_stamp_of_humble_precedes_the_next_event_of_its_thread(made, read):
    recording = read(made("humble"))
    following = {}
    for before, after in pairwise(sorted(recording.events, key=lambda e: (e.host, e.tid, e.ts_ns))):
        if before.name == "ros2:rmw_publish" and before.tid == after.tid:
            following[before.ts_ns] = after.ts_ns
    for rmw, stamp in recording.truth("SELECT rmw_ns, source_timestamp_ns FROM publication"):
        assert rmw < stamp < following.get(rmw, stamp + 1)


def test_identifiers_have_the_length_and_tail_of_their_release(made, read):
    tails = {}
    for name in ("humble", "iron", "kilted"):
        gids = [
            event.fields["gid"]
            for event in read(made(name)).events
            if event.name == "ros2:rmw_publisher_init"
        ]
        assert len({gid[:16] for gid in gids}) == len(gids)
        tails[name] = {gid[16:] for gid in gids}
    assert tails["humble"] == {bytes(8)}
    assert len(tails["iron"]) > 1
    assert tails["kilted"] == {b""}


@pytest.mark.thorough
def test_rosout_precedes_its_node_before_jazzy(made, read):
    for name, expected in (("humble", True), ("iron", True), ("jazzy", False)):
        events = [e for e in read(made(name)).events if e.pid == 1101]
        node = next(e for e in events if e.name == "ros2:rcl_node_init")
        rosout = next(e for e in events if e.name == "ros2:rcl_publisher_init")
        assert rosout.fields["topic_name"] == "/rosout"
        assert rosout.fields["node_handle"] == node.fields["node_handle"]
        assert (rosout.ts_ns < node.ts_ns) is expected


def test_dds_events_belong_to_what_they_belong_to(made, read):
    events = read(made("humble-fastdds")).events
    created = {
        (e.fields["gid_prefix"] + e.fields["gid_entity"], e.name): e
        for e in events
        if e.name.startswith("dds:create_")
    }
    writers = {
        e.fields["writer"]: e.fields["topic_name"]
        for (_, kind), e in created.items()
        if kind == "dds:create_writer"
    }
    assert {"rt/topic_a", "rt/rosout", "ros_discovery_info"} < set(writers.values())
    for event in events:
        if event.name == "ros2:rmw_publisher_init":
            assert (event.fields["gid"][:16], "dds:create_writer") in created
    own = [e for e in events if e.name == "dds:write" and e.fields["writer"] not in writers]
    assert own
    assert len(own) < 100
    before = {}
    for event in events:
        last = before.get((event.pid, event.tid))
        if event.name == "ros2:rmw_take":
            assert last is not None
            assert last.name == "dds:read"
            assert last.fields["buffer"] == event.fields["message"]
        before[event.pid, event.tid] = event


@pytest.mark.thorough
def test_big_messages_take_long_to_write(tmp_path, read):
    pipeline = scenarios()["pipeline"]
    source, *others = pipeline.processes
    (node,) = source.nodes
    big = replace(node, publishers=(Publisher("/topic_a", size_bytes=10_000_000),))
    scenario = replace(
        pipeline, processes=(replace(source, nodes=(big,)), *others), layout="humble"
    )
    simulation = simulate(scenario, tmp_path / "out", factor=0.05)
    rows = read(simulation).truth(
        "SELECT source_timestamp_ns - rmw_ns FROM publication WHERE topic_name = '/topic_a'"
    )
    assert len(rows) > 50
    assert all(1_500_000 < distance < 3_000_000 for (distance,) in rows)
