"""Messages that stay in their process, alone or beside DDS."""

from __future__ import annotations

from dataclasses import replace

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Executor, Host, Node, Process, Scenario

_TOPICS = ("/image", "/image_info")
_CAMERA = Node(
    "camera",
    publishers=tuple(Publisher(topic, intra_process=True) for topic in _TOPICS),
    timers=(Timer(8 * MILLISECOND, _TOPICS),),
)
_FILTER = Node(
    "filter",
    publishers=(Publisher("/filtered", intra_process=True),),
    subscriptions=(
        Subscription("/image", ("/filtered",), Work(MILLISECOND), intra_process=True),
        Subscription("/image_info", intra_process=True),
    ),
)
# Too slow for what it gets: its buffer holds three messages and overwrites old ones.
_SLOW = Node(
    "slow",
    executor=1,
    subscriptions=(
        Subscription("/image", work=Work(30 * MILLISECOND), depth=3, intra_process=True),
    ),
)
_DISPLAY = Node(
    "display", executor=1, subscriptions=(Subscription("/filtered", intra_process=True),)
)

_FAST_CAMERA = Node(
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
_RESULT_SINK = Node("sink", subscriptions=(Subscription("/result"), Subscription("/edges")))


def intra_process() -> Scenario:
    """Ring buffers, with a reader that is too slow, and nothing of it through DDS."""
    return Scenario(
        name="intra_process",
        description="Nodes of one process exchange messages through ring buffers only.",
        hosts=(Host("alpha"),),
        processes=(
            Process(
                "container",
                "alpha",
                1101,
                (_FILTER, _SLOW, _DISPLAY, _CAMERA),
                executors=(Executor(), Executor()),
            ),
        ),
        duration_ns=3 * SECOND,
    )


def mixed_intra_process() -> Scenario:
    """The same messages also go to another process, hence also back to the own one by DDS."""
    late = 1_200 * MILLISECOND
    map_server = Node(
        "map_server",
        publishers=(Publisher("/map", depth=3, intra_process=True, transient_local=True),),
        timers=(Timer(150 * MILLISECOND, ("/map",)),),
    )
    listener = Node(
        "listener",
        subscriptions=(
            Subscription("/map", depth=5, intra_process=True, transient_local=True),
            Subscription(
                "/map", depth=5, intra_process=True, transient_local=True, created_ns=late
            ),
        ),
    )
    recorder = Node(
        "recorder",
        subscriptions=(
            *(Subscription(topic) for topic in (*_TOPICS, "/filtered")),
            Subscription("/map", transient_local=True, created_ns=late),
        ),
    )
    return Scenario(
        name="mixed_intra_process",
        description="Messages go through ring buffers and DDS; late subscriptions get old ones.",
        hosts=(Host("alpha"),),
        processes=(
            Process(
                "container",
                "alpha",
                1101,
                (_FILTER, _DISPLAY, listener, _CAMERA, map_server),
                executors=(Executor(), Executor("multi_threaded", 2)),
            ),
            Process("recorder", "alpha", 1201, (recorder,), start_ns=3 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )


def container() -> Scenario:
    """One thread runs all components: a timer follows on messages that lead to no callback."""
    return Scenario(
        name="container",
        description="Components of one process, ring buffers and DDS, one thread, two CPUs.",
        hosts=(Host("alpha", cpu_count=2),),
        processes=(
            Process("container", "alpha", 1101, (_EDGES, _RESULT, _FAST_CAMERA)),
            Process("sink", "alpha", 1201, (_RESULT_SINK,), start_ns=3 * MILLISECOND),
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
