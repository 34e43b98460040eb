"""Messages that stay in their process: ring buffers between publishers and subscriptions.

What threads share is changed exactly at the time of the event that tells of it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from msgflow.sim.publish import CallbackInstance, publish, write_publication
from msgflow.sim.transport import Message, Middleware, PublisherObject, SubscriptionObject

if TYPE_CHECKING:
    from msgflow.sim.executor import CallbackGroup
    from msgflow.sim.machine import Steps, Thread


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
            thread.machine.tracepoints.rclcpp_ring_buffer_enqueue, time, thread.context,
            self.handle, self.write_index, size, int(replaced is not None),
        )  # fmt: skip
        return replaced

    def dequeue(self, thread: Thread, time: int) -> Message:
        """Take out the oldest message."""
        message = self.messages.popleft()
        thread.emit(
            thread.machine.tracepoints.rclcpp_ring_buffer_dequeue, time, thread.context,
            self.handle, self.read_index, len(self.messages),
        )  # fmt: skip
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

    @property
    def group(self) -> CallbackGroup:
        """That of the subscription."""
        return self.subscription.group

    def is_ready(self, time: int) -> bool:
        """Whether a message is in it."""
        return bool(self.ring.messages)


def publish_intra(
    thread: Thread,
    middleware: Middleware,
    publisher: PublisherObject,
    time: int,
    instance: CallbackInstance | None,
) -> Steps:
    """Publish to the subscriptions in the process, then to the others, if there are any."""
    intra = publisher.intra
    assert intra is not None
    world, machine = thread.world, thread.machine
    random = world.random
    thread.emit(
        machine.tracepoints.rclcpp_intra_publish, time, thread.context,
        publisher.handle, publisher.message,
    )  # fmt: skip
    publication_id = next(world.publication_ids)
    message = Message(
        publication_id, publisher, thread.tid, instance,
        intra=time, intra_ns=time + machine.epoch,
    )  # fmt: skip
    for buffer in list(intra.targets):
        time = yield thread.hold(time + 250 + int(random() * 900))
        put(thread, middleware, buffer, message, time)
    if intra.kept is not None:
        time = yield thread.hold(time + 250 + int(random() * 900))
        intra.kept.enqueue(thread, time, message)
    time += 300 + int(random() * 700)
    others = [match for match in publisher.matches if not match.is_intra]
    heard = any(match.since <= time and match.subscription.ended is None for match in others)
    # Whoever comes late gets what is kept by DDS, which therefore always gets the message, too.
    if heard or intra.kept is not None:
        return publish(thread, middleware, publisher, time, instance, message)
    middleware.remember(message)
    for match in others:
        middleware.miss(message, match, time)
    write_publication(thread, publisher, message, instance)
    return time + 500 + int(random() * 1_000)


def put(
    thread: Thread, middleware: Middleware, buffer: IntraBuffer, message: Message, time: int
) -> None:
    """Put a message into the buffer of a subscription and wake its executor."""
    replaced = buffer.ring.enqueue(thread, time, message)
    if replaced is not None:
        middleware.lose(replaced, buffer.subscription, "overwritten")
    buffer.subscription.executor.wake(time)
