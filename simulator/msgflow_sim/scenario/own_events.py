"""Tracepoints of the user's own: callbacks that record what they do themselves."""

from __future__ import annotations

from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    Call,
    Client,
    Publish,
    Publisher,
    Record,
    Service,
    Spin,
    Subscription,
    Timer,
)
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario

_CAMERA = Node(
    "camera",
    publishers=(Publisher("/image"),),
    timers=(Timer(10 * MILLISECOND, does=(Record(), Publish("/image"), Record())),),
)
_DETECTOR = Node(
    "detector",
    groups=(Group("again", is_reentrant=True, executor=1),),
    publishers=(Publisher("/detections"), Publisher("/seen")),
    subscriptions=(
        # Runs nested in itself: which run an event is of shows only what began and ended before.
        Subscription(
            "/image",
            ("/seen",),
            does=(Record(), Spin(1, 14 * MILLISECOND, depth=3), Record()),
            group="again",
        ),
    ),
    timers=(
        Timer(
            30 * MILLISECOND,
            ("/detections",),
            does=(Record(), Spin(1, 6 * MILLISECOND, depth=3), Record()),
        ),
    ),
)
# Without callbacks that are traced: rclpy, and what a client does with its answer.
_WATCHER = Node(
    "watcher",
    publishers=(Publisher("/watched"),),
    subscriptions=(Subscription("/detections", ("/watched",), does=(Record(),)),),
)
_ASKER = Node(
    "asker",
    clients=(Client("/look_up", does=(Record(),)),),
    timers=(Timer(40 * MILLISECOND, does=(Call("/look_up"),)),),
)
_SINK = Node(
    "sink",
    subscriptions=(Subscription("/seen"), Subscription("/watched")),
    services=(Service("/look_up", does=(Record(),)),),
)


def own_events() -> Scenario:
    """Events of a package of the user in callbacks, nested ones, and outside of all."""
    return Scenario(
        name="own_events",
        description="Tracepoints of the user's own (my_pkg:frame_done), in callbacks and outside.",
        hosts=(Host("alpha"),),
        processes=(
            Process("camera", "alpha", 1101, (_CAMERA,)),
            Process(
                "detector",
                "alpha",
                1201,
                (_DETECTOR,),
                start_ns=3 * MILLISECOND,
                executors=(Executor(), Executor("nested")),
            ),
            Process(
                "watcher",
                "alpha",
                1301,
                (_WATCHER,),
                start_ns=7 * MILLISECOND,
                client_library="rclpy",
            ),
            Process("asker", "alpha", 1401, (_ASKER,), start_ns=9 * MILLISECOND),
            Process("sink", "alpha", 1501, (_SINK,), start_ns=11 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
        layout="kilted",
    )
