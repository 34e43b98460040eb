"""Pipelines: a source, a relay and a sink, and other systems of a few processes."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Host, Node, Process, Scenario

_SOURCE = Node(
    "source",
    publishers=(Publisher("/topic_a"),),
    timers=(Timer(5 * MILLISECOND, publishes=("/topic_a",)),),
)
_RELAY = Node(
    "relay",
    publishers=(Publisher("/topic_b"),),
    subscriptions=(Subscription("/topic_a", publishes=("/topic_b",)),),
)
_SINK = Node("sink", subscriptions=(Subscription("/topic_b", logs=True),))


def pipeline() -> Scenario:
    """A source with a timer, a relay and a sink, on one host."""
    return Scenario(
        name="pipeline",
        description="A source with a timer of 5 ms, a relay and a sink: three processes, one host.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (_SOURCE,)),
            Process("relay", "alpha", 1201, (_RELAY,), start_ns=3 * MILLISECOND),
            Process("sink", "alpha", 1301, (_SINK,), start_ns=7 * MILLISECOND),
        ),
    )


def two_hosts() -> Scenario:
    """The pipeline with its relay on another host."""
    return Scenario(
        name="two_hosts",
        description="The pipeline with the relay on a second host that uses the same process id.",
        hosts=(Host("alpha"), Host("beta")),
        processes=(
            Process("source", "alpha", 1101, (_SOURCE,)),
            Process("relay", "beta", 1101, (_RELAY,), start_ns=3 * MILLISECOND),
            Process("sink", "alpha", 1301, (_SINK,), start_ns=7 * MILLISECOND),
        ),
    )


def quiet() -> Scenario:
    """A source with a slow timer and a sink."""
    source = Node(
        "source",
        publishers=(Publisher("/topic_a"),),
        timers=(Timer(300 * MILLISECOND, publishes=("/topic_a",)),),
    )
    sink = Node("sink", subscriptions=(Subscription("/topic_a"),))
    return Scenario(
        name="quiet",
        description="A source with a timer of 300 ms and a sink: nothing else happens.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            Process("sink", "alpha", 1201, (sink,), start_ns=3 * MILLISECOND),
        ),
    )


def stall() -> Scenario:
    """A source that is busy with one callback for 150 ms, once, and a sink."""
    source = Node(
        "source",
        publishers=(Publisher("/topic_a"), Publisher("/map")),
        timers=(
            Timer(10 * MILLISECOND, publishes=("/topic_a",)),
            Timer(
                1_300 * MILLISECOND,
                publishes=("/map",),
                work=Work(typical_ns=150 * MILLISECOND, percent_before=100),
            ),
        ),
    )
    sink = Node("sink", subscriptions=(Subscription("/topic_a"), Subscription("/map")))
    return Scenario(
        name="stall",
        description="A source with a timer of 10 ms and a callback that holds it up once.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            Process("sink", "alpha", 1201, (sink,), start_ns=3 * MILLISECOND),
        ),
        duration_ns=2 * SECOND,
    )


def fan_out() -> Scenario:
    """One callback publishes on two topics."""
    topics = ("/topic_a", "/topic_b")
    source = Node(
        "source",
        publishers=tuple(Publisher(topic) for topic in topics),
        timers=(Timer(10 * MILLISECOND, publishes=topics),),
    )
    listeners = {
        "first_a": ("/topic_a",),
        "second_a": ("/topic_a",),
        "only_b": ("/topic_b",),
        "both": topics,
    }
    return Scenario(
        name="fan_out",
        description="One callback publishes on two topics, each with several subscriptions.",
        hosts=(Host("alpha"),),
        processes=(
            Process("source", "alpha", 1101, (source,)),
            *(
                Process(
                    name,
                    "alpha",
                    1201 + 100 * number,
                    (Node(name, subscriptions=tuple(Subscription(topic) for topic in heard)),),
                    start_ns=(3 + 4 * number) * MILLISECOND,
                )
                for number, (name, heard) in enumerate(listeners.items())
            ),
        ),
    )
