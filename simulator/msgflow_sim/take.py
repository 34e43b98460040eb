"""Takes: the layers that hand a message over to a subscription, and the truth about it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow_sim.rmw import read

if TYPE_CHECKING:
    from msgflow_sim.machine import Thread
    from msgflow_sim.objects import Message, SubscriptionObject
    from msgflow_sim.scheduler import Dice
    from msgflow_sim.transport import Middleware


@dataclass(slots=True)
class Taken:
    """A message that has been taken.

    Attributes:
        take_id: of the truth.
        message: what was taken.
        time: when it was (rmw_take or dequeue, or when it would have been emitted).
        rmw_ns: time of its event, None without one; likewise `rcl_ns`, `rclcpp_ns`,
            `dequeue_ns`, `agnocast_ns`.
        is_copy: the same message comes through an intra-process buffer; this one is ignored.
        is_replay: kept by the publisher from before the subscription was there.
    """

    take_id: int
    message: Message
    time: int
    method: str
    rmw_ns: int | None
    rcl_ns: int | None = None
    rclcpp_ns: int | None = None
    dequeue_ns: int | None = None
    agnocast_ns: int | None = None
    is_copy: bool = False
    is_replay: bool = False

    def write(
        self, thread: Thread, subscription: SubscriptionObject, instance_id: int | None
    ) -> None:
        """Write down the take and its link."""
        machine, message = thread.machine, self.message
        hostname, pid, tid = machine.hostname, thread.process.pid, thread.tid
        publisher, truth = message.publisher, thread.scheduler.truth
        is_internal = subscription.is_internal
        stamp_ns = None if self.method == "ring_buffer" else message.stamp_for(subscription)
        truth.take.add(
            self.take_id,
            hostname,
            pid,
            tid,
            subscription.node,
            publisher.topic,
            subscription.handle,
            self.rmw_ns,
            self.rcl_ns,
            self.rclcpp_ns,
            stamp_ns,
            message.publication_id,
            instance_id,
            is_internal,
            self.method,
            self.dequeue_ns,
            subscription.subscription_id,
            self.agnocast_ns,
        )
        arrived = subscription.arrivals.pop(message.publication_id, None)
        if arrived is not None:
            truth.arrival.add(self.take_id, arrived + machine.epoch)
        since = message.intra if self.method == "ring_buffer" else message.rmw
        assert since is not None
        truth.transport.add(
            message.publication_id,
            self.take_id,
            publisher.topic,
            publisher.process.machine.hostname,
            publisher.process.pid,
            message.tid,
            message.rclcpp_ns,
            message.rcl_ns,
            message.rmw_ns,
            stamp_ns,
            hostname,
            pid,
            tid,
            self.rmw_ns,
            self.rcl_ns,
            self.rclcpp_ns,
            self.time - since,
            is_internal,
            self.method,
            message.intra_ns,
            self.dequeue_ns,
            self.is_replay,
            message.is_self_loop(subscription),
        )

    def reach_sink(self, thread: Thread, subscription: SubscriptionObject, end: int | None) -> None:
        """Write down the flows that end here, if they began in timers and are no self loops."""
        machine = thread.machine
        if end is None or self.message.is_self_loop(subscription):
            return
        for root, path in self.message.origins:
            thread.scheduler.truth.end_to_end.add(
                root.callback_instance_id,
                root.hostname,
                root.pid,
                root.tid,
                root.start_ns,
                path,
                machine.hostname,
                thread.process.pid,
                thread.tid,
                subscription.node,
                self.take_id,
                self.time + machine.epoch,
                end + machine.epoch,
                end - root.start,
            )


def take(
    thread: Thread, middleware: Middleware, subscription: SubscriptionObject, time: int
) -> tuple[Taken | None, int]:
    """Take the oldest message, and return it with the time of the take's last event.

    The message is None if none can be taken.
    """
    scheduler = thread.scheduler
    epoch, buffer = thread.machine.epoch, subscription.message
    # What fails by chance leaves the numbers of what is taken alone.
    random = subscription.random if subscription.queue else thread.random
    reading = time + 2_000 + int(random() * 8_000)
    message = middleware.next_message(subscription, reading)
    if message is None:
        middleware.failed_takes += 1
        if subscription.is_silent:
            return None, reading
        rmw = read(thread, subscription.rmw_handle, buffer, reading, 0, 0)
        rcl, rclcpp = _pass_layers(thread, subscription, rmw, random)
        return None, rclcpp or rcl
    taken = Taken(
        next(scheduler.take_ids),
        message,
        reading,
        "callback_only",
        None,
        is_copy=message.is_copy_for(subscription),
        is_replay=message.time < subscription.created,
    )
    if subscription.is_silent:
        return taken, reading
    stamp_ns = message.stamp_for(subscription)
    assert stamp_ns is not None
    rmw = read(thread, subscription.rmw_handle, buffer, reading, stamp_ns, 1)
    taken.method, taken.time, taken.rmw_ns = "rmw", rmw, rmw + epoch
    rcl, rclcpp = _pass_layers(thread, subscription, rmw, random)
    taken.rcl_ns = rcl + epoch
    if rclcpp is not None:
        taken.rclcpp_ns = rclcpp + epoch
    return taken, rclcpp or rcl


def _pass_layers(
    thread: Thread, subscription: SubscriptionObject, rmw: int, random: Dice
) -> tuple[int, int | None]:
    """Emit what the layers above rmw emit after its `rmw_take`, also of a take that failed.

    Returns the times of rcl_take and of rclcpp_take.
    """
    tracepoints = thread.machine.tracepoints
    rcl = rmw + 200 + int(random() * 900)
    thread.emit(tracepoints.rcl_take, rcl, thread.context, subscription.message)
    if not subscription.is_rclcpp:
        return rcl, None
    rclcpp = rcl + 150 + int(random() * 600)
    thread.emit(tracepoints.rclcpp_take, rclcpp, thread.context, subscription.message)
    return rcl, rclcpp
