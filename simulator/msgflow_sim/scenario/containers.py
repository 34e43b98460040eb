"""Containers of one machine, whose processes have equal ids at the same time."""

from __future__ import annotations

from msgflow_sim.entity import (
    MICROSECOND,
    MILLISECOND,
    SECOND,
    Publisher,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario

# What runs first in a container: its ids 1 to 6 are those of the shell and of `ros2 launch`.
_PID = 7


def _source(topic: str, period_ns: int) -> Node:
    return Node(
        "source",
        publishers=(Publisher(topic),),
        timers=(Timer(period_ns, (topic,), Work(500 * MICROSECOND, 500 * MICROSECOND)),),
    )


def _relay(wanted: str, topic: str) -> Node:
    return Node(
        "relay",
        publishers=(Publisher(topic),),
        subscriptions=(
            Subscription(wanted, (topic,), Work(800 * MICROSECOND, MILLISECOND), group="own"),
        ),
        groups=(Group("own", is_reentrant=True),),
    )


def containers_one_daemon() -> Scenario:
    """Four containers with a process each that share a session daemon: equal ids in one trace."""
    two_threads = (Executor("multi_threaded", 2),)
    programs = (
        ("front_source", _source("/a", 5 * MILLISECOND), (Executor(),)),
        ("front_relay", _relay("/a", "/b"), two_threads),
        ("rear_source", _source("/c", 8 * MILLISECOND), (Executor(),)),
        ("rear_relay", _relay("/c", "/d"), two_threads),
        (
            "sink",
            Node("sink", subscriptions=(Subscription("/b", logs=True), Subscription("/d"))),
            (Executor(),),
        ),
    )
    return Scenario(
        name="containers_one_daemon",
        description="Containers that share a session daemon: equal ids of processes in one trace.",
        hosts=(Host("alpha"),),
        processes=tuple(
            Process(
                name,
                "alpha",
                _PID,
                (node,),
                start_ns=number * MILLISECOND,
                executors=executors,
                container=name,
            )
            for number, (name, node, executors) in enumerate(programs)
        ),
        duration_ns=3 * SECOND,
    )


def containers_one_hostname() -> Scenario:
    """Two containers with one hostname, a session daemon each: equal ids in two traces."""
    hosts = tuple(Host(name, boot="robot", recorded_as="robot") for name in ("robot_1", "robot_2"))
    sink = Node("sink", subscriptions=(Subscription("/c"), Subscription("/f")))
    return Scenario(
        name="containers_one_hostname",
        description="Containers with one hostname and a session daemon each: equal ids and names.",
        hosts=hosts,
        processes=(
            Process("source", "robot_1", 1101, (_source("/a", 5 * MILLISECOND),)),
            Process("relay", "robot_1", 1201, (_relay("/b", "/c"),), start_ns=5 * MILLISECOND),
            Process("sink", "robot_1", 1301, (sink,), start_ns=10 * MILLISECOND),
            Process(
                "source",
                "robot_2",
                1101,
                (_source("/e", 8 * MILLISECOND),),
                start_ns=15 * MILLISECOND,
            ),
            Process("relay", "robot_2", 1201, (_relay("/a", "/b"),), start_ns=21 * MILLISECOND),
            Process("sink", "robot_2", 1301, (_relay("/e", "/f"),), start_ns=26 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )
