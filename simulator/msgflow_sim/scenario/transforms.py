"""Transforms: every process hears what it says on /tf in a listener of its own."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Executor, Host, Node, Process, Scenario


def listener(number: int) -> Node:
    """What a TransformListener creates: a node that a thread of its own spins."""
    return Node(
        f"transform_listener_impl_{number:x}",
        executor=1,
        has_parameters=False,
        subscriptions=(
            Subscription("/tf", depth=100, message_type="tf2_msgs::msg::TFMessage"),
            Subscription(
                "/tf_static",
                depth=100,
                transient_local=True,
                message_type="tf2_msgs::msg::TFMessage",
            ),
        ),
    )


def transforms() -> Scenario:
    """Two processes that broadcast and listen, one that only does the static ones."""
    odometry = Node(
        "odometry",
        publishers=(Publisher("/tf", 100), Publisher("/odom")),
        subscriptions=(Subscription("/wheels", ("/tf", "/odom"), Work(300_000)),),
    )
    localisation = Node(
        "localisation",
        publishers=(Publisher("/tf", 100), Publisher("/pose")),
        subscriptions=(Subscription("/odom", ("/tf", "/pose"), Work(MILLISECOND)),),
    )
    state_publisher = Node(
        "robot_state_publisher",
        publishers=(Publisher("/tf_static", 1, transient_local=True), Publisher("/wheels")),
        timers=(
            Timer(500 * MILLISECOND, ("/tf_static",)),
            Timer(10 * MILLISECOND, ("/wheels",)),
        ),
    )
    sink = Node("sink", subscriptions=(Subscription("/pose"),))
    both = (Executor(), Executor())
    return Scenario(
        name="transforms",
        description="Nodes with transform listeners take their own messages on /tf.",
        hosts=(Host("alpha"),),
        processes=(
            Process("state_publisher", "alpha", 1101, (state_publisher,)),
            Process(
                "odometry",
                "alpha",
                1201,
                (odometry, listener(0x5581E3D2)),
                start_ns=3 * MILLISECOND,
                executors=both,
            ),
            Process(
                "localisation",
                "alpha",
                1301,
                (localisation, listener(0x55D01C40)),
                start_ns=7 * MILLISECOND,
                executors=both,
            ),
            Process("sink", "alpha", 1401, (sink,), start_ns=11 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )
