"""Messages that stay in their process: ring buffers between publishers and subscriptions.

What threads share is changed exactly at the time of the event that tells of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow_sim.objects import Message
from msgflow_sim.publication import publish, write_publication

if TYPE_CHECKING:
    from msgflow_sim.callback_instance import CallbackInstance
    from msgflow_sim.machine import Steps, Thread
    from msgflow_sim.objects import IntraBuffer, PublisherObject
    from msgflow_sim.transport import Middleware


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
    scheduler, machine = thread.scheduler, thread.machine
    random = publisher.random
    thread.emit(
        machine.tracepoints.rclcpp_intra_publish,
        time,
        thread.context,
        publisher.handle,
        publisher.message,
    )
    publication_id = next(scheduler.publication_ids)
    message = Message(
        publication_id,
        publisher,
        thread.tid,
        instance,
        intra=time,
        intra_ns=time + machine.epoch,
    )
    for buffer in list(intra.targets):
        time = yield thread.hold(time + 250 + int(random() * 900))
        put(thread, middleware, buffer, message, time)
    if intra.kept is not None:
        time = yield thread.hold(time + 250 + int(random() * 900))
        intra.kept.enqueue(thread, time, message)
    time += 300 + int(random() * 700)
    others = [match for match in publisher.matches if not match.is_intra]
    heard = any(match.since <= time and match.subscription.ended is None for match in others)
    # DDS keeps messages for subscriptions that come late, so it always gets the message, too.
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
    buffer.subscription.executor.arrive(buffer, time)
