"""Annotated nodes: what they publish is made of messages of several inputs, kept in caches."""

from __future__ import annotations

from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    MessageLink,
    Publisher,
    Spin,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario

_INPUTS = ("/a", "/b", "/c")
_PERIODS_MS = (7, 11, 16)
_REENTRANT_PERIODS_MS = (9, 14, 6)
_GROUP = "any_time"
_SIZES = ((1, 1), (1, 3), (2, 1), (2, 2), (3, 1), (3, 3))


def periodic_async() -> Scenario:
    """Timers that use the latest message of 1 to 3 inputs and publish on 1 to 3 topics."""
    nodes = tuple(_periodic(*size) for size in _SIZES)
    return Scenario(
        name="periodic_async",
        description="Timers publish what they make of the latest message of up to three inputs.",
        hosts=(Host("alpha", cpu_count=8),),
        processes=(
            *_sources(_PERIODS_MS),
            *_one_each(nodes),
            # Two links of one node that share an input and an output.
            Process("sharing", "alpha", 2001, (_sharing(),), start_ns=70 * MILLISECOND),
            # Inputs that are received while the timer runs, also twice at once.
            Process(
                "concurrent",
                "alpha",
                2101,
                (_concurrent(),),
                start_ns=75 * MILLISECOND,
                executors=(Executor("multi_threaded", 3),),
            ),
            _sink((*nodes, _sharing(), _concurrent())),
        ),
        duration_ns=4 * SECOND,
        layout="rolling",
    )


def partial_sync() -> Scenario:
    """Callbacks that publish once there is a message of each of 1 to 3 inputs."""
    nodes = tuple(_partial(*size) for size in _SIZES)
    return Scenario(
        name="partial_sync",
        description="Callbacks publish once there is a new message of each of up to three inputs.",
        hosts=(Host("alpha", cpu_count=8),),
        processes=(
            *_sources(_PERIODS_MS),
            *_one_each(nodes),
            # Its callbacks run on two threads, one at a time.
            Process(
                "two_threads",
                "alpha",
                2001,
                (_both_kinds(),),
                start_ns=70 * MILLISECOND,
                executors=(Executor("multi_threaded", 2),),
            ),
            Process(
                "spinning",
                "alpha",
                2101,
                (_spinning(),),
                start_ns=80 * MILLISECOND,
                executors=(Executor(), Executor("nested")),
            ),
            _sink((*nodes, _both_kinds(), _spinning())),
        ),
        duration_ns=4 * SECOND,
        layout="rolling",
    )


def approximate_sync() -> Scenario:
    """Filters of messages (ApproximateTime) of inputs with like and unlike periods."""
    nodes = (
        _filter("filter_two", ("/a", "/b"), outputs=1),
        _filter("filter_three", ("/a", "/b", "/c"), outputs=2),
        _filter("filter_alike", ("/a", "/d"), outputs=1),
        _filter("filter_rare", ("/b", "/c", "/e"), outputs=1),
    )
    periods_ms = {"/a": 20, "/b": 14, "/c": 33, "/d": 20, "/e": 90}
    return Scenario(
        name="approximate_sync",
        description="Filters that publish the messages of up to three inputs that are closest.",
        hosts=(Host("alpha", cpu_count=8),),
        processes=(
            *_sources(tuple(periods_ms.values()), tuple(periods_ms)),
            *(
                Process(
                    node.name,
                    "alpha",
                    1801 + 100 * number,
                    (node,),
                    start_ns=(3 + 5 * number) * MILLISECOND,
                )
                for number, node in enumerate(nodes)
            ),
            _sink(nodes, pid=2501),
        ),
        duration_ns=4 * SECOND,
        layout="rolling",
    )


def reentrant() -> Scenario:
    """Callbacks in reentrant groups of four threads, which keep and use messages early or late."""
    nodes = (
        _sync("sync_early", ("/a", "/b"), is_late=False),
        _sync("sync_late", ("/a", "/b"), is_late=True),
        _sync("sync_three", _INPUTS, is_late=True),
        _overlapping("periodic_early", is_late=False),
        _overlapping("periodic_late", is_late=True),
    )
    return Scenario(
        name="reentrant",
        description="Annotated nodes whose callbacks overlap on four threads.",
        hosts=(Host("alpha", cpu_count=24),),
        processes=(
            *_sources(_REENTRANT_PERIODS_MS),
            *(
                Process(
                    node.name,
                    "alpha",
                    1501 + 100 * number,
                    (node,),
                    executors=(Executor("multi_threaded", 4),),
                    start_ns=(3 + 5 * number) * 10**6,
                )
                for number, node in enumerate(nodes)
            ),
            _sink(nodes),
        ),
        duration_ns=4 * SECOND,
        layout="rolling",
    )


def _spinning() -> Node:
    """The callback of one input waits for the other, which is received nested in it."""
    topics = _outputs("spinning", 1)
    spin = Spin(1, 9 * MILLISECOND)
    return Node(
        "spinning",
        groups=(Group("within", executor=1),),
        publishers=tuple(Publisher(topic) for topic in topics),
        subscriptions=(
            Subscription("/c", topics, first=(spin,)),
            Subscription("/b", topics, group="within"),
        ),
        links=(MessageLink("partial_sync", ("/c", "/b"), topics),),
    )


def _sources(periods_ms: tuple[int, ...], topics: tuple[str, ...] = _INPUTS) -> tuple[Process, ...]:
    return tuple(
        Process(
            f"source_{number}",
            "alpha",
            1101 + 100 * number,
            (
                Node(
                    f"source_{number}",
                    publishers=(Publisher(topic),),
                    timers=(Timer(period_ms * MILLISECOND, (topic,)),),
                ),
            ),
            start_ns=number * 4 * MILLISECOND,
        )
        for number, (topic, period_ms) in enumerate(zip(topics, periods_ms, strict=True))
    )


def _one_each(nodes: tuple[Node, ...]) -> tuple[Process, ...]:
    return tuple(
        Process(node.name, "alpha", 1401 + 100 * number, (node,), start_ns=(3 + 5 * number) * 10**6)
        for number, node in enumerate(nodes)
    )


def _outputs(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"/{name}/{number}" for number in range(count))


def _periodic(inputs: int, outputs: int) -> Node:
    name = f"periodic_{inputs}_to_{outputs}"
    topics = _outputs(name, outputs)
    return Node(
        name,
        publishers=tuple(Publisher(topic) for topic in topics),
        subscriptions=tuple(Subscription(topic) for topic in _INPUTS[:inputs]),
        timers=(Timer(10 * MILLISECOND, topics, Work(MILLISECOND)),),
        links=(MessageLink("periodic_async", _INPUTS[:inputs], topics),),
    )


def _sharing() -> Node:
    one, both, other = topics = _outputs("sharing", 3)
    return Node(
        "sharing",
        publishers=tuple(Publisher(topic) for topic in topics),
        # What comes on /c is passed on at once, together with what is kept of /b.
        subscriptions=(Subscription("/a"), Subscription("/b"), Subscription("/c", (other,))),
        timers=(Timer(9 * MILLISECOND, (one, both)), Timer(23 * MILLISECOND, (both,))),
        links=(
            MessageLink("periodic_async", ("/a", "/b"), (one, both)),
            MessageLink("periodic_async", ("/b", "/c"), (both, other)),
        ),
    )


def _concurrent() -> Node:
    (topic,) = _outputs("concurrent", 1)
    slow = Work(4 * MILLISECOND, 9 * MILLISECOND)
    return Node(
        "concurrent",
        groups=(Group(_GROUP, is_reentrant=True),),
        publishers=(Publisher(topic),),
        subscriptions=tuple(Subscription(each, work=slow, group=_GROUP) for each in _INPUTS[:2]),
        timers=(Timer(10 * MILLISECOND, (topic,), Work(2 * MILLISECOND)),),
        links=(MessageLink("periodic_async", _INPUTS[:2], (topic,)),),
    )


def _partial(inputs: int, outputs: int) -> Node:
    name = f"partial_{inputs}_to_{outputs}"
    topics = _outputs(name, outputs)
    return Node(
        name,
        publishers=tuple(Publisher(topic) for topic in topics),
        subscriptions=tuple(
            Subscription(topic, topics, Work(MILLISECOND)) for topic in _INPUTS[:inputs]
        ),
        links=(MessageLink("partial_sync", _INPUTS[:inputs], topics),),
    )


def _filter(name: str, inputs: tuple[str, ...], outputs: int) -> Node:
    topics = _outputs(name, outputs)
    return Node(
        name,
        publishers=tuple(Publisher(topic) for topic in topics),
        subscriptions=tuple(Subscription(topic, topics, Work(MILLISECOND)) for topic in inputs),
        links=(MessageLink("approximate_sync", inputs, topics),),
    )


def _both_kinds() -> Node:
    together, periodic = topics = _outputs("both_kinds", 2)
    return Node(
        "both_kinds",
        publishers=tuple(Publisher(topic) for topic in topics),
        subscriptions=tuple(
            Subscription(topic, (together,), Work(MILLISECOND)) for topic in _INPUTS
        ),
        timers=(Timer(13 * MILLISECOND, (periodic,)),),
        links=(
            MessageLink("partial_sync", _INPUTS, (together,)),
            MessageLink("periodic_async", _INPUTS, (periodic,)),
        ),
    )


def _sink(nodes: tuple[Node, ...], pid: int = 2201) -> Process:
    topics = [publisher.topic for node in nodes for publisher in node.publishers]
    sink = Node("sink", subscriptions=tuple(Subscription(topic) for topic in topics))
    return Process("sink", "alpha", pid, (sink,), start_ns=30 * MILLISECOND)


def _sync(name: str, inputs: tuple[str, ...], *, is_late: bool) -> Node:
    topics = _outputs(name, 2)
    slow = Work(5 * MILLISECOND, 6 * MILLISECOND)
    return Node(
        name,
        groups=(Group(_GROUP, is_reentrant=True),),
        publishers=tuple(Publisher(topic) for topic in topics),
        subscriptions=tuple(Subscription(topic, topics, slow, group=_GROUP) for topic in inputs),
        links=(MessageLink("partial_sync", inputs, topics, is_late),),
    )


def _overlapping(name: str, *, is_late: bool) -> Node:
    topic = f"/{name}"
    inputs = ("/a", "/b")
    return Node(
        name,
        groups=(Group(_GROUP, is_reentrant=True),),
        publishers=(Publisher(topic),),
        subscriptions=tuple(
            Subscription(each, work=Work(4 * MILLISECOND, 7 * MILLISECOND), group=_GROUP)
            for each in inputs
        ),
        timers=(
            Timer(10 * MILLISECOND, (topic,), Work(3 * MILLISECOND, 3 * MILLISECOND), group=_GROUP),
        ),
        links=(MessageLink("periodic_async", inputs, (topic,), is_late),),
    )
