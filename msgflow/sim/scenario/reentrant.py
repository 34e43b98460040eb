"""Annotated nodes on several threads: inputs that come while others are under way."""

from __future__ import annotations

from msgflow.sim.entity import (
    MILLISECOND,
    SECOND,
    MessageLink,
    Publisher,
    Subscription,
    Timer,
    Work,
)
from msgflow.sim.system import Executor, Group, Host, Node, Process, Scenario

_PERIODS = {"/a": 9, "/b": 14, "/c": 6}
_GROUP = "any_time"


def reentrant() -> Scenario:
    """Callbacks in reentrant groups of four threads, which keep and use messages early or late."""
    nodes = (
        _sync("sync_early", ("/a", "/b"), is_late=False),
        _sync("sync_late", ("/a", "/b"), is_late=True),
        _sync("sync_three", tuple(_PERIODS), is_late=True),
        _periodic("periodic_early", is_late=False),
        _periodic("periodic_late", is_late=True),
    )
    topics = [publisher.topic for node in nodes for publisher in node.publishers]
    sink = Node("sink", subscriptions=tuple(Subscription(topic) for topic in topics))
    return Scenario(
        name="reentrant",
        description="Annotated nodes whose callbacks overlap on four threads.",
        hosts=(Host("alpha", cpu_count=24),),
        processes=(
            *(
                Process(
                    f"source_{number}", "alpha", 1101 + 100 * number, (_source(number, topic),),
                    start_ns=number * 4 * MILLISECOND,
                )
                for number, topic in enumerate(_PERIODS)
            ),
            *(
                Process(
                    node.name, "alpha", 1501 + 100 * number, (node,),
                    executors=(Executor("multi_threaded", 4),), start_ns=(3 + 5 * number) * 10**6,
                )
                for number, node in enumerate(nodes)
            ),
            Process("sink", "alpha", 2201, (sink,), start_ns=30 * MILLISECOND),
        ),
        duration_ns=4 * SECOND,
        layout="rolling",
    )  # fmt: skip


def _source(number: int, topic: str) -> Node:
    return Node(
        f"source_{number}",
        publishers=(Publisher(topic),),
        timers=(Timer(_PERIODS[topic] * MILLISECOND, (topic,)),),
    )


def _sync(name: str, inputs: tuple[str, ...], *, is_late: bool) -> Node:
    topics = (f"/{name}/0", f"/{name}/1")
    slow = Work(5 * MILLISECOND, 6 * MILLISECOND)
    return Node(
        name,
        groups=(Group(_GROUP, is_reentrant=True),),
        publishers=tuple(Publisher(topic) for topic in topics),
        subscriptions=tuple(Subscription(topic, topics, slow, group=_GROUP) for topic in inputs),
        links=(MessageLink("partial_sync", inputs, topics, is_late),),
    )


def _periodic(name: str, *, is_late: bool) -> Node:
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
