"""Messages that do not pass all layers: Python, takes by hand, serialised, generic, loaned."""

from __future__ import annotations

from msgflow_sim.entity import (
    MICROSECOND,
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
                "python3",
                "alpha",
                1201,
                (relay,),
                start_ns=3 * MILLISECOND,
                client_library="rclpy",
            ),
            Process(
                "python3",
                "alpha",
                1301,
                (listener,),
                start_ns=7 * MILLISECOND,
                client_library="rclpy",
                executors=(Executor(timeout_ns=5 * MILLISECOND),),
            ),
            Process("listener", "alpha", 1401, (listener,), start_ns=11 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )


def python_timers() -> Scenario:
    """Nodes of rclpy that answer messages, and publish by timers, whose callbacks have no events.

    The periods of messages and timers are far from each other, near, and equal.
    """
    source = Node(
        "source",
        publishers=(Publisher("/fast"), Publisher("/slow"), Publisher("/rare")),
        timers=(
            Timer(16 * MILLISECOND, ("/fast",)),
            Timer(50 * MILLISECOND, ("/slow",), Work(20 * MICROSECOND, 2 * MILLISECOND)),
            Timer(310 * MILLISECOND, ("/rare",)),
        ),
    )
    beside = Node(
        "beside",
        publishers=tuple(Publisher(f"/beside/{name}") for name in ("answer", "tick")),
        subscriptions=(
            Subscription("/fast", ("/beside/answer",), Work(MILLISECOND, 6 * MILLISECOND)),
        ),
        timers=(Timer(23 * MILLISECOND, ("/beside/tick",)),),
    )
    # The timer has almost the period of the messages, or the same.
    near = Node(
        "near",
        publishers=tuple(Publisher(f"/near/{name}") for name in ("answer", "tick", "tock")),
        subscriptions=(
            Subscription("/slow", ("/near/answer",) * 2, Work(MILLISECOND, MILLISECOND)),
        ),
        timers=(
            Timer(49 * MILLISECOND, ("/near/tick",)),
            Timer(50 * MILLISECOND, ("/near/tock",)),
        ),
    )
    # One publisher answers two subscriptions, and another publishes by itself.
    several = Node(
        "several",
        publishers=tuple(Publisher(f"/several/{name}") for name in ("answer", "tick")),
        subscriptions=(
            Subscription("/fast", ("/several/answer",)),
            Subscription("/slow", ("/several/answer",), Work(2 * MILLISECOND, 3 * MILLISECOND)),
            Subscription("/rare"),
        ),
        timers=(Timer(100 * MILLISECOND, ("/several/tick",)),),
    )
    threads = Node(
        "threads",
        publishers=tuple(Publisher(f"/threads/{name}") for name in ("answer", "tick")),
        subscriptions=(
            Subscription(
                "/fast", ("/threads/answer",), Work(MILLISECOND, 6 * MILLISECOND), group="all"
            ),
        ),
        timers=(Timer(23 * MILLISECOND, ("/threads/tick",), group="all"),),
        groups=(Group("all", is_reentrant=True),),
    )
    nodes = (beside, near, several, threads)
    sink = Node(
        "sink",
        subscriptions=tuple(
            Subscription(publisher.topic) for node in nodes for publisher in node.publishers
        ),
    )
    return Scenario(
        name="python_timers",
        description="Python: nodes that answer messages, and timers beside, which have no events.",
        hosts=(Host("alpha", cpu_count=8),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            *(
                Process(
                    "python3",
                    "alpha",
                    1201 + 100 * number,
                    (node,),
                    start_ns=(3 + 4 * number) * MILLISECOND,
                    client_library="rclpy",
                    executors=(
                        Executor("multi_threaded", 4)
                        if node is threads
                        # Each wait makes a timer.
                        else Executor(timeout_ns=10 * MILLISECOND),
                    ),
                )
                for number, node in enumerate(nodes)
            ),
            Process("sink", "alpha", 1701, (sink,), start_ns=29 * MILLISECOND),
        ),
        duration_ns=8 * SECOND,
    )


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
                "waiting",
                "alpha",
                1301,
                (waiting,),
                start_ns=7 * MILLISECOND,
                executors=(Executor("wait_set"),),
            ),
            Process("polling", "alpha", 1401, (polling,), start_ns=11 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )


def polling() -> Scenario:
    """Callbacks that take messages of other topics themselves, each the newest, and publish."""
    first = Node(
        "first",
        publishers=(Publisher("/first"),),
        timers=(Timer(9 * MILLISECOND, ("/first",)),),
    )
    second = Node(
        "second",
        publishers=(Publisher("/second"),),
        timers=(Timer(21 * MILLISECOND, ("/second",)),),
    )
    planner = Node(
        "planner",
        publishers=(Publisher("/begun"), Publisher("/half"), Publisher("/plan")),
        subscriptions=(
            Subscription("/first", depth=1, polled=True),
            Subscription("/second", polled=True),
        ),
        timers=(
            Timer(
                20 * MILLISECOND,
                ("/begun",),
                does=(
                    Poll("/first"),
                    Publish("/half"),
                    Poll("/second"),
                    Poll("/second"),
                    Publish("/plan"),
                ),
            ),
        ),
    )
    control = Node(
        "control",
        publishers=(Publisher("/command"),),
        subscriptions=(
            Subscription("/plan", does=(Poll("/first"), Publish("/command"))),
            Subscription("/first", depth=1, polled=True),
        ),
    )
    sink = Node(
        "sink",
        subscriptions=tuple(Subscription(topic) for topic in ("/begun", "/half", "/command")),
    )
    return Scenario(
        name="polling",
        description="Callbacks that take messages of other topics themselves, and publish.",
        hosts=(Host("alpha"),),
        processes=(
            Process("first", "alpha", 1101, (first,)),
            Process("second", "alpha", 1201, (second,), start_ns=3 * MILLISECOND),
            Process("planner", "alpha", 1301, (planner,), start_ns=7 * MILLISECOND),
            Process("control", "alpha", 1401, (control,), start_ns=11 * MILLISECOND),
            Process("sink", "alpha", 1501, (sink,), start_ns=13 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )
