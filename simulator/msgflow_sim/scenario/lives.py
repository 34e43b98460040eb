"""Processes that end, and others that get their ids and addresses."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Host, Node, Process, Scenario


def restarts() -> Scenario:
    """One process is restarted, one crashes in a callback, one is another program afterwards."""
    return _restarts(
        "restarts",
        "Processes end or crash, and begin again with their ids and addresses.",
        (None, 5_200, 5_400, 5_600),
    )


def container_restarts() -> Scenario:
    """Like restarts, in containers: every thread gets the id that it had before."""
    return _restarts(
        "container_restarts",
        "The same in containers, where all threads have the ids that they had before.",
        (None, None, None, None),
    )


def _restarts(name: str, description: str, threads: tuple[int | None, ...]) -> Scenario:
    source = Node(
        "source",
        publishers=(Publisher("/data"),),
        timers=(Timer(5 * MILLISECOND, ("/data",)),),
    )
    relay = Node(
        "relay",
        publishers=(Publisher("/result"),),
        subscriptions=(Subscription("/data", ("/result",), Work(2 * MILLISECOND, MILLISECOND)),),
    )
    # Where it runs, subscriptions come and go at the same addresses.
    sink = Node(
        "sink",
        subscriptions=(
            Subscription("/result", destroyed_ns=700 * MILLISECOND),
            Subscription("/data", created_ns=800 * MILLISECOND),
        ),
    )
    other = Node("other", subscriptions=(Subscription("/result"),))
    first, second, third, fourth = threads
    return Scenario(
        name=name,
        description=description,
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            Process(
                "relay",
                "alpha",
                1201,
                (relay,),
                start_ns=3 * MILLISECOND,
                stop_ns=1_000 * MILLISECOND,
                threads_from=first,
            ),
            Process(
                "relay",
                "alpha",
                1201,
                (relay,),
                start_ns=1_200 * MILLISECOND,
                stop_ns=2_001 * MILLISECOND,
                is_killed=True,
                threads_from=second,
            ),
            Process(
                "relay",
                "alpha",
                1201,
                (relay,),
                start_ns=2_300 * MILLISECOND,
                threads_from=third,
            ),
            Process(
                "sink",
                "alpha",
                1301,
                (sink,),
                start_ns=7 * MILLISECOND,
                stop_ns=1_500 * MILLISECOND,
            ),
            Process(
                "other",
                "alpha",
                1301,
                (other,),
                start_ns=1_700 * MILLISECOND,
                threads_from=fourth,
            ),
        ),
        duration_ns=3 * SECOND,
    )
