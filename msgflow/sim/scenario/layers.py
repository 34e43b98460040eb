"""Messages that do not pass all layers: Python, takes by hand, serialised, generic, loaned."""

from __future__ import annotations

from msgflow.sim.entity import MILLISECOND, SECOND, Poll, Publisher, Subscription, Timer
from msgflow.sim.system import Executor, Host, Node, Process, Scenario


def python() -> Scenario:
    """Nodes of rclpy, which only have the events of rcl and rmw."""
    talker = Node(
        "talker",
        publishers=(Publisher("/chatter"),),
        timers=(Timer(10 * MILLISECOND, ("/chatter",)),),
    )
    relay = Node(
        "relay",
        publishers=(Publisher("/echo"), Publisher("/echo_twice")),
        subscriptions=(Subscription("/chatter", ("/echo", "/echo_twice")),),
    )
    listener = Node("listener", subscriptions=(Subscription("/echo"), Subscription("/echo_twice")))
    return Scenario(
        name="python",
        description="A relay and a listener in Python, without rclcpp and callback events.",
        hosts=(Host("alpha"),),
        processes=(
            Process("talker", "alpha", 1101, (talker,)),
            Process(
                "python3", "alpha", 1201, (relay,), start_ns=3 * MILLISECOND,
                client_library="rclpy",
            ),
            Process(
                "python3", "alpha", 1301, (listener,), start_ns=7 * MILLISECOND,
                client_library="rclpy",
            ),
            Process("listener", "alpha", 1401, (listener,), start_ns=11 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )  # fmt: skip


def layers() -> Scenario:
    """Kinds of publishers and subscriptions, a wait set, and a callback that takes by hand."""
    kinds = ("typed", "generic", "serialized", "loaned")
    topics = tuple(f"/{kind}" for kind in kinds)
    source = Node(
        "source",
        publishers=tuple(Publisher(f"/{kind}", kind=kind) for kind in kinds),
        timers=(Timer(20 * MILLISECOND, topics),),
    )
    sink = Node(
        "sink",
        subscriptions=(
            *(Subscription(topic) for topic in topics),
            Subscription("/waited"),
            Subscription("/polled"),
        ),
    )
    waiting = Node(
        "waiting",
        publishers=(Publisher("/waited"),),
        subscriptions=(
            Subscription("/typed", ("/waited",)),
            Subscription("/generic", ("/waited",)),
        ),
    )
    polling = Node(
        "polling",
        publishers=(Publisher("/polled"),),
        subscriptions=(Subscription("/typed", polled=True),),
        timers=(Timer(15 * MILLISECOND, ("/polled",), does=(Poll("/typed"),)),),
    )
    special = Node(
        "special",
        subscriptions=(
            Subscription("/serialized", kind="serialized"),
            Subscription("/loaned", kind="loaned"),
        ),
    )
    return Scenario(
        name="layers",
        description="Serialised, generic and loaned messages; takes by wait sets and by hand.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            Process("sink", "alpha", 1201, (sink, special), start_ns=3 * MILLISECOND),
            Process(
                "waiting", "alpha", 1301, (waiting,), start_ns=7 * MILLISECOND,
                executors=(Executor("wait_set"),),
            ),
            Process("polling", "alpha", 1401, (polling,), start_ns=11 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )  # fmt: skip
