"""Readers that do not get to what waits for them."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Executor, Host, Node, Process, Scenario


def starved() -> Scenario:
    """A reader that waits, and gets no CPU when messages come: its queues overflow meanwhile."""
    source = Node(
        "source",
        publishers=(Publisher("/points"), Publisher("/state"), Publisher("/lossy")),
        timers=(
            Timer(5 * MILLISECOND, ("/points",)),
            Timer(11 * MILLISECOND, ("/state",)),
            Timer(20 * MILLISECOND, ("/lossy",)),
        ),
    )
    # Each in a process of its own, so that nothing else wakes it.
    readers = (
        Node("points", subscriptions=(Subscription("/points", depth=3),)),
        Node("state", subscriptions=(Subscription("/state", depth=1),)),
        Node("lossy", subscriptions=(Subscription("/lossy", loss=0.1),)),
    )
    return Scenario(
        name="starved",
        description="Readers that get no CPU for tens of milliseconds while they wait.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            *(
                Process(
                    node.name,
                    "alpha",
                    1201 + 100 * number,
                    (node,),
                    start_ns=(3 + number) * MILLISECOND,
                    starved_ns=((170 + 30 * number) * MILLISECOND, 40 * MILLISECOND),
                )
                for number, node in enumerate(readers)
            ),
        ),
        duration_ns=10 * SECOND,
        overwrites=True,
    )


def overwritten_copies() -> Scenario:
    """A slow reader whose ring buffer overwrites what comes to it by DDS as well."""
    camera = Node(
        "camera",
        publishers=(Publisher("/image", intra_process=True),),
        timers=(Timer(8 * MILLISECOND, ("/image",)),),
    )
    slow = Node(
        "slow",
        executor=1,
        subscriptions=(
            Subscription("/image", work=Work(30 * MILLISECOND), depth=3, intra_process=True),
        ),
    )
    recorder = Node("recorder", subscriptions=(Subscription("/image"),))
    return Scenario(
        name="overwritten_copies",
        description="A ring buffer overwrites messages whose copies by DDS no callback gets.",
        hosts=(Host("alpha"),),
        processes=(
            Process(
                "container",
                "alpha",
                1101,
                (slow, camera),
                executors=(Executor(), Executor()),
            ),
            Process("recorder", "alpha", 1201, (recorder,), start_ns=3 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )
