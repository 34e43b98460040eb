"""Bursts: publications within microseconds, as of markers, or with equal source stamps."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Host, Node, Process, Scenario

# Layers of a publication follow each other within some 100 ns, as in an optimised build.
_PACE = 0.3


def bursts() -> Scenario:
    """Bursts on several topics, of small and of larger messages, relayed as bursts."""
    return _scenario(
        "bursts", "Publishers that publish several messages 2 to 4 µs apart.", ("alpha",)
    )


def bursts_two_hosts() -> Scenario:
    """The same with the relay on another host: some messages are taken there only."""
    return _scenario(
        "bursts_two_hosts", "The bursts with their relay on a second host.", ("alpha", "beta")
    )


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


def _scenario(name: str, description: str, hostnames: tuple[str, ...]) -> Scenario:
    markers = Node(
        "markers",
        publishers=(Publisher("/markers", 50), Publisher("/status", 50)),
        timers=(
            Timer(10 * MILLISECOND, ("/markers",) * 6),
            Timer(23 * MILLISECOND, ("/status", "/markers", "/status", "/markers")),
        ),
    )
    # Serialised messages of a few kilobytes take as long to write as the burst is apart.
    clusters = Node(
        "clusters",
        publishers=(
            Publisher("/clusters", 50, size_bytes=6_000, kind="serialized"),
            Publisher("/hulls", 50, size_bytes=1_500),
            Publisher("/images", 50, size_bytes=200_000, kind="loaned"),
        ),
        timers=(
            Timer(17 * MILLISECOND, ("/hulls", "/clusters", "/hulls", "/clusters", "/images")),
        ),
    )
    # A second publisher of the same topic.
    others = Node(
        "others",
        publishers=(Publisher("/markers", 50),),
        timers=(Timer(31 * MILLISECOND, ("/markers",) * 3),),
    )
    relay = Node(
        "relay",
        publishers=(Publisher("/boxes", 50),),
        subscriptions=(
            Subscription("/markers", ("/boxes",) * 3, Work(6_000, 6_000), depth=50),
            Subscription("/clusters", ("/boxes", "/boxes"), Work(6_000, 6_000), depth=50),
        ),
    )
    sink = Node(
        "sink",
        subscriptions=tuple(
            Subscription(topic, work=Work(3_000, 3_000), depth=50)
            for topic in ("/boxes", "/status", "/hulls", "/images")
        ),
    )
    near, far = hostnames[0], hostnames[-1]
    return Scenario(
        name=name,
        description=description,
        hosts=tuple(Host(hostname, publish_pace=_PACE) for hostname in hostnames),
        processes=(
            Process("markers", near, 1101, (markers,)),
            Process("clusters", near, 1201, (clusters,), start_ns=3 * MILLISECOND),
            Process("others", near, 1301, (others,), start_ns=7 * MILLISECOND),
            Process("relay", far, 1401, (relay,), start_ns=11 * MILLISECOND),
            Process("sink", near, 1501, (sink,), start_ns=13 * MILLISECOND),
        ),
        duration_ns=4 * SECOND,
    )
