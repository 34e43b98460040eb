"""Processes start as they do in ROS 2 Jazzy."""

from __future__ import annotations

from collections import Counter, defaultdict
from itertools import pairwise

import pytest

from msgflow_sim.symbols import PARAMETER_SERVICES

# Where objects get the addresses of others that were destroyed.
_REUSING = ("losses", "restarts", "container_restarts")
# Layouts whose events have gids without what lies behind them in memory.
_SHORT_GIDS = ("kilted", "rolling")
_CREATION = {
    "rcl_init",
    "rcl_node_init",
    "rcl_publisher_init",
    "rcl_service_init",
    "rcl_subscription_init",
    "rcl_timer_init",
}


def _by_process(recording):
    processes = defaultdict(list)
    for event in recording.events:
        if event.pid == event.tid:
            processes[event.host, event.pid].append(event)
    return processes


def _short(event):
    return event.name.removeprefix("ros2:")


def test_objects_are_created_in_order(recordings):
    events = _by_process(recordings["pipeline"])["alpha", 1201]
    created = [
        (_short(e), e.fields.get("topic_name") or e.fields.get("service_name"))
        for e in events
        if _short(e) in _CREATION
    ]
    assert created == [
        ("rcl_init", None),
        ("rcl_node_init", None),
        ("rcl_publisher_init", "/rosout"),
        *(("rcl_service_init", f"/relay/{service}") for service in PARAMETER_SERVICES),
        ("rcl_publisher_init", "/parameter_events"),
        ("rcl_subscription_init", "/parameter_events"),
        ("rcl_publisher_init", "/topic_b"),
        ("rcl_subscription_init", "/topic_a"),
    ]


def test_timers_are_registered_then_linked(recordings):
    events = _by_process(recordings["pipeline"])["alpha", 1101]
    at = next(i for i, e in enumerate(events) if _short(e) == "rcl_timer_init")
    timer, added, registered, linked = events[at : at + 4]
    assert [_short(e) for e in (added, registered, linked)] == [
        "rclcpp_timer_callback_added",
        "rclcpp_callback_register",
        "rclcpp_timer_link_node",
    ]
    assert timer.fields["period"] == 5_000_000
    assert timer.fields["timer_handle"] == added.fields["timer_handle"]
    assert timer.fields["timer_handle"] == linked.fields["timer_handle"]
    assert added.fields["callback"] == registered.fields["callback"]
    assert registered.fields["symbol"] == "std::_Bind<void (SourceNode::*(SourceNode*))()>"


def _process(callback):
    host, pid, _ = callback
    return host, pid


@pytest.mark.thorough
def test_every_callback_has_one_symbol(recording):
    registered = [
        (e.host, e.pid, e.fields["callback"])
        for e in recording.events
        if _short(e) == "rclcpp_callback_register"
    ]
    added = [
        (e.host, e.pid, e.fields["callback"])
        for e in recording.events
        if _short(e).endswith("_callback_added")
    ]
    # In the order of each process: several start at once.
    assert sorted(registered, key=_process) == sorted(added, key=_process)
    if recording.meta["scenario"] not in _REUSING:
        assert len(set(registered)) == len(registered)
    started = {
        (e.host, e.pid, e.fields["callback"])
        for e in recording.events
        if _short(e) == "callback_start"
    }
    assert started < set(registered)


def test_handles_that_events_use_were_created_before(recording):
    created = {
        "rcl_publisher_init": ("rmw_publish", "rmw_publisher_handle", "rmw_publisher_handle"),
        "rcl_subscription_init": ("rmw_take", "rmw_subscription_handle", "rmw_subscription_handle"),
    }
    known = defaultdict(set)
    for event in recording.events:
        name, place = _short(event), (event.host, event.pid)
        for creation, (use, own, field) in created.items():
            if name == creation:
                known[creation, place].add(event.fields[own])
            # ros_discovery_info exists in the rmw layer only.
            if name == use and event.fields.get("source_timestamp", 0):
                assert event.fields[field] in known[creation, place]


def test_rosout_is_published_with_another_handle_than_it_was_created_with(basic):
    recording = basic
    created, used = set(), set()
    for event in recording.events:
        if _short(event) == "rcl_publisher_init" and event.fields["topic_name"] == "/rosout":
            created.add((event.host, event.pid, event.fields["publisher_handle"]))
        if _short(event) == "rcl_publish":
            used.add((event.host, event.pid, event.fields["publisher_handle"]))
    nodes = sum(len(process["nodes"]) for process in recording.meta["processes"])
    assert len(created) == nodes
    assert not created & used


def test_discovery_is_published_without_rcl_and_taken_without_stamp(recording):
    for events in _by_process(recording).values():
        # A process of nodes of Agnocast alone has no middleware.
        if not any(_short(e) == "rcl_init" for e in events):
            continue
        rmw_inits = {
            e.fields["rmw_publisher_handle"] for e in events if _short(e) == "rmw_publisher_init"
        }
        rcl_inits = {
            e.fields["rmw_publisher_handle"] for e in events if _short(e) == "rcl_publisher_init"
        }
        (discovery,) = rmw_inits - rcl_inits
        published = [
            before
            for before, e in pairwise(events)
            if _short(e) == "rmw_publish" and e.fields["rmw_publisher_handle"] == discovery
        ]
        # Of each object of a node; ten of them every node has.
        assert len(published) >= 10
        assert all(_short(before) != "rcl_publish" for before in published)
    # Those threads of a process that execute nothing: rclpy shows no callbacks, but its takes.
    executing = {
        (e.pid, e.tid) for e in recording.events if _short(e) in {"callback_start", "rcl_take"}
    }
    listeners = {
        e.tid
        for e in recording.events
        if _short(e) == "rmw_take" and e.tid != e.pid and (e.pid, e.tid) not in executing
    }
    heard = Counter(
        (e.fields["taken"], e.fields["source_timestamp"])
        for e in recording.events
        if _short(e) == "rmw_take" and e.tid in listeners
    )
    others = {(1, 0)} if len(recording.meta["processes"]) > 1 else set()
    assert set(heard) == {(0, 0)} | others


def test_gids_are_unique_in_their_first_sixteen_bytes(recording):
    gids = [
        e.fields["gid"]
        for e in recording.events
        if _short(e) in {"rmw_publisher_init", "rmw_subscription_init"}
    ]
    is_short = recording.meta["layout"] in _SHORT_GIDS
    assert {len(gid) for gid in gids} == {16 if is_short else 24}
    assert len({gid[:16] for gid in gids}) == len(gids)
    assert {gid[:2] for gid in gids} == {b"\x01\x0f"}


@pytest.mark.thorough
def test_hosts_share_process_ids_and_handles(recordings):
    nodes = {
        (e.host, e.pid): e.fields["node_handle"]
        for e in recordings["two_hosts"].events
        if _short(e) == "rcl_node_init"
    }
    assert nodes["alpha", 1101] == nodes["beta", 1101]
    assert nodes["alpha", 1301] != nodes["alpha", 1101]
