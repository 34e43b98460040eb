"""The middleware: who has discovered whom, how long messages travel, where they wait."""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from msgflow.sim.entity import MICROSECOND, MILLISECOND

if TYPE_CHECKING:
    from collections.abc import Iterator

    from msgflow.sim.entity import Publisher, Subscription
    from msgflow.sim.executor import CallbackGroup, Executor
    from msgflow.sim.intra import IntraBuffer, RingBuffer
    from msgflow.sim.machine import RunningProcess
    from msgflow.sim.publish import CallbackInstance
    from msgflow.sim.user_code import UserCode
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


# Where a flow began, and the topics since then.
Origin = tuple[Root, tuple[str, ...]]


class Message:
    """One publication, on its way. Names in `_ns` are stamps of the publisher's host.

    Attributes:
        origins: the flows that lead to it, as far as they began in timers.
        rmw: time of rmw_publish; `intra` that of rclcpp_intra_publish.
    """

    __slots__ = (
        "intra", "intra_ns", "origins", "publication_id", "publisher", "rcl_ns", "rclcpp_ns", "rmw",
        "rmw_ns", "stamp_ns", "tid",
    )  # fmt: skip

    def __init__(
        self,
        publication_id: int,
        publisher: PublisherObject,
        tid: int,
        instance: CallbackInstance | None,
        *,
        intra: int | None = None,
        intra_ns: int | None = None,
    ) -> None:
        self.publication_id = publication_id
        self.publisher = publisher
        self.tid = tid
        self.origins: tuple[Origin, ...] = ()
        if instance is not None:
            self.origins = _origins(instance, publisher.topic)
        self.intra = intra
        self.intra_ns = intra_ns
        self.rclcpp_ns: int | None = None
        self.rcl_ns: int | None = None
        self.rmw: int | None = None
        self.rmw_ns: int | None = None
        self.stamp_ns: int | None = None

    @property
    def time(self) -> int:
        """When it was published."""
        time = self.rmw if self.intra is None else self.intra
        assert time is not None
        return time

    def is_self_loop(self, subscription: SubscriptionObject) -> bool:
        """Whether the node takes its own message, or on /tf the listener in its process does."""
        publisher = self.publisher
        if publisher.process is not subscription.process:
            return False
        listens = subscription.node.startswith("/transform_listener_impl")
        is_transform = publisher.topic in {"/tf", "/tf_static"}
        return publisher.node == subscription.node or (is_transform and listens)

    def is_copy_for(self, subscription: SubscriptionObject) -> bool:
        """Whether the subscription gets it through a buffer in the process as well."""
        return (
            self.intra is not None
            and subscription.intra is not None
            and subscription.process is self.publisher.process
        )


def _origins(instance: CallbackInstance, topic: str) -> tuple[Origin, ...]:
    """The flows that a message is part of; a timer is no begin where it uses messages."""
    if not instance.causes:
        return tuple((root, (*path, topic)) for root, path in instance.origins)
    inputs = [cause.instance for cause in instance.causes]
    if instance.take_id is not None:
        inputs.insert(0, instance)
    origins = {
        (root.callback_instance_id, path): (root, (*path, topic))
        for each in inputs
        for root, path in each.origins
    }
    return tuple(origins.values())


@dataclass(slots=True)
class IntraProcess:
    """The intra-process side of a publisher: whom it reaches; `kept` for those that come late."""

    targets: list[IntraBuffer]
    kept: RingBuffer | None


@dataclass(slots=True, eq=False)
class PublisherObject:
    """A publisher as it exists in its process.

    Attributes:
        init_handle: the handle that rcl_publisher_init names.
        handle: the handle that rcl_publish names.
        is_rclcpp: publishing passes through rclcpp (not for /rosout).
        is_silent: its release of ROS 2 has no events for this kind of publisher.
        matches: one per subscription of the topic.
        history: what is kept for subscriptions that come late (transient local).
        sent: everything so far, while further subscriptions of the topic are still to come.
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
    description: Publisher
    intra: IntraProcess | None = None
    is_silent: bool = False
    history: deque[Message] | None = None
    sent: list[Message] = field(default_factory=list)


@dataclass(slots=True, eq=False)
class SubscriptionObject:
    """A subscription as it exists in its process, with the queue of its reader; `ended` or not.

    `is_silent`: its release of ROS 2 has no events for this kind of take.
    """

    subscription_id: int
    process: RunningProcess
    executor: Executor
    group: CallbackGroup
    description: Subscription
    node: str
    handle: int
    rmw_handle: int
    callback: int
    message: int
    code: UserCode
    is_rclcpp: bool
    is_internal: bool
    is_sink: bool
    created: int
    queue: deque[Message] = field(default_factory=deque)
    is_silent: bool = False
    addresses: tuple[int, ...] = ()
    intra: IntraBuffer | None = None
    ended: int | None = None

    def is_ready(self, time: int) -> bool:
        """Whether a message is there."""
        return bool(self.queue)


@dataclass(slots=True, eq=False)
class Match:
    """A publisher and a subscription that know each other from `since` on.

    Attributes:
        is_intra: they are in one process and pass messages there.
        missed: what was published before and may still be delivered (transient local).
    """

    subscription: SubscriptionObject
    since: int
    latency: Latency
    is_intra: bool
    loss: float
    missed: list[Message] | None = None
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
    two had discovered each other is not delivered, unless both are transient local.

    Attributes:
        full_queues: how often a message arrived at a queue that held as many as its depth says.
        failed_takes: how often a take found no message.
        undelivered: how many messages were not delivered to a subscription, by reason.
    """

    def __init__(self, world: World, *, overwrites: bool, expected: Counter[str]) -> None:
        """Begin without any objects.

        Args:
            world: where it is.
            overwrites: a full queue drops its oldest message.
            expected: subscriptions that there will be, by topic.
        """
        self._world = world
        self._overwrites = overwrites
        self._expected = expected
        self.full_queues = 0
        self.failed_takes = 0
        self.undelivered: dict[str, int] = {}
        self._publishers: dict[str, list[PublisherObject]] = defaultdict(list)
        self._subscriptions: dict[str, list[SubscriptionObject]] = defaultdict(list)

    def add_publisher(self, publisher: PublisherObject) -> None:
        """A publisher was created: match it with the subscriptions there are."""
        self._publishers[publisher.topic].append(publisher)
        if publisher.description.transient_local:
            publisher.history = deque(maxlen=publisher.description.depth)
        for subscription in self._subscriptions[publisher.topic]:
            self._match(publisher, subscription)

    def add_subscription(self, subscription: SubscriptionObject) -> None:
        """A subscription was created: match it with the publishers there are."""
        topic = subscription.description.topic
        self._subscriptions[topic].append(subscription)
        self._expected[topic] -= 1
        for publisher in self._publishers[topic]:
            self._match(publisher, subscription)

    def end_subscription(self, subscription: SubscriptionObject, time: int) -> None:
        """A subscription is destroyed: what waits for it is lost."""
        subscription.ended = time
        while subscription.queue:
            self.drop(subscription.queue.popleft(), subscription, "subscription_ended")
        if subscription.intra is not None:
            ring = subscription.intra.ring.messages
            while ring:
                self.lose(ring.popleft(), subscription, "subscription_ended")
            for publisher in self._publishers[subscription.description.topic]:
                if publisher.intra is not None and subscription.intra in publisher.intra.targets:
                    publisher.intra.targets.remove(subscription.intra)

    def kept_in(self, process: RunningProcess, topic: str) -> Iterator[RingBuffer]:
        """What publishers of a process keep for subscriptions in it that come late."""
        for publisher in self._publishers[topic]:
            intra = publisher.intra
            if publisher.process is process and intra is not None and intra.kept is not None:
                yield intra.kept

    def end_process(self, process: RunningProcess, time: int) -> None:
        """All subscriptions of a process end, and nothing is kept by its publishers."""
        for subscriptions in self._subscriptions.values():
            for subscription in subscriptions:
                if subscription.process is process and subscription.ended is None:
                    self.end_subscription(subscription, time)
        for publishers in self._publishers.values():
            for publisher in publishers:
                if publisher.process is process:
                    publisher.history = None

    def send(self, time: int, message: Message) -> None:
        """Send a message at `time` to whom the publisher knows."""
        world, publisher = self._world, message.publisher
        self.remember(message)
        if publisher.history is not None:
            publisher.history.append(message)
        for match in publisher.matches:
            if match.subscription.ended is not None or match.since > time:
                self.miss(message, match, time)
                continue
            if match.loss and world.random() < match.loss:
                self.drop(message, match.subscription, "lost_in_transport")
                continue
            self._deliver(time, message, match)

    def remember(self, message: Message) -> None:
        """Keep a message as long as there are subscriptions to come that have missed it."""
        publisher = message.publisher
        if self._expected[publisher.topic]:
            publisher.sent.append(message)

    def miss(self, message: Message, match: Match, time: int) -> None:
        """A message was published at `time` for somebody who does not listen then."""
        subscription = match.subscription
        if subscription.ended is not None:
            self.drop(message, subscription, "subscription_ended")
        elif match.missed is not None and match.since > time:
            match.missed.append(message)
        else:
            self.drop(message, subscription, _early(message, subscription))

    def arrive(self, time: int, delivery: tuple[SubscriptionObject, Message]) -> None:
        """Put a message into the queue of a subscription and wake the executor."""
        subscription, message = delivery
        if subscription.ended is not None:
            self.drop(message, subscription, "subscription_ended")
            return
        queue = subscription.queue
        if len(queue) >= subscription.description.depth:
            self.full_queues += 1
            if self._overwrites:
                self.drop(queue.popleft(), subscription, "overwritten")
        queue.append(message)
        subscription.executor.wake(time)

    def next_message(self, subscription: SubscriptionObject, time: int) -> Message | None:
        """Take the oldest message that may still be taken at `time`."""
        queue = subscription.queue
        expired = []
        found = None
        while queue and found is None:
            message = queue.popleft()
            lifespan = message.publisher.description.lifespan_ns
            if lifespan is None or time <= message.time + lifespan:
                found = message
            else:
                expired.append(message)
        for message in expired:
            self.drop(message, subscription, "take_failed" if found is None else "expired")
        return found

    def finish(self) -> None:
        """Write down what was on its way or waiting at the end."""
        for subscription, message in self._world.left(self.arrive):
            self.drop(
                message,
                subscription,
                "pending_at_end" if subscription.ended is None else "subscription_ended",
            )
        for subscriptions in self._subscriptions.values():
            for subscription in subscriptions:
                self._write(subscription)
                for message in subscription.queue:
                    self.drop(message, subscription, "pending_at_end")
                if subscription.intra is not None:
                    for message in subscription.intra.ring.messages:
                        self.lose(message, subscription, "pending_at_end")
        for match in self._world.left(self._replay):
            for message in match.missed:
                self.drop(message, match.subscription, "pending_at_end")

    def drop(self, message: Message, target: SubscriptionObject, reason: str) -> None:
        """As `lose`, for what DDS carries: copies of messages in buffers do not count."""
        if not message.is_copy_for(target):
            self.lose(message, target, reason)

    def lose(self, message: Message, target: SubscriptionObject, reason: str) -> None:
        """A message does not reach a subscription."""
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
            target.subscription_id,
        )

    def _write(self, subscription: SubscriptionObject) -> None:
        machine, ended = subscription.process.machine, subscription.ended
        self._world.truth.subscription.add(
            subscription.subscription_id, machine.hostname, subscription.process.pid,
            subscription.node, subscription.description.topic, subscription.handle,
            subscription.rmw_handle, subscription.created + machine.epoch,
            None if ended is None else ended + machine.epoch, subscription.is_internal,
        )  # fmt: skip

    def _deliver(self, time: int, message: Message, match: Match) -> None:
        latency = match.latency
        arrival = time + latency.base + self._world.tail(latency.tail)
        if arrival <= match.last_arrival:
            arrival = match.last_arrival + 1
        match.last_arrival = arrival
        self._world.at(arrival, self.arrive, (match.subscription, message))

    def _match(self, publisher: PublisherObject, subscription: SubscriptionObject) -> None:
        latency = latency_between(publisher.process, subscription.process)
        since = max(publisher.created, subscription.created) + latency.discovery
        since += int(self._world.random() * latency.discovery_spread)
        since += subscription.description.discovery_ns
        buffer, intra = subscription.intra, publisher.intra
        is_intra = (
            buffer is not None and intra is not None and publisher.process is subscription.process
        )
        match = Match(subscription, since, latency, is_intra, subscription.description.loss)
        publisher.matches.append(match)
        if buffer is not None and intra is not None and is_intra and subscription.ended is None:
            intra.targets.append(buffer)
            kept = intra.kept.messages if intra.kept is not None else ()
            for message in publisher.sent:
                if message not in kept:
                    self.lose(message, subscription, "before_subscription")
        keeps = publisher.history is not None and subscription.description.transient_local
        if keeps and subscription.ended is None:
            match.missed = list(publisher.sent)
            self._world.at(since, self._replay, match)
        else:
            for message in publisher.sent:
                self.drop(message, subscription, "before_subscription")
        if not self._expected[publisher.topic]:
            publisher.sent.clear()

    def _replay(self, time: int, match: Match) -> None:
        """The two have discovered each other: deliver what the publisher has kept."""
        missed = match.missed or []
        match.missed = None
        subscription = match.subscription
        for message in missed:
            kept = message.publisher.history
            if subscription.ended is not None:
                self.drop(message, subscription, "subscription_ended")
            elif kept is not None and message in kept:
                self._deliver(time, message, match)
            else:
                self.drop(message, subscription, _early(message, subscription))


def _early(message: Message, subscription: SubscriptionObject) -> str:
    before = message.time < subscription.created
    return "before_subscription" if before else "before_discovery"
