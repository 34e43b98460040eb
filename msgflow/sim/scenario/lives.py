"""Processes that end, and others that get their ids and addresses."""

from __future__ import annotations

from msgflow.sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow.sim.system import Executor, Host, Node, Process, Scenario


def restarts() -> Scenario:
    """One process is restarted, one crashes in a callback, one is another program afterwards."""
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
    return Scenario(
        name="restarts",
        description="Processes end or crash, and begin again with their ids and addresses.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            Process(
                "relay", "alpha", 1201, (relay,), start_ns=3 * MILLISECOND,
                stop_ns=1_000 * MILLISECOND,
            ),
            Process(
                "relay", "alpha", 1201, (relay,), start_ns=1_200 * MILLISECOND,
                stop_ns=2_001 * MILLISECOND, is_killed=True, executors=(Executor(),),
            ),
            Process("relay", "alpha", 1201, (relay,), start_ns=2_300 * MILLISECOND),
            Process(
                "sink", "alpha", 1301, (sink,), start_ns=7 * MILLISECOND,
                stop_ns=1_500 * MILLISECOND,
            ),
            Process("other", "alpha", 1301, (other,), start_ns=1_700 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )  # fmt: skip
