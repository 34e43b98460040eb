"""The middleware: who has discovered whom, how long messages travel, where they wait."""

from __future__ import annotations

from collections import defaultdict, deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.sim.system import MICROSECOND, MILLISECOND

if TYPE_CHECKING:
    from msgflow.sim.executor import ExecutorThread
    from msgflow.sim.machine import RunningProcess
    from msgflow.sim.system import Subscription
    from msgflow.sim.world import World


@dataclass(slots=True)
class Root:
    """A run of a timer's callback, where flows begin."""

    callback_instance_id: int
    hostname: str
    pid: int
    tid: int
    start: int
    start_ns: int


@dataclass(slots=True)
class Message:
    """One publication, on its way. Names in `_ns` are stamps of the publisher's host."""

    publication_id: int
    publisher: PublisherObject
    tid: int
    rclcpp_ns: int | None
    rcl_ns: int
    rmw: int
    rmw_ns: int
    stamp_ns: int
    root: Root | None
    path: tuple[str, ...]


@dataclass(slots=True)
class PublisherObject:
    """A publisher as it exists in its process.

    Attributes:
        init_handle: the handle that rcl_publisher_init names.
        handle: the handle that rcl_publish names.
        is_rclcpp: publishing passes through rclcpp (not for /rosout).
        matches: one per subscription of the topic.
        size_bytes: size of its messages, of which the duration of writing depends.
    """

    process: RunningProcess
    node: str
    topic: str
    init_handle: int
    handle: int
    rmw_handle: int
    message: int
    is_rclcpp: bool
    is_internal: bool
    created: int
    matches: list[Match]
    size_bytes: int = 0


@dataclass(slots=True)
class SubscriptionObject:
    """A subscription as it exists in its process, with the queue of its reader."""

    process: RunningProcess
    thread: ExecutorThread
    description: Subscription
    node: str
    handle: int
    rmw_handle: int
    callback: int
    message: int
    publishers: tuple[PublisherObject, ...]
    log: PublisherObject | None
    is_internal: bool
    is_sink: bool
    created: int
    queue: deque[Message]


@dataclass(slots=True)
class Match:
    """A publisher and a subscription that know each other from `since` on."""

    subscription: SubscriptionObject
    since: int
    latency: Latency
    last_arrival: int = 0


@dataclass(frozen=True, slots=True)
class Latency:
    """How long messages travel and how long discovery takes between two processes."""

    base: int
    tail: int
    discovery: int
    discovery_spread: int


_SAME_PROCESS = Latency(12 * MICROSECOND, 3 * MICROSECOND, 0, 0)
_SAME_HOST = Latency(35 * MICROSECOND, 15 * MICROSECOND, 4 * MILLISECOND, 12 * MILLISECOND)
_OTHER_HOST = Latency(220 * MICROSECOND, 90 * MICROSECOND, 12 * MILLISECOND, 25 * MILLISECOND)


def latency_between(one: RunningProcess, other: RunningProcess) -> Latency:
    """The latency that applies between two processes."""
    if one is other:
        return _SAME_PROCESS
    return _SAME_HOST if one.machine is other.machine else _OTHER_HOST


class Middleware:
    """Carries messages from publishers to the queues of the subscriptions that are matched.

    Messages of one publisher arrive in order at each subscription. What was published before the
    two had discovered each other is not delivered (durability volatile).

    Attributes:
        full_queues: how often a message arrived at a queue that held as many as its depth says.
        failed_takes: how often a take found no message.
        undelivered: how many messages were not delivered to a subscription, by reason.
    """

    def __init__(self, world: World, *, overwrites: bool) -> None:
        self._world = world
        self._overwrites = overwrites
        self.full_queues = 0
        self.failed_takes = 0
        self.undelivered: dict[str, int] = {}
        self._publishers: dict[str, list[PublisherObject]] = defaultdict(list)
        self._subscriptions: dict[str, list[SubscriptionObject]] = defaultdict(list)

    def add_publisher(self, publisher: PublisherObject) -> None:
        """A publisher was created: match it with the subscriptions there are."""
        self._publishers[publisher.topic].append(publisher)
        for subscription in self._subscriptions[publisher.topic]:
            self._match(publisher, subscription)

    def add_subscription(self, subscription: SubscriptionObject) -> None:
        """A subscription was created: match it with the publishers there are."""
        topic = subscription.description.topic
        self._subscriptions[topic].append(subscription)
        for publisher in self._publishers[topic]:
            self._match(publisher, subscription)

    def send(self, time: int, message: Message) -> None:
        """Send a message at `time` to whom the publisher knows."""
        world = self._world
        for match in message.publisher.matches:
            if match.since > time:
                self._undelivered(message, match.subscription, "before_discovery")
                continue
            latency = match.latency
            arrival = time + latency.base + world.tail(latency.tail)
            if arrival <= match.last_arrival:
                arrival = match.last_arrival + 1
            match.last_arrival = arrival
            world.at(arrival, self.arrive, (match.subscription, message))

    def arrive(self, time: int, delivery: tuple[SubscriptionObject, Message]) -> None:
        """Put a message into the queue of a subscription and wake the executor."""
        subscription, message = delivery
        queue = subscription.queue
        if len(queue) >= subscription.description.depth:
            self.full_queues += 1
            if self._overwrites:
                self._undelivered(queue.popleft(), subscription, "overwritten")
        queue.append(message)
        subscription.thread.wake(time)

    def finish(self) -> None:
        """Write down what was on its way or waiting at the end."""
        for subscription, message in self._world.left(self.arrive):
            self._undelivered(message, subscription, "pending_at_end")
        for subscriptions in self._subscriptions.values():
            for subscription in subscriptions:
                for message in subscription.queue:
                    self._undelivered(message, subscription, "pending_at_end")

    def _match(self, publisher: PublisherObject, subscription: SubscriptionObject) -> None:
        latency = latency_between(publisher.process, subscription.process)
        since = max(publisher.created, subscription.created) + latency.discovery
        since += int(self._world.random() * latency.discovery_spread)
        publisher.matches.append(Match(subscription, since, latency))

    def _undelivered(self, message: Message, target: SubscriptionObject, reason: str) -> None:
        publisher = message.publisher
        self.undelivered[reason] = self.undelivered.get(reason, 0) + 1
        self._world.truth.undelivered.add(
            message.publication_id,
            publisher.topic,
            publisher.process.machine.hostname,
            publisher.process.pid,
            message.tid,
            message.rmw_ns,
            message.stamp_ns,
            target.process.machine.hostname,
            target.process.pid,
            target.handle,
            reason,
            publisher.is_internal,
        )
