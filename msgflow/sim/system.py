"""What a simulated ROS 2 system consists of: data only, no behaviour.

All durations are nanoseconds. A scenario is immutable; `dataclasses.replace` makes variants of one.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from msgflow.errors import UsageError
from msgflow.sim.recording import PERFECT, Recording

MICROSECOND = 1_000
MILLISECOND = 1_000_000
SECOND = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Work:
    """How long a callback computes: `typical_ns` plus up to `spread_ns`, at times `slow_ns` more.

    Attributes:
        typical_ns: shortest duration.
        spread_ns: width of the even spread above it.
        slow_probability: share of the runs (0..1) that take up to `slow_ns` longer.
        slow_ns: greatest additional duration of a slow run; it is at least half of that.
    """

    typical_ns: int = 20 * MICROSECOND
    spread_ns: int = 30 * MICROSECOND
    slow_probability: float = 0.0
    slow_ns: int = 0


@dataclass(frozen=True, slots=True)
class Publisher:
    """A publisher of a node: topic (fully expanded), history depth, size of its messages."""

    topic: str
    depth: int = 10
    size_bytes: int = 0


@dataclass(frozen=True, slots=True)
class Subscription:
    """A subscription of a node and what its callback does.

    Attributes:
        topic: topic, fully expanded.
        publishes: topics that each run of the callback publishes on, in this order.
        work: how long the callback computes.
        depth: history depth (keep last).
        message_type: C++ name of the message, part of the callback's symbol.
        logs: each run of the callback logs once, which publishes on /rosout.
    """

    topic: str
    publishes: tuple[str, ...] = ()
    work: Work = Work()
    depth: int = 10
    message_type: str = "std_msgs::msg::String"
    logs: bool = False


@dataclass(frozen=True, slots=True)
class Timer:
    """A timer of a node and what its callback does; see `Subscription`."""

    period_ns: int
    publishes: tuple[str, ...] = ()
    work: Work = Work()
    logs: bool = False

    def __post_init__(self) -> None:
        if self.period_ns <= 0:
            raise UsageError(f"the period of a timer must be positive — {self.period_ns} ns")


@dataclass(frozen=True, slots=True)
class Node:
    """A node: its objects are created in the order publishers, subscriptions, timers."""

    name: str
    namespace: str = "/"
    publishers: tuple[Publisher, ...] = ()
    subscriptions: tuple[Subscription, ...] = ()
    timers: tuple[Timer, ...] = ()

    @property
    def full_name(self) -> str:
        """Namespace and name, as in `/camera/driver`."""
        return f"{self.namespace.rstrip('/')}/{self.name}"


@dataclass(frozen=True, slots=True)
class Process:
    """A process: its nodes are spun by one single-threaded executor in the main thread.

    Attributes:
        name: name of the executable; the trace shows its first 15 characters.
        hostname: the host it runs on.
        pid: process id, also the id of the main thread; at least 10 apart on one host, since
            the middleware's thread has the id `pid + 9`.
        nodes: created in this order.
        start_ns: when it starts, after the begin of tracing.
    """

    name: str
    hostname: str
    pid: int
    nodes: tuple[Node, ...]
    start_ns: int = 0


@dataclass(frozen=True, slots=True)
class Host:
    """A machine with a boot and a clock of its own, `clock_offset_ns` ahead of the true time."""

    hostname: str
    cpu_count: int = 4
    clock_offset_ns: int = 0


@dataclass(frozen=True, slots=True)
class Scenario:
    """A whole system and how long it is traced.

    Attributes:
        name: name by which it is asked for.
        description: one sentence.
        hosts: its hosts.
        processes: its processes, on these hosts.
        duration_ns: length of the trace for factor 1.
        layout: name of the trace layout, see `msgflow.sim.layout`.
        overwrites: a full queue drops its oldest message (keep last); when false, queues hold
            whatever comes, so that every message is delivered.
        recording: how its traces are recorded.
    """

    name: str
    description: str
    hosts: tuple[Host, ...]
    processes: tuple[Process, ...]
    duration_ns: int = 10 * SECOND
    layout: str = "jazzy"
    overwrites: bool = False
    recording: Recording = PERFECT

    def __post_init__(self) -> None:
        hostnames = {host.hostname for host in self.hosts}
        if not self.hosts or len(hostnames) != len(self.hosts):
            raise UsageError(f"hosts need distinct names — scenario {self.name}")
        if bad := [name for name in hostnames if name in {"", ".", "..", "truth"} or "/" in name]:
            raise UsageError(f"cannot be the name of a host's folder — {bad[0]}")
        for process in self.processes:
            if process.hostname not in hostnames:
                raise UsageError(f"unknown host {process.hostname} — process {process.name}")
            for node in process.nodes:
                _check_topics(node)
        threads = Counter(
            (process.hostname, thread)
            for process in self.processes
            for thread in (process.pid, process.pid + 9)
        )
        if any(count > 1 for count in threads.values()):
            raise UsageError(f"process ids are too close on one host — scenario {self.name}")


def _check_topics(node: Node) -> None:
    own = {publisher.topic for publisher in node.publishers}
    callbacks: tuple[Subscription | Timer, ...] = (*node.subscriptions, *node.timers)
    used = {topic for callback in callbacks for topic in callback.publishes}
    if missing := sorted(used - own):
        raise UsageError(f"no publisher of {', '.join(missing)} — node {node.full_name}")
