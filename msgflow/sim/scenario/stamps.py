"""Source stamps that do not tell messages apart."""

from __future__ import annotations

from msgflow.sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer
from msgflow.sim.system import Host, Node, Process, Scenario


def equal_stamps() -> Scenario:
    """A clock that ticks every 4 ms: bursts on one topic and on two have equal stamps."""
    topics = ("/left", "/left", "/right", "/left")
    source = Node(
        "source",
        publishers=(Publisher("/left"), Publisher("/right")),
        timers=(Timer(11 * MILLISECOND, topics),),
    )
    relay = Node(
        "relay",
        publishers=(Publisher("/out"),),
        subscriptions=(Subscription("/left", ("/out", "/out")), Subscription("/right")),
    )
    sink = Node("sink", subscriptions=(Subscription("/out"), Subscription("/left")))
    return Scenario(
        name="equal_stamps",
        description="Messages with equal source stamps, on one topic and on several.",
        hosts=(Host("alpha", stamp_resolution_ns=4 * MILLISECOND),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            Process("relay", "alpha", 1201, (relay,), start_ns=3 * MILLISECOND),
            Process("sink", "alpha", 1301, (sink,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )
