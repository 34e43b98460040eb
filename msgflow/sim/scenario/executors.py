"""Executors: many threads, callback groups, several in one process, with and without events."""

from __future__ import annotations

from msgflow.sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow.sim.system import Executor, Group, Host, Node, Process, Scenario

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
                "worker", "alpha", 1201, (_WORKER,), start_ns=3 * MILLISECOND,
                executors=(Executor("multi_threaded", 4),),
            ),
            Process("sink", "alpha", 1301, (_SINK,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=4 * SECOND,
    )  # fmt: skip


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
                "container", "alpha", 1201, (planner, checker, monitor),
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
    )  # fmt: skip
