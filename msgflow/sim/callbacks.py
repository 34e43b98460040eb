"""What happens once an executor has chosen: take, callback, and what user code does in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.sim.intra import IntraBuffer, publish_intra
from msgflow.sim.publish import CallbackInstance, publish
from msgflow.sim.take import Taken, take
from msgflow.sim.transport import Root

if TYPE_CHECKING:
    from msgflow.sim.executor import CallbackGroup
    from msgflow.sim.machine import Steps, Thread
    from msgflow.sim.transport import Middleware, SubscriptionObject, UserCode


@dataclass(slots=True, eq=False)
class TimerObject:
    """A timer as it exists in its process; `due` is when it has to be called next."""

    node: str
    handle: int
    callback: int
    period: int
    code: UserCode
    group: CallbackGroup
    due: int

    def is_ready(self, time: int) -> bool:
        """Whether it has to be called."""
        return self.due <= time


def run_timer(thread: Thread, middleware: Middleware, timer: TimerObject, time: int) -> Steps:
    """Call a timer on a thread that has a CPU; returns the time of callback_end."""
    # As rcl does it: calls that were missed are left out.
    timer.due += timer.period
    if timer.due < time:
        timer.due += (1 + (time - timer.due - 1) // timer.period) * timer.period
    start = time + 500 + int(thread.world.random() * 2_500)
    if not timer.code.is_callback:
        return (yield from execute(thread, middleware, timer.code, start, None))
    return (
        yield from run_callback(
            thread, middleware, timer.code, start, timer.callback, timer.node, "timer", None
        )
    )


def run_subscription(
    thread: Thread, middleware: Middleware, subscription: SubscriptionObject, time: int
) -> Steps:
    """Take one message and run the callback with it; returns the time of callback_end.

    If there is no message, the take fails and nothing else happens. A message that has come
    through an intra-process buffer as well is taken, but is not handed to the callback again.
    """
    code = subscription.code
    taken, time = take(thread, middleware, subscription, time)
    if taken is None:
        return time
    if taken.is_copy:
        taken.write(thread, subscription, None)
        return time + 300
    start = time + 400 + int(thread.world.random() * 1_500)
    if not code.is_callback:
        taken.write(thread, subscription, None)
        cause = CallbackInstance(
            None, None, taken.message.root, taken.message.path, taken.take_id, taken.rmw_ns
        )
        return (yield from execute(thread, middleware, code, start, cause))
    return (
        yield from run_callback(
            thread, middleware, code, start, subscription.callback, subscription.node,
            "subscription", taken, subscription,
        )
    )  # fmt: skip


def run_buffer(thread: Thread, middleware: Middleware, buffer: IntraBuffer, time: int) -> Steps:
    """Take one message from a buffer and run the callback with it."""
    random = thread.world.random
    time = yield thread.hold(time + 300 + int(random() * 1_500))
    if not buffer.ring.messages:
        # Another thread of the executor was faster.
        return time
    message = buffer.ring.dequeue(thread, time)
    subscription = buffer.subscription
    if buffer.ring.messages:
        subscription.executor.wake(time)
    taken = Taken(
        next(thread.world.take_ids), message, time, "ring_buffer", None,
        dequeue_ns=time + thread.machine.epoch,
    )  # fmt: skip
    taken.is_replay = message.time < subscription.created
    return (
        yield from run_callback(
            thread, middleware, subscription.code, time + 400 + int(random() * 1_500),
            buffer.callback, subscription.node, "subscription", taken, subscription, is_intra=1,
        )
    )  # fmt: skip


def run_callback(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    start: int,
    callback: int,
    node: str,
    kind: str,
    taken: Taken | None,
    subscription: SubscriptionObject | None = None,
    is_intra: int = 0,
    instance_id: int | None = None,
) -> Steps:
    """Run a callback from `start` on; returns the time of callback_end."""
    world, machine = thread.world, thread.machine
    hostname, pid, tid, epoch = machine.hostname, thread.process.pid, thread.tid, machine.epoch
    truth = world.truth
    if instance_id is None:
        instance_id = next(world.callback_instance_ids)
    start_ns = start + epoch
    if taken is None:
        # Flows begin in timers; what the callback of a service publishes is no flow from a timer.
        root = Root(instance_id, hostname, pid, tid, start, start_ns) if kind == "timer" else None
        instance = CallbackInstance(instance_id, start_ns, root, (), None, None)
    else:
        message = taken.message
        instance = CallbackInstance(
            instance_id, start_ns, message.root, message.path, taken.take_id, taken.rmw_ns
        )
    parent_id = thread.running[-1] if thread.running else None
    thread.running.append(instance_id)
    end: int | None = None
    emit = thread.emit
    emit(machine.tracepoints.callback_start, start, thread.context, callback, is_intra)
    try:
        end = yield from execute(thread, middleware, code, start, instance)
        thread.emit(machine.tracepoints.callback_end, end, thread.context, callback)
    finally:
        thread.running.pop()
        end_ns = None if end is None else end + epoch
        if taken is not None and subscription is not None:
            taken.write(thread, subscription, instance_id)
        truth.callback_instance.add(
            instance_id, hostname, pid, tid, node, kind, callback, start_ns, end_ns,
            None if taken is None else taken.take_id, bool(is_intra), parent_id,
        )  # fmt: skip
        if taken is not None and subscription is not None and subscription.is_sink:
            taken.reach_sink(thread, subscription, end)
    return end


def execute(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    start: int,
    instance: CallbackInstance | None,
) -> Steps:
    """Run user code: compute, publish, do, log; returns the time at which it ends."""
    random = thread.world.random
    work = code.work
    duration = work.typical_ns + int(random() * work.spread_ns)
    if work.slow_probability and random() < work.slow_probability:
        duration += int((1 + random()) * work.slow_ns / 2)
    time = start + 200 + duration * 4 // 5
    if not code.is_stepwise:
        for publisher in code.publishers:
            time = publish(thread, middleware, publisher, time, instance)
        if code.log is not None:
            time = publish(thread, middleware, code.log, time, instance)
        return time + 200 + duration // 5
    for publisher in code.publishers:
        time = yield thread.hold(time)
        if publisher.intra is not None:
            time = yield from publish_intra(thread, middleware, publisher, time, instance)
        else:
            time = publish(thread, middleware, publisher, time, instance)
    for deed in code.deeds:
        time = yield thread.hold(time)
        time = yield from deed(thread, middleware, time, instance)
    if code.log is not None:
        time = publish(thread, middleware, code.log, time, instance)
    return (yield thread.hold(time + 200 + duration // 5))
