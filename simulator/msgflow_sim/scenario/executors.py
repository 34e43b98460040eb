"""Executors: many threads, callback groups, several in a process, polled ones, odd timers."""

from __future__ import annotations

from dataclasses import replace

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario

_SOURCE = Node(
    "source",
    publishers=(Publisher("/fast"), Publisher("/slow")),
    timers=(Timer(4 * MILLISECOND, ("/fast",)), Timer(20 * MILLISECOND, ("/slow",))),
)
_SINK = Node("sink", subscriptions=(Subscription("/seen"), Subscription("/checked")))

# Its callback of /fast takes longer than the period of /fast, so that two threads run it at once.
_WORKER = Node(
    "worker",
    groups=(Group("any_time", is_reentrant=True), Group("one_by_one")),
    publishers=(Publisher("/seen"), Publisher("/checked")),
    subscriptions=(
        Subscription("/fast", ("/seen",), Work(5 * MILLISECOND, 3 * MILLISECOND), group="any_time"),
        Subscription("/slow", ("/checked",), Work(2 * MILLISECOND), group="one_by_one"),
    ),
    timers=(Timer(15 * MILLISECOND, work=Work(MILLISECOND), group="one_by_one"),),
)


def multi_threaded() -> Scenario:
    """Four threads; several of them run the same reentrant callback."""
    return Scenario(
        name="multi_threaded",
        description="Four threads of one executor, a reentrant callback on several at once.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (_SOURCE,)),
            Process(
                "worker",
                "alpha",
                1201,
                (_WORKER,),
                start_ns=3 * MILLISECOND,
                executors=(Executor("multi_threaded", 4),),
            ),
            Process("sink", "alpha", 1301, (_SINK,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=4 * SECOND,
    )


def executors() -> Scenario:
    """One process with several executors, one of them without executor events."""
    planner = Node(
        "planner",
        publishers=(Publisher("/seen"),),
        subscriptions=(Subscription("/fast", ("/seen",), Work(MILLISECOND)),),
    )
    checker = Node(
        "checker",
        executor=1,
        publishers=(Publisher("/checked"),),
        subscriptions=(Subscription("/slow", ("/checked",), Work(3 * MILLISECOND)),),
    )
    # A node whose timer another executor spins.
    monitor = Node(
        "monitor",
        groups=(Group("watchdog", executor=2),),
        subscriptions=(Subscription("/seen"),),
        timers=(Timer(10 * MILLISECOND, group="watchdog"),),
    )
    return Scenario(
        name="executors",
        description="Three executors in one process, a static one without executor events.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (_SOURCE,)),
            Process(
                "container",
                "alpha",
                1201,
                (planner, checker, monitor),
                start_ns=3 * MILLISECOND,
                executors=(
                    Executor(),
                    Executor("static_single_threaded"),
                    Executor("multi_threaded", 2),
                ),
            ),
            Process("sink", "alpha", 1301, (_SINK,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=4 * SECOND,
    )


def events_executors() -> Scenario:
    """Two events executors, one of which publishes to itself; a queue that overflows."""
    source = replace(
        _SOURCE,
        timers=(
            Timer(4 * MILLISECOND, ("/fast",)),
            Timer(7 * MILLISECOND, ("/slow",)),
        ),
    )
    relay = Node(
        "relay",
        publishers=(Publisher("/own"), Publisher("/mine"), Publisher("/seen")),
        subscriptions=(
            Subscription("/own", ("/seen",), Work(200_000)),
            Subscription("/mine", ("/seen",), Work(MILLISECOND)),
        ),
        timers=(
            Timer(6 * MILLISECOND, ("/own", "/mine"), Work(300_000)),
            Timer(10 * MILLISECOND, ("/mine", "/own"), Work(300_000)),
        ),
    )
    worker = Node(
        "worker",
        publishers=(Publisher("/checked"),),
        subscriptions=(
            Subscription("/fast", work=Work(MILLISECOND)),
            Subscription("/slow", ("/checked",), Work(MILLISECOND, MILLISECOND, 0.05, 20_000_000)),
            Subscription("/seen", work=Work(100_000), depth=2),
        ),
        timers=(Timer(20 * MILLISECOND, work=Work(MILLISECOND)),),
    )
    return Scenario(
        name="events_executors",
        description="Two events executors, one that publishes to itself, a queue that overflows.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            Process(
                "relay",
                "alpha",
                1201,
                (relay,),
                start_ns=3 * MILLISECOND,
                executors=(Executor("events"),),
            ),
            Process(
                "worker",
                "alpha",
                1301,
                (worker,),
                start_ns=5 * MILLISECOND,
                executors=(Executor("events"),),
            ),
            Process("sink", "alpha", 1401, (_SINK,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=4 * SECOND,
    )


def busy_waiting() -> Scenario:
    """Callbacks that are ready wake an executor that may not run them yet; another one sleeps."""
    crowded = Node(
        "crowded",
        subscriptions=(Subscription("/fast"), Subscription("/slow", work=Work(8 * MILLISECOND))),
        timers=(Timer(15 * MILLISECOND, work=Work(MILLISECOND)),),
    )
    return Scenario(
        name="busy_waiting",
        description="Two multi-threaded executors, one of which waits busily.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (_SOURCE,)),
            Process(
                "crowded",
                "alpha",
                1201,
                (crowded,),
                start_ns=3 * MILLISECOND,
                executors=(Executor("multi_threaded", 2, waits_busily=True),),
            ),
            Process(
                "worker",
                "alpha",
                1301,
                (_WORKER,),
                start_ns=5 * MILLISECOND,
                executors=(Executor("multi_threaded", 4),),
            ),
            Process("sink", "alpha", 1401, (_SINK,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=SECOND,
    )


def polled() -> Scenario:
    """Loops that execute what is ready and then do something else; one that waits in between."""
    relay = Node(
        "relay",
        publishers=(Publisher("/seen"),),
        subscriptions=(Subscription("/fast", ("/seen",)),),
        timers=(Timer(40 * MILLISECOND),),
    )
    checker = Node(
        "checker",
        publishers=(Publisher("/checked"),),
        subscriptions=(Subscription("/slow", ("/checked",)),),
    )
    return Scenario(
        name="polled",
        description="Loops that poll their executor, and one that waits in it for a while.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (_SOURCE,)),
            Process(
                "relay",
                "alpha",
                1201,
                (relay,),
                start_ns=3 * MILLISECOND,
                executors=(Executor(polled_ns=15 * MILLISECOND),),
            ),
            Process(
                "checker",
                "alpha",
                1301,
                (checker,),
                start_ns=5 * MILLISECOND,
                executors=(Executor(timeout_ns=12 * MILLISECOND),),
            ),
            Process("sink", "alpha", 1401, (_SINK,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=2 * SECOND,
    )


def timers() -> Scenario:
    """Timers on and off the grid of their creation; one is kept waiting by another callback."""
    node = Node(
        "node",
        timers=(
            Timer(100 * MILLISECOND, reset_ns=540 * MILLISECOND),
            Timer(70 * MILLISECOND, rate=2.0),
            Timer(50 * MILLISECOND),
        ),
    )
    late = Node(
        "late",
        timers=(
            Timer(20 * MILLISECOND, work=Work(15 * MILLISECOND, MILLISECOND)),
            Timer(60 * MILLISECOND),
        ),
    )
    return Scenario(
        name="timers",
        description="Timers: one is reset, one follows a clock that runs twice as fast.",
        hosts=(Host("alpha"),),
        processes=(
            Process("node", "alpha", 1101, (node,)),
            Process("late", "alpha", 1201, (late,), start_ns=3 * MILLISECOND),
        ),
        duration_ns=5 * SECOND,
    )
