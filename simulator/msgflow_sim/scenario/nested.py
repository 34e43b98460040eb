"""Callbacks that spin: other callbacks run nested in them, also the same one again."""

from __future__ import annotations

from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    Call,
    Client,
    Publisher,
    Service,
    Spin,
    Subscription,
    Timer,
)
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario

_SOURCE = Node(
    "source",
    publishers=(Publisher("/input"),),
    timers=(Timer(3 * MILLISECOND, ("/input",)),),
)
_SPINNER = Node(
    "spinner",
    groups=(Group("again", is_reentrant=True, executor=1), Group("answers", executor=2)),
    publishers=(Publisher("/input_seen"), Publisher("/done")),
    clients=(Client("/look_up", group="answers"),),
    subscriptions=(
        # Each run spins the executor that it is in, until three of them are nested.
        Subscription(
            "/input", ("/input_seen",), does=(Spin(1, 4 * MILLISECOND, depth=3),), group="again"
        ),
    ),
    timers=(
        Timer(20 * MILLISECOND, ("/done",), does=(Spin(1, 6 * MILLISECOND, depth=3),)),
        # Waits in its callback until the service has answered.
        Timer(50 * MILLISECOND, ("/done",), does=(Call("/look_up", spins=2),)),
    ),
)


def nested() -> Scenario:
    """Recursion: callbacks that spin an executor, and one that waits for a response."""
    return Scenario(
        name="nested",
        description="Callbacks that spin: nested callbacks, also of the same subscription.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (_SOURCE,)),
            Process(
                "spinner",
                "alpha",
                1201,
                (_SPINNER,),
                start_ns=3 * MILLISECOND,
                executors=(Executor(), Executor("nested"), Executor("nested")),
            ),
            Process(
                "sink",
                "alpha",
                1301,
                (
                    Node(
                        "sink",
                        subscriptions=(Subscription("/input_seen"), Subscription("/done")),
                        services=(Service("/look_up"),),
                    ),
                ),
                start_ns=7 * MILLISECOND,
            ),
        ),
        duration_ns=3 * SECOND,
    )
