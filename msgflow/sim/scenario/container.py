"""Components of one process on few CPUs, as robots run them."""

from __future__ import annotations

from dataclasses import replace

from msgflow.sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow.sim.system import Executor, Host, Node, Process, Scenario

_CAMERA = Node(
    "camera",
    publishers=(Publisher("/image", depth=3, intra_process=True),),
    timers=(Timer(10 * MILLISECOND, ("/image",)),),
)
_EDGES = Node(
    "edges",
    publishers=(Publisher("/edges", depth=3, intra_process=True),),
    subscriptions=(
        Subscription("/image", ("/edges",), Work(4 * MILLISECOND), depth=3, intra_process=True),
    ),
)
# What it hears of /edges comes through the buffer, and by DDS as well, since others listen.
_RESULT = Node(
    "result",
    publishers=(Publisher("/result"),),
    subscriptions=(
        Subscription("/edges", ("/result",), Work(MILLISECOND), depth=3, intra_process=True),
    ),
)
_SINK = Node("sink", subscriptions=(Subscription("/result"), Subscription("/edges")))


def container() -> Scenario:
    """One thread runs all components: a timer follows on messages that lead to no callback."""
    return Scenario(
        name="container",
        description="Components of one process, ring buffers and DDS, one thread, two CPUs.",
        hosts=(Host("alpha", cpu_count=2),),
        processes=(
            Process("container", "alpha", 1101, (_EDGES, _RESULT, _CAMERA)),
            Process("sink", "alpha", 1201, (_SINK,), start_ns=3 * MILLISECOND),
        ),
        duration_ns=10 * SECOND,
    )


def container_multi_threaded() -> Scenario:
    """Three threads run them, which move from CPU to CPU."""
    single = container()
    components, sink = single.processes
    executors = (Executor("multi_threaded", 3),)
    return replace(
        single,
        name="container_multi_threaded",
        description="Components of one process, ring buffers and DDS, three threads, two CPUs.",
        processes=(replace(components, executors=executors), sink),
    )
