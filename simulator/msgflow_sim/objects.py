"""Objects of running processes: publishers, subscriptions, timers, buffers, and messages.

They refer to each other; what happens to them lies above: `transport`, `publication`, `take`,
`callbacks`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from msgflow_sim.callback_instance import origins_on

if TYPE_CHECKING:
    from msgflow_sim.callback_instance import CallbackInstance, Origin
    from msgflow_sim.entity import Publisher, Subscription, Work
    from msgflow_sim.executor import CallbackGroup, Executor
    from msgflow_sim.latency import Latency
    from msgflow_sim.links import CallbackLinks
    from msgflow_sim.machine import RunningProcess, Steps, Thread
    from msgflow_sim.scheduler import Dice


class Message:
    """One publication, on its way. Names in `_ns` are stamps of the publisher's host.

    Attributes:
        origins: the flows that lead to it, as far as they began in timers.
        header_ns: stamp in its header; None: published in no callback.
        rmw: time of rmw_publish, or of the last event without one; `intra` that of
            rclcpp_intra_publish.
        stamp_ns: its source stamp, the first one if it was written several times.
        entry_id: number that Agnocast gave to it; `agnocast_ns` the time of its event.
        stamps: source stamps by subscription if it was written to channels, else None.
    """

    __slots__ = (
        "agnocast_ns",
        "entry_id",
        "header_ns",
        "intra",
        "intra_ns",
        "origins",
        "publication_id",
        "publisher",
        "rcl_ns",
        "rclcpp_ns",
        "rmw",
        "rmw_ns",
        "stamp_ns",
        "stamps",
        "tid",
    )

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
        self.header_ns: int | None = None
        if instance is not None:
            self.origins = origins_on(instance, publisher.topic)
            self.header_ns = instance.header_ns
        self.intra = intra
        self.intra_ns = intra_ns
        self.rclcpp_ns: int | None = None
        self.rcl_ns: int | None = None
        self.rmw: int | None = None
        self.rmw_ns: int | None = None
        self.stamp_ns: int | None = None
        self.entry_id: int | None = None
        self.agnocast_ns: int | None = None
        self.stamps: Mapping[SubscriptionObject, int] | None = None

    def stamp_for(self, subscription: SubscriptionObject) -> int | None:
        """The source stamp with which a subscription gets it; None if it does not."""
        return self.stamp_ns if self.stamps is None else self.stamps.get(subscription)

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
        random: its random numbers.
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
    random: Dice = field(init=False)

    def __post_init__(self) -> None:
        self.random = self.process.scheduler.dice(self.name, "publisher")

    @property
    def name(self) -> str:
        """What tells it from others."""
        return f"{self.process.name}{self.node}{self.topic}"

    @property
    def route(self) -> str:
        """See `Subscription.route`."""
        return f"agnocast {self.topic}" if self.description.is_agnocast else self.topic

    def channels(self, time: int) -> list[list[SubscriptionObject]] | None:
        """The subscriptions of each channel that a message of `time` is written to, in order.

        None if it is written once for all.
        """
        if not (self.process.machine.layout.has_channels and self.description.is_buffer_aware):
            return None
        known = [
            match.subscription
            for match in self.matches
            if match.since <= time and match.subscription.ended is None
        ]
        if not all(subscription.description.channel for subscription in known):
            return None
        shared = [each for each in known if each.description.channel == "shared"]
        own = [[each] for each in known if each.description.channel == "own"]
        return [shared, *own] if shared else own


@dataclass(slots=True, eq=False)
class SubscriptionObject:
    """A subscription as it exists in its process, with the queue of its reader; `ended` or not.

    `is_silent`: its release of ROS 2 has no events for this kind of take. `arrivals`: when messages
    came, by the number of their publication, where the kernel is traced.
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
    arrivals: dict[int, int] = field(default_factory=dict)
    random: Dice = field(init=False)
    kind: ClassVar[str] = "subscription"

    def __post_init__(self) -> None:
        self.random = self.process.scheduler.dice(self.name, "subscription")

    @property
    def name(self) -> str:
        """What tells it from others, but from others of its node on the topic."""
        return f"{self.process.name}{self.node}{self.description.topic}"

    def is_ready(self, time: int) -> bool:
        """Whether a message is there."""
        return bool(self.queue)


@dataclass(slots=True, eq=False)
class Match:
    """A publisher and a subscription that know each other from `since` on.

    Attributes:
        is_intra: they are in one process and pass messages there.
        missed: what was published before and may still be delivered (transient local).
        random: says how long messages travel, and which get lost.
    """

    subscription: SubscriptionObject
    since: int
    latency: Latency
    is_intra: bool
    loss: float
    random: Dice
    missed: list[Message] | None = None
    last_arrival: int = 0


@dataclass(slots=True)
class RingBuffer:
    """A ring of slots as rclcpp has it; a message that comes when it is full replaces the oldest.

    `write_index` is the slot that was written last, `read_index` the oldest one.
    """

    handle: int
    capacity: int
    messages: deque[Message] = field(default_factory=deque)
    write_index: int = -1
    read_index: int = 0

    def enqueue(self, thread: Thread, time: int, message: Message) -> Message | None:
        """Put in a message; returns the one that it has replaced, if any."""
        self.write_index = (self.write_index + 1) % self.capacity
        replaced = None
        size = len(self.messages) + 1
        if size > self.capacity:
            replaced = self.messages.popleft()
            self.read_index = (self.read_index + 1) % self.capacity
        self.messages.append(message)
        thread.emit(
            thread.machine.tracepoints.rclcpp_ring_buffer_enqueue,
            time,
            thread.context,
            self.handle,
            self.write_index,
            size,
            int(replaced is not None),
        )
        return replaced

    def dequeue(self, thread: Thread, time: int) -> Message:
        """Take out the oldest message."""
        message = self.messages.popleft()
        thread.emit(
            thread.machine.tracepoints.rclcpp_ring_buffer_dequeue,
            time,
            thread.context,
            self.handle,
            self.read_index,
            len(self.messages),
        )
        self.read_index = (self.read_index + 1) % self.capacity
        return message


@dataclass(slots=True, eq=False)
class IntraBuffer:
    """The intra-process side of a subscription: what an executor executes for it."""

    subscription: SubscriptionObject
    ring: RingBuffer
    callback: int
    # No executor event names it.
    handle: int = 0
    kind: ClassVar[str] = "waitable"

    @property
    def group(self) -> CallbackGroup:
        """That of the subscription."""
        return self.subscription.group

    @property
    def random(self) -> Dice:
        """That of the subscription."""
        return self.subscription.random

    def is_ready(self, time: int) -> bool:
        """Whether a message is in it."""
        return bool(self.ring.messages)


@dataclass(slots=True)
class UserCode:
    """What a callback does.

    Attributes:
        work: how long it computes.
        publishers: where it publishes, in this order.
        log: the publisher of /rosout, if it logs.
        random: says how long it computes.
        deeds: what it does then, each `deed(thread, middleware, time, instance)`.
        is_stepwise: other threads must be able to act between its publications.
        is_callback: it runs in a callback that is traced.
        links: what it has to do with caches of its node.
        is_agnocast: a callable of Agnocast runs it.
        first: what it does before anything else, like `deeds`.
    """

    work: Work
    publishers: tuple[PublisherObject, ...]
    log: PublisherObject | None
    random: Dice
    deeds: tuple[Callable[..., Steps], ...] = ()
    is_stepwise: bool = False
    is_callback: bool = True
    links: CallbackLinks | None = None
    first: tuple[Callable[..., Steps], ...] = ()
    is_agnocast: bool = False


@dataclass(slots=True, eq=False)
class TimerObject:
    """A timer as it exists in its process.

    `due` is when it has to be called next, `reset` when user code will reset it, `periods` the
    periods that it will give it.
    """

    node: str
    handle: int
    callback: int
    period: int
    code: UserCode
    group: CallbackGroup
    due: int
    random: Dice
    reset: int | None = None
    periods: list[tuple[int, int]] = field(default_factory=list)
    kind: ClassVar[str] = "timer"

    def is_ready(self, time: int) -> bool:
        """Whether it has to be called."""
        return self.due <= time
