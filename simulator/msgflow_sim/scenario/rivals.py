"""Rivals: several writes on one topic that go on at the same time."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario


def rivals() -> Scenario:
    """Two cameras whose clouds take milliseconds to write, and a publisher of four threads."""
    cameras = tuple(
        Node(
            name,
            publishers=(Publisher("/cloud", 5, size_bytes=15_000_000), Publisher("/info", 5)),
            timers=(Timer(period * MILLISECOND, ("/cloud", "/info")),),
        )
        for name, period in (("front", 20), ("rear", 27))
    )
    source = Node(
        "source",
        publishers=(Publisher("/scan"),),
        timers=(Timer(5 * MILLISECOND, ("/scan",)),),
    )
    # Its callback takes longer than the period of /scan, so that several threads publish at once.
    shared = Node(
        "shared",
        groups=(Group("any_time", is_reentrant=True),),
        publishers=(Publisher("/points", 20, size_bytes=4_000_000),),
        subscriptions=(
            Subscription(
                "/scan", ("/points",), Work(2 * MILLISECOND, 9 * MILLISECOND), 20, group="any_time"
            ),
        ),
    )
    sink = Node(
        "sink",
        subscriptions=tuple(
            Subscription(topic, depth=20) for topic in ("/cloud", "/info", "/points")
        ),
    )
    return Scenario(
        name="rivals",
        description="Several writes on a topic at once: of two publishers, of threads of one.",
        hosts=(Host("alpha", cpu_count=8),),
        processes=(
            Process("front", "alpha", 1101, (cameras[0],)),
            Process("rear", "alpha", 1201, (cameras[1],), start_ns=3 * MILLISECOND),
            Process("source", "alpha", 1301, (source,), start_ns=5 * MILLISECOND),
            Process(
                "shared",
                "alpha",
                1401,
                (shared,),
                start_ns=7 * MILLISECOND,
                executors=(Executor("multi_threaded", 4),),
            ),
            Process("sink", "alpha", 1501, (sink,), start_ns=11 * MILLISECOND),
        ),
        duration_ns=6 * SECOND,
    )
