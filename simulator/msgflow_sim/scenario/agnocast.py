"""Agnocast beside ROS 2: messages through shared memory, with a bridge."""

from __future__ import annotations

from dataclasses import replace

from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    Poll,
    Publish,
    Publisher,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario

_ALONE = (Executor("agnocast"),)


def _publisher(topic: str, depth: int = 1, *, transient_local: bool = False) -> Publisher:
    return Publisher(topic, depth, transient_local=transient_local, is_agnocast=True)


_SENSOR = Node(
    "sensor",
    is_agnocast=True,
    publishers=(_publisher("/points"), _publisher("/map", 3, transient_local=True)),
    timers=(
        Timer(10 * MILLISECOND, ("/points",), Work(300_000)),
        Timer(230 * MILLISECOND, ("/map",)),
    ),
)
# A node of rclcpp, on two executors: one for what comes through ROS 2, one for Agnocast.
_FILTER = Node(
    "filter",
    groups=(Group("shared", executor=1),),
    publishers=(_publisher("/filtered"), Publisher("/status")),
    subscriptions=(
        Subscription(
            "/points",
            ("/filtered",),
            Work(4 * MILLISECOND, 4 * MILLISECOND, 0.05, 40_000_000),
            depth=1,
            group="shared",
            is_agnocast=True,
        ),
    ),
    timers=(Timer(50 * MILLISECOND, ("/status",)),),
)
_DETECTOR = Node(
    "detector",
    is_agnocast=True,
    groups=(Group("again", is_reentrant=True),),
    publishers=(_publisher("/objects", 5), _publisher("/overlay", 5)),
    subscriptions=(
        Subscription(
            "/filtered",
            ("/objects",),
            Work(6 * MILLISECOND, 9 * MILLISECOND),
            depth=3,
            group="again",
            is_agnocast=True,
        ),
        Subscription("/map", depth=1, polled=True, transient_local=True, is_agnocast=True),
    ),
    timers=(Timer(100 * MILLISECOND, does=(Poll("/map"), Publish("/overlay"))),),
)
_BRIDGE = Node(
    "bridge",
    groups=(Group("shared", executor=1),),
    publishers=(Publisher("/objects"), _publisher("/goal", 5)),
    subscriptions=(
        Subscription("/objects", ("/objects",), depth=5, group="shared", is_agnocast=True),
        Subscription("/goal", ("/goal",)),
    ),
)
_TRACKER = Node(
    "tracker",
    publishers=(Publisher("/goal"),),
    subscriptions=(Subscription("/objects"), Subscription("/status")),
    timers=(Timer(70 * MILLISECOND, ("/goal",)),),
)
_PLANNER = Node(
    "planner",
    is_agnocast=True,
    subscriptions=(
        Subscription("/goal", depth=5, is_agnocast=True),
        Subscription("/overlay", depth=5, is_agnocast=True),
        Subscription("/map", depth=2, transient_local=True, is_agnocast=True),
    ),
)
# The topic dies with both, and its numbers begin again with the next pair.
_SHORT = (
    Node(
        "source",
        is_agnocast=True,
        publishers=(_publisher("/short", 3),),
        timers=(Timer(20 * MILLISECOND, ("/short",)),),
    ),
    Node(
        "sink",
        is_agnocast=True,
        subscriptions=(Subscription("/short", depth=3, is_agnocast=True),),
    ),
)


def agnocast() -> Scenario:
    """Nodes of Agnocast, nodes of rclcpp that use it, and a bridge."""
    short = tuple(
        Process(
            node.name,
            "alpha",
            2101 + 1000 * life + 100 * number,
            (replace(node),),
            start_ns=(50 + 900 * life + 30 * number) * MILLISECOND,
            stop_ns=(700 + 900 * life + 20 * number) * MILLISECOND,
            executors=_ALONE,
        )
        for life in range(2)
        for number, node in enumerate(_SHORT)
    )
    return Scenario(
        name="agnocast",
        description="Messages through the shared memory of Agnocast, a bridge, polls, overwriting.",
        hosts=(Host("alpha", cpu_count=8),),
        processes=(
            Process("sensor", "alpha", 1101, (_SENSOR,), executors=_ALONE),
            Process(
                "filter",
                "alpha",
                1201,
                (_FILTER,),
                start_ns=5 * MILLISECOND,
                executors=(Executor(), Executor("agnocast")),
            ),
            Process(
                "detector",
                "alpha",
                1301,
                (_DETECTOR,),
                start_ns=9 * MILLISECOND,
                executors=(Executor("agnocast", thread_count=2),),
            ),
            Process(
                "agnocast_bridge",
                "alpha",
                1401,
                (_BRIDGE,),
                start_ns=12 * MILLISECOND,
                executors=(Executor(), Executor("agnocast")),
            ),
            Process("tracker", "alpha", 1501, (_TRACKER,), start_ns=15 * MILLISECOND),
            Process(
                "planner",
                "alpha",
                1601,
                (_PLANNER,),
                start_ns=1_100 * MILLISECOND,
                executors=_ALONE,
            ),
            *short,
        ),
        duration_ns=3 * SECOND,
        layout="jazzy-agnocast",
    )
