"""The publication chain on one thread: rclcpp_publish, rcl_publish, rmw_publish."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.sim.transport import Message, Middleware, PublisherObject, Root
from msgflow.sim.write import write

if TYPE_CHECKING:
    from msgflow.sim.machine import Thread


@dataclass(slots=True)
class CallbackInstance:
    """A run of a callback that is going on; what it publishes is caused by it."""

    callback_instance_id: int
    start_ns: int
    root: Root | None
    path: tuple[str, ...]
    take_id: int | None
    take_rmw_ns: int | None


def publish(
    thread: Thread,
    middleware: Middleware,
    publisher: PublisherObject,
    time: int,
    instance: CallbackInstance | None,
) -> int:
    """Publish one message from `time` on; returns the time at which the call returns.

    Without `instance` it happens outside any callback.
    """
    world = thread.world
    random = world.random
    machine = thread.machine
    tracepoints = machine.tracepoints
    epoch = machine.epoch
    emit = thread.emit
    context = thread.context

    rclcpp_ns: int | None = None
    rcl = time
    if publisher.is_rclcpp:
        emit(tracepoints.rclcpp_publish, time, context, publisher.handle, publisher.message)
        rclcpp_ns = time + epoch
        rcl += 250 + int(random() * 900)
    emit(tracepoints.rcl_publish, rcl, context, publisher.handle, publisher.message)
    written = write(thread, publisher.rmw_handle, publisher.message, rcl, publisher.size_bytes)
    rmw, stamp_ns = written.rmw, written.stamp_ns
    publication_id = next(world.publication_ids)
    written.add_to_truth(thread, publication_id)
    topic = publisher.topic
    hostname, pid, tid = machine.hostname, thread.process.pid, thread.tid
    rcl_ns, rmw_ns = rcl + epoch, rmw + epoch
    is_internal = publisher.is_internal
    truth = world.truth
    truth.publication.add(
        publication_id, hostname, pid, tid, publisher.node, topic,
        publisher.init_handle, publisher.rmw_handle, rclcpp_ns, rcl_ns, rmw_ns, stamp_ns,
        None if instance is None else instance.callback_instance_id, is_internal,
    )  # fmt: skip
    root: Root | None = None
    path: tuple[str, ...] = ()
    if instance is not None:
        truth.causal.add(
            instance.callback_instance_id, publication_id, hostname, pid, tid, "direct",
            instance.start_ns, instance.take_id, instance.take_rmw_ns, topic,
            rcl_ns, rmw_ns, is_internal,
        )  # fmt: skip
        root, path = instance.root, (*instance.path, topic)
    if publisher.matches:
        message = Message(
            publication_id, publisher, tid, rclcpp_ns, rcl_ns, rmw, rmw_ns, stamp_ns, root, path
        )
        middleware.send(written.end, message)
    return written.end + 3_000 + int(random() * 6_000)
