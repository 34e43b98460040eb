"""Messages that do not arrive, for every reason."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Executor, Host, Node, Process, Scenario


def overload() -> Scenario:
    """Slow readers whose queues overwrite old messages."""
    source = Node(
        "source",
        publishers=(Publisher("/points"), Publisher("/image", 1)),
        timers=(Timer(5 * MILLISECOND, ("/points",)), Timer(7 * MILLISECOND, ("/image",))),
    )
    slow = Node(
        "slow",
        publishers=(Publisher("/result"),),
        subscriptions=(
            Subscription("/points", ("/result",), Work(12 * MILLISECOND, 6 * MILLISECOND), 3),
            Subscription("/image", ("/result",), Work(4 * MILLISECOND), 1),
        ),
    )
    sink = Node("sink", subscriptions=(Subscription("/result"), Subscription("/points")))
    return Scenario(
        name="overload",
        description="Readers that are too slow: full queues drop their oldest messages.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            Process("slow", "alpha", 1201, (slow,), start_ns=3 * MILLISECOND),
            Process("sink", "alpha", 1301, (sink,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=4 * SECOND,
        overwrites=True,
    )


def losses() -> Scenario:
    """Every other reason: loss, lifespan, discovery, subscriptions that come late and leave."""
    topics = ("/lossy", "/short_lived", "/late", "/dynamic", "/reliable")
    source = Node(
        "source",
        publishers=(
            Publisher("/lossy"),
            Publisher("/short_lived", lifespan_ns=3 * MILLISECOND),
            Publisher("/late"),
            Publisher("/dynamic"),
            Publisher("/reliable"),
        ),
        timers=(Timer(10 * MILLISECOND, topics),),
    )
    listener = Node(
        "listener",
        subscriptions=(
            Subscription("/lossy", loss=0.1),
            Subscription("/late", discovery_ns=800 * MILLISECOND),
            Subscription("/reliable"),
            Subscription("/dynamic", destroyed_ns=900 * MILLISECOND),
            # It gets the addresses of the one that was destroyed.
            Subscription("/dynamic", created_ns=1_500 * MILLISECOND),
        ),
    )
    # Now and then it is busy until messages have expired.
    busy = Node(
        "busy",
        subscriptions=(
            Subscription("/short_lived", depth=2),
            Subscription("/reliable", work=Work(MILLISECOND, 0, 0.2, 25 * MILLISECOND)),
        ),
    )
    return Scenario(
        name="losses",
        description="Lossy transport, expired messages, late discovery, late and early ends.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            Process(
                "listener",
                "alpha",
                1201,
                (listener,),
                start_ns=3 * MILLISECOND,
                executors=(Executor(),),
            ),
            Process("busy", "alpha", 1301, (busy,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
        overwrites=True,
    )
