"""What happens once an executor has chosen: take, callback, and what user code does in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.sim.publish import CallbackInstance, publish
from msgflow.sim.transport import Message, Middleware, PublisherObject, Root, SubscriptionObject
from msgflow.sim.write import read

if TYPE_CHECKING:
    from msgflow.sim.machine import Thread
    from msgflow.sim.system import Work


@dataclass(slots=True)
class TimerObject:
    """A timer as it exists in its process; `due` is when it has to be called next."""

    node: str
    handle: int
    callback: int
    period: int
    work: Work
    publishers: tuple[PublisherObject, ...]
    log: PublisherObject | None
    due: int


def run_timer(thread: Thread, middleware: Middleware, timer: TimerObject, time: int) -> int:
    """Call a timer on a thread that has a CPU; returns the time of callback_end."""
    # As rcl does it: calls that were missed are left out.
    timer.due += timer.period
    if timer.due < time:
        timer.due += (1 + (time - timer.due - 1) // timer.period) * timer.period
    world, machine = thread.world, thread.machine
    hostname, pid, tid, epoch = machine.hostname, thread.process.pid, thread.tid, machine.epoch
    start = time + 500 + int(world.random() * 2_500)
    start_ns = start + epoch
    instance_id = next(world.callback_instance_ids)
    root = Root(instance_id, hostname, pid, tid, start, start_ns)
    instance = CallbackInstance(instance_id, start_ns, root, (), None, None)
    end = _call(
        thread, middleware, timer.callback, start, instance,
        timer.work, timer.publishers, timer.log,
    )  # fmt: skip
    world.truth.callback_instance.add(
        instance_id, hostname, pid, tid, timer.node, "timer",
        timer.callback, start_ns, end + epoch, None,
    )  # fmt: skip
    return end


def run_subscription(
    thread: Thread, middleware: Middleware, subscription: SubscriptionObject, time: int
) -> int:
    """Take one message and run the callback with it; returns the time of callback_end.

    If there is no message, the take fails and nothing else happens.
    """
    random = thread.world.random
    tracepoints = thread.machine.tracepoints
    emit, context = thread.emit, thread.context
    rmw_handle, buffer = subscription.rmw_handle, subscription.message
    reading = time + 2_000 + int(random() * 8_000)
    if not subscription.queue:
        middleware.failed_takes += 1
        return read(thread, rmw_handle, buffer, reading, 0, 0)
    message = subscription.queue.popleft()
    rmw = read(thread, rmw_handle, buffer, reading, message.stamp_ns, 1)
    rcl = rmw + 200 + int(random() * 900)
    emit(tracepoints.rcl_take, rcl, context, buffer)
    rclcpp = rcl + 150 + int(random() * 600)
    emit(tracepoints.rclcpp_take, rclcpp, context, buffer)
    start = rclcpp + 400 + int(random() * 1_500)

    world, machine = thread.world, thread.machine
    hostname, pid, tid, epoch = machine.hostname, thread.process.pid, thread.tid, machine.epoch
    rmw_ns, rcl_ns, rclcpp_ns, start_ns = rmw + epoch, rcl + epoch, rclcpp + epoch, start + epoch
    take_id = next(world.take_ids)
    instance_id = next(world.callback_instance_ids)
    instance = CallbackInstance(instance_id, start_ns, message.root, message.path, take_id, rmw_ns)
    end = _call(
        thread, middleware, subscription.callback, start, instance,
        subscription.description.work, subscription.publishers, subscription.log,
    )  # fmt: skip
    end_ns = end + epoch

    truth, publisher, is_internal = world.truth, message.publisher, subscription.is_internal
    truth.take.add(
        take_id, hostname, pid, tid, subscription.node, publisher.topic,
        subscription.handle, rmw_ns, rcl_ns, rclcpp_ns, message.stamp_ns,
        message.publication_id, instance_id, is_internal,
    )  # fmt: skip
    truth.transport.add(
        message.publication_id, take_id, publisher.topic,
        publisher.process.machine.hostname, publisher.process.pid, message.tid,
        message.rclcpp_ns, message.rcl_ns, message.rmw_ns, message.stamp_ns,
        hostname, pid, tid, rmw_ns, rcl_ns, rclcpp_ns, rmw - message.rmw, is_internal,
    )  # fmt: skip
    truth.callback_instance.add(
        instance_id, hostname, pid, tid, subscription.node, "subscription",
        subscription.callback, start_ns, end_ns, take_id,
    )  # fmt: skip
    if message.root is not None and subscription.is_sink:
        _reach_sink(thread, subscription, message, message.root, take_id, rmw_ns, end)
    return end


def _reach_sink(
    thread: Thread,
    subscription: SubscriptionObject,
    message: Message,
    root: Root,
    take_id: int,
    take_ns: int,
    end: int,
) -> None:
    machine = thread.machine
    thread.world.truth.end_to_end.add(
        root.callback_instance_id, root.hostname, root.pid, root.tid, root.start_ns, message.path,
        machine.hostname, thread.process.pid, thread.tid, subscription.node, take_id, take_ns,
        end + machine.epoch, end - root.start,
    )  # fmt: skip


def _call(
    thread: Thread,
    middleware: Middleware,
    callback: int,
    start: int,
    instance: CallbackInstance,
    work: Work,
    publishers: tuple[PublisherObject, ...],
    log: PublisherObject | None,
) -> int:
    """Run user code: compute, publish, log; returns the time of callback_end."""
    random = thread.world.random
    tracepoints = thread.machine.tracepoints
    thread.emit(tracepoints.callback_start, start, thread.context, callback, 0)
    duration = work.typical_ns + int(random() * work.spread_ns)
    if work.slow_probability and random() < work.slow_probability:
        duration += int((1 + random()) * work.slow_ns / 2)
    time = start + 200 + duration * 4 // 5
    for publisher in publishers:
        time = publish(thread, middleware, publisher, time, instance)
    if log is not None:
        time = publish(thread, middleware, log, time, instance)
    end = time + 200 + duration // 5
    thread.emit(tracepoints.callback_end, end, thread.context, callback)
    return end
