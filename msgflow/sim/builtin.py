"""The scenarios that come with msgflow."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

from msgflow.sim.entity import MILLISECOND, Publisher, Subscription, Timer
from msgflow.sim.robot import demo
from msgflow.sim.scenario import (
    annotated,
    autoware,
    bursts,
    container,
    delivery,
    executors,
    intra_process,
    layers,
    lives,
    nested,
    reentrant,
    rtabmap,
    services,
    stamps,
    starvation,
    traffic,
    transforms,
)
from msgflow.sim.system import Host, Node, Process, Scenario

if TYPE_CHECKING:
    from collections.abc import Mapping


def scenarios() -> Mapping[str, Scenario]:
    """Every built-in scenario by name."""
    built_in = (
        _pipeline(),
        _fan_out(),
        _two_hosts(),
        _quiet(),
        demo(),
        executors.multi_threaded(),
        executors.executors(),
        nested.nested(),
        intra_process.intra_process(),
        intra_process.mixed_intra_process(),
        container.container(),
        container.container_multi_threaded(),
        delivery.overload(),
        delivery.losses(),
        starvation.starved(),
        starvation.overwritten_copies(),
        transforms.transforms(),
        services.services(),
        lives.restarts(),
        lives.container_restarts(),
        stamps.equal_stamps(),
        traffic.host_chain(),
        bursts.bursts(),
        bursts.bursts_two_hosts(),
        layers.python(),
        layers.layers(),
        annotated.periodic_async(),
        annotated.partial_sync(),
        reentrant.reentrant(),
        autoware.autoware(),
        autoware.autoware_two_threads(),
        rtabmap.rtabmap(),
    )
    return MappingProxyType({scenario.name: scenario for scenario in built_in})


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


def _pipeline() -> Scenario:
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


def _two_hosts() -> Scenario:
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


def _quiet() -> Scenario:
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


def _fan_out() -> Scenario:
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
