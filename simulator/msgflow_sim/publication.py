"""The publication chain on one thread: rclcpp_publish, rcl_publish, rmw_publish."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow_sim import agnocast
from msgflow_sim.objects import Message
from msgflow_sim.rmw import write, write_to_channels

if TYPE_CHECKING:
    from msgflow_sim.callback_instance import CallbackInstance
    from msgflow_sim.machine import Thread
    from msgflow_sim.objects import PublisherObject
    from msgflow_sim.transport import Middleware


def publish(
    thread: Thread,
    middleware: Middleware,
    publisher: PublisherObject,
    time: int,
    instance: CallbackInstance | None,
    message: Message | None = None,
) -> int:
    """Publish one message from `time` on; returns the time at which the call returns.

    Without `instance` it happens outside any callback. `message` is one that has been published
    to the subscriptions of the process already.
    """
    scheduler = thread.scheduler
    random = publisher.random
    machine = thread.machine
    pace = machine.publish_pace
    tracepoints = machine.tracepoints
    epoch = machine.epoch
    emit = thread.emit
    context = thread.context
    if message is None:
        message = Message(next(scheduler.publication_ids), publisher, thread.tid, instance)

    if publisher.description.is_agnocast:
        end = agnocast.put(thread, middleware, publisher, message, time)
        write_publication(thread, publisher, message, instance)
        middleware.send(time, message)
        return end + 1_000 + int(random() * 2_000)
    if thread.process.is_shut_down(time):
        # rcl refuses the message, so only the event of rclcpp is left.
        if publisher.is_rclcpp and not publisher.is_silent:
            emit(tracepoints.rclcpp_publish, time, context, publisher.handle, publisher.message)
            message.rclcpp_ns = time + epoch
            write_publication(thread, publisher, message, instance)
        return time + 1_000 + int(random() * 2_000)
    if publisher.is_silent:
        message.rmw, message.stamp_ns = time + 600, machine.stamp_ns(time + 500)
        write_publication(thread, publisher, message, instance)
        middleware.send(message.rmw, message)
        return time + 5_000
    rcl = time
    if publisher.is_rclcpp:
        emit(tracepoints.rclcpp_publish, time, context, publisher.handle, publisher.message)
        message.rclcpp_ns = time + epoch
        rcl += int((250 + int(random() * 900)) * pace)
    emit(tracepoints.rcl_publish, rcl, context, publisher.handle, publisher.message)
    size_bytes = publisher.description.size_bytes
    message.rcl_ns = rcl + epoch
    if (channels := publisher.channels(rcl)) is not None:
        message.rmw = rcl
        message.stamps, end = write_to_channels(thread, channels, rcl, random, size_bytes)
        message.stamp_ns = min(message.stamps.values(), default=None)
        write_publication(thread, publisher, message, instance)
        middleware.send(end, message)
        return end + int((3_000 + int(random() * 6_000)) * pace)
    written = write(thread, publisher.rmw_handle, publisher.message, rcl, random, size_bytes)
    rmw, message.stamp_ns = written.rmw, written.stamp_ns
    message.rmw, message.rmw_ns = rmw, rmw + epoch
    written.add_to_truth(thread, message.publication_id)
    write_publication(thread, publisher, message, instance)
    middleware.send(written.end, message)
    return written.end + int((3_000 + int(random() * 6_000)) * pace)


def write_publication(
    thread: Thread,
    publisher: PublisherObject,
    message: Message,
    instance: CallbackInstance | None,
) -> None:
    """Write down a publication and what has caused it."""
    hostname, pid, tid = thread.machine.hostname, thread.process.pid, thread.tid
    truth, topic, is_internal = thread.scheduler.truth, publisher.topic, publisher.is_internal
    truth.publication.add(
        message.publication_id,
        hostname,
        pid,
        tid,
        publisher.node,
        topic,
        publisher.init_handle,
        publisher.rmw_handle,
        message.rclcpp_ns,
        message.rcl_ns,
        message.rmw_ns,
        message.stamp_ns,
        None if instance is None else instance.callback_instance_id,
        is_internal,
        message.intra_ns,
        message.agnocast_ns,
    )
    if instance is None:
        return
    if instance.request_id is not None:
        truth.link_call.add(
            instance.request_id, instance.is_response, message.publication_id, None, None
        )
        return
    truth.causal.add(
        instance.callback_instance_id,
        message.publication_id,
        hostname,
        pid,
        tid,
        _kind(instance),
        instance.start_ns,
        instance.take_id,
        instance.take_rmw_ns,
        topic,
        message.rcl_ns,
        message.rmw_ns,
        is_internal,
        False,
    )
    for polled in instance.polled.values():
        truth.causal.add(
            None,
            message.publication_id,
            hostname,
            pid,
            tid,
            "polled",
            None,
            polled.take_id,
            polled.take_rmw_ns,
            topic,
            message.rcl_ns,
            message.rmw_ns,
            is_internal,
            False,
        )
    for cause in instance.causes:
        used = cause.instance
        truth.causal.add(
            used.callback_instance_id,
            message.publication_id,
            hostname,
            pid,
            used.tid,
            cause.kind,
            used.start_ns,
            used.take_id,
            used.take_rmw_ns,
            topic,
            message.rcl_ns,
            message.rmw_ns,
            is_internal,
            cause.is_reuse,
        )


def _kind(instance: CallbackInstance) -> str:
    """How a publication follows from the message of the instance itself."""
    if instance.callback_instance_id is None:
        return "take_adjacent"
    return "triggered" if instance.is_filtered else "direct"
