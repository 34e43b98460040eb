"""Transport of messages by the middleware: who has discovered whom, and where messages wait."""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Iterator
from typing import TYPE_CHECKING

from msgflow_sim.caret import DataListener
from msgflow_sim.latency import AGNOCAST, AT_ONCE, latency_between
from msgflow_sim.objects import Match
from msgflow_sim.scheduler import tail

if TYPE_CHECKING:
    from msgflow_sim.machine import Machine, RunningProcess
    from msgflow_sim.objects import Message, PublisherObject, RingBuffer, SubscriptionObject
    from msgflow_sim.scheduler import Scheduler


class Middleware:
    """Carries messages from publishers to the queues of the subscriptions that are matched.

    Messages of one publisher arrive in order at each subscription. What was published before the
    two had discovered each other is not delivered, unless both are transient local.

    Attributes:
        full_queues: how often a message arrived at a queue that held as many as its depth says.
        failed_takes: how often a take found no message.
        undelivered: how many messages were not delivered to a subscription, by reason.
    """

    def __init__(self, scheduler: Scheduler, *, overwrites: bool, expected: Counter[str]) -> None:
        """Begin without any objects.

        Args:
            scheduler: plans arrivals, and has the truth.
            overwrites: a full queue drops its oldest message.
            expected: subscriptions that there will be, by topic.
        """
        self._scheduler = scheduler
        self._overwrites = overwrites
        self._expected = expected
        self.full_queues = 0
        self.failed_takes = 0
        self.undelivered: dict[str, int] = {}
        self._numbers: Counter[tuple[Machine, str]] = Counter()
        self._listeners: dict[RunningProcess, DataListener] = {}
        self._publishers: dict[str, list[PublisherObject]] = defaultdict(list)
        self._subscriptions: dict[str, list[SubscriptionObject]] = defaultdict(list)

    def add_publisher(self, publisher: PublisherObject) -> None:
        """A publisher was created: match it with the subscriptions there are."""
        self._publishers[publisher.route].append(publisher)
        if publisher.description.transient_local:
            publisher.history = deque(maxlen=publisher.description.depth)
        for subscription in self._subscriptions[publisher.route]:
            self._match(publisher, subscription)

    def add_subscription(self, subscription: SubscriptionObject) -> None:
        """A subscription was created: match it with the publishers there are."""
        route = subscription.description.route
        self._subscriptions[route].append(subscription)
        self._expected[route] -= 1
        if subscription.description.is_agnocast:
            self.next_number(subscription.process, route)
        for publisher in self._publishers[route]:
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
            for publisher in self._publishers[subscription.description.route]:
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
        for machine, route in [key for key in self._numbers if key[0] is process.machine]:
            users = [each.process for each in self._publishers[route]]
            users += [each.process for each in self._subscriptions[route]]
            if all(user.is_stopped for user in users if user.machine is machine):
                # The topic dies with its last user.
                del self._numbers[machine, route]

    def next_number(self, process: RunningProcess, route: str) -> int:
        """The next number on a topic of Agnocast, which counts on one machine, from 0."""
        self._numbers[process.machine, route] += 1
        return self._numbers[process.machine, route] - 1

    def send(self, time: int, message: Message) -> None:
        """Send a message at `time` to the subscriptions that the publisher knows."""
        publisher = message.publisher
        self.remember(message)
        if publisher.history is not None:
            publisher.history.append(message)
        for match in publisher.matches:
            if match.subscription.ended is not None or match.since > time:
                self.miss(message, match, time)
                continue
            if message.entry_id is None and message.stamp_for(match.subscription) is None:
                # Discovered while it was written to the channels of others.
                self.drop(message, match.subscription, "before_discovery")
                continue
            loss = match.loss if time >= match.subscription.description.loss_from_ns else 0
            if loss and match.random() < loss:
                self.drop(message, match.subscription, "lost_in_transport")
                continue
            self._deliver(time, message, match)

    def remember(self, message: Message) -> None:
        """Keep a message as long as there are subscriptions to come that have missed it."""
        publisher = message.publisher
        if self._expected[publisher.route]:
            publisher.sent.append(message)

    def miss(self, message: Message, match: Match, time: int) -> None:
        """A message was published at `time` for a subscription that does not listen then."""
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
            if self._overwrites or subscription.description.is_agnocast:
                self.drop(queue.popleft(), subscription, "overwritten")
        queue.append(message)
        if subscription.process.machine.kernel is not None:
            subscription.arrivals[message.publication_id] = time
        subscription.executor.arrive(subscription, time)

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
        under_way = [*self._scheduler.left(self.arrive)]
        for listener in self._listeners.values():
            under_way += [*listener.heard, *self._scheduler.left(listener.hear)]
        for subscription, message in under_way:
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
        for match in self._scheduler.left(self._replay):
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
        self._scheduler.truth.undelivered.add(
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
        self._scheduler.truth.subscription.add(
            subscription.subscription_id,
            machine.hostname,
            subscription.process.pid,
            subscription.node,
            subscription.description.topic,
            subscription.handle,
            subscription.rmw_handle,
            subscription.created + machine.epoch,
            None if ended is None else ended + machine.epoch,
            subscription.is_internal,
        )

    def _deliver(self, time: int, message: Message, match: Match) -> None:
        latency = match.latency
        arrival = time + latency.base + tail(match.random, latency.tail)
        if arrival <= match.last_arrival:
            arrival = match.last_arrival + 1
        match.last_arrival = arrival
        process = match.subscription.process
        arrive = self.arrive
        if process.machine.tracepoints.ros2_caret_on_data_available.pack is not None:
            if process not in self._listeners:
                self._listeners[process] = DataListener(process, self.arrive)
            arrive = self._listeners[process].hear
        self._scheduler.at(arrival, arrive, (match.subscription, message))

    def _match(self, publisher: PublisherObject, subscription: SubscriptionObject) -> None:
        latency = latency_between(publisher.process, subscription.process)
        if publisher.description.is_agnocast:
            if publisher.process.machine is not subscription.process.machine:
                return
            latency = AGNOCAST
        elif subscription.executor.is_in_order and publisher.process is subscription.process:
            latency = AT_ONCE
        ends = (publisher.name, subscription.name)
        random = self._scheduler.dice("match", *ends)
        since = max(publisher.created, subscription.created) + latency.discovery
        since += int(random() * latency.discovery_spread)
        since += subscription.description.discovery_ns
        buffer, intra = subscription.intra, publisher.intra
        is_intra = (
            buffer is not None and intra is not None and publisher.process is subscription.process
        )
        random = self._scheduler.dice("delay", *ends)
        loss = subscription.description.loss
        match = Match(subscription, since, latency, is_intra, loss, random)
        publisher.matches.append(match)
        if buffer is not None and intra is not None and is_intra and subscription.ended is None:
            intra.targets.append(buffer)
            kept = intra.kept.messages if intra.kept is not None else ()
            for message in publisher.sent:
                if message not in kept:
                    self.lose(message, subscription, _early(message, subscription))
        keeps = publisher.history is not None and subscription.description.transient_local
        if keeps and subscription.ended is None:
            match.missed = list(publisher.sent)
            self._scheduler.at(since, self._replay, match)
        else:
            for message in publisher.sent:
                self.drop(message, subscription, _early(message, subscription))
        if not self._expected[publisher.route]:
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
            elif kept is not None and message in _wanted(kept, subscription):
                self._deliver(time, message, match)
            else:
                self.drop(message, subscription, _early(message, subscription))


def _wanted(kept: deque[Message], subscription: SubscriptionObject) -> list[Message]:
    """What is kept for a subscription; Agnocast keeps no more than it wants."""
    messages = list(kept)
    return (
        messages[-subscription.description.depth :]
        if subscription.description.is_agnocast
        else messages
    )


def _early(message: Message, subscription: SubscriptionObject) -> str:
    before = message.time < subscription.created
    return "before_subscription" if before else "before_discovery"
