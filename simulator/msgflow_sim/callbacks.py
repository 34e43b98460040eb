"""Callbacks that an executor has chosen: the take, then the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow_sim import agnocast
from msgflow_sim.callback_instance import CallbackInstance, Root
from msgflow_sim.machine import Run, settle
from msgflow_sim.take import Taken, take
from msgflow_sim.user_code import execute

if TYPE_CHECKING:
    from msgflow_sim.machine import Steps, Thread
    from msgflow_sim.objects import IntraBuffer, SubscriptionObject, TimerObject, UserCode
    from msgflow_sim.transport import Middleware

_NEVER = 1 << 62


def run_timer(thread: Thread, middleware: Middleware, timer: TimerObject, time: int) -> Run:
    """Call a timer on a thread that has a CPU; returns the time of callback_end."""
    # As rcl does it: calls that were missed are left out.
    timer.due += timer.period
    if timer.due < time:
        timer.due += (1 + (time - timer.due - 1) // timer.period) * timer.period
    if timer.reset is not None and timer.due >= timer.reset:
        timer.due, timer.reset = timer.reset + timer.period, None
    if timer.periods and timer.due >= timer.periods[0][0]:
        since, timer.period = timer.periods.pop(0)
        timer.due = since + timer.period if timer.period else _NEVER
    start = time + 500 + int(timer.random() * 2_500)
    if timer.code.is_agnocast:
        agnocast.make_timer_callable(thread, timer, start - 400)
    if not timer.code.is_callback:
        return execute(thread, middleware, timer.code, start, None)
    return run_callback(thread, middleware, timer.code, start, timer.callback, timer.node, "timer")


def run_subscription(
    thread: Thread, middleware: Middleware, subscription: SubscriptionObject, time: int
) -> Run:
    """Take one message and run the callback with it; returns the time of callback_end.

    If there is no message, the take fails and nothing else happens. A message that has come
    through an intra-process buffer as well is taken, but is not handed to the callback again.
    """
    code = subscription.code
    take_one = agnocast.get if code.is_agnocast else take
    taken, time = take_one(thread, middleware, subscription, time)
    if taken is None:
        return time
    if taken.is_copy:
        taken.write(thread, subscription, None)
        return time + 300
    start = time + 400 + int(subscription.random() * 1_500)
    if code.is_callback:
        return run_callback(
            thread,
            middleware,
            code,
            start,
            subscription.callback,
            subscription.node,
            "subscription",
            taken,
            subscription,
        )
    taken.write(thread, subscription, None)
    message = taken.message
    cause = CallbackInstance(
        None, None, message.origins, taken.take_id, taken.rmw_ns, thread.tid, taken.time
    )
    return execute(thread, middleware, code, start, cause)


def run_buffer(thread: Thread, middleware: Middleware, buffer: IntraBuffer, time: int) -> Steps:
    """Take one message from a buffer and run the callback with it."""
    random = buffer.random
    time = yield thread.hold(time + 300 + int(random() * 1_500))
    if not buffer.ring.messages:
        # Another thread of the executor was faster.
        return time
    message = buffer.ring.dequeue(thread, time)
    subscription = buffer.subscription
    if buffer.ring.messages:
        subscription.executor.wake(time)
    taken = Taken(
        next(thread.scheduler.take_ids),
        message,
        time,
        "ring_buffer",
        None,
        dequeue_ns=time + thread.machine.epoch,
    )
    taken.is_replay = message.time < subscription.created
    return (
        yield from settle(
            run_callback(
                thread,
                middleware,
                subscription.code,
                time + 400 + int(random() * 1_500),
                buffer.callback,
                subscription.node,
                "subscription",
                taken,
                subscription,
                is_intra=1,
            )
        )
    )


def run_callback(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    start: int,
    callback: int,
    node: str,
    kind: str,
    taken: Taken | None = None,
    subscription: SubscriptionObject | None = None,
    is_intra: int = 0,
    instance_id: int | None = None,
    has_end: bool = True,
) -> Run:
    """Run a callback from `start` on; returns the time of callback_end, recorded if `has_end`."""
    scheduler, machine = thread.scheduler, thread.machine
    if instance_id is None:
        instance_id = next(scheduler.callback_instance_ids)
    hostname, pid, tid = machine.hostname, thread.process.pid, thread.tid
    start_ns = start + machine.epoch
    if taken is None:
        # Flows begin in timers; what the callback of a service publishes is no flow from a timer.
        root = Root(instance_id, hostname, pid, tid, start, start_ns)
        origins = ((root, ()),) if kind == "timer" else ()
        instance = CallbackInstance(
            instance_id,
            start_ns,
            origins,
            None,
            None,
            tid,
            start,
            header_ns=machine.stamp_ns(start),
        )
    else:
        instance = CallbackInstance(
            instance_id,
            start_ns,
            taken.message.origins,
            taken.take_id,
            taken.rmw_ns,
            tid,
            start,
            header_ns=taken.message.header_ns,
        )
    facts = (instance_id, hostname, pid, tid, node, kind, callback, start_ns)
    _begin(thread, code, start, callback, is_intra)
    outcome = execute(thread, middleware, code, start, instance)
    if not isinstance(outcome, int):
        return _in_steps(
            outcome, thread, facts, taken, subscription, is_intra, code, instance, has_end
        )
    if has_end:
        _end(thread, code, outcome, callback)
    if code.links is not None:
        code.links.end(outcome, instance)
    end = outcome if has_end else None
    _write(thread, facts, end, taken, subscription, is_intra, None)
    return outcome


def _begin(thread: Thread, code: UserCode, time: int, callback: int, is_intra: int) -> None:
    tracepoints = thread.machine.tracepoints
    if code.is_agnocast:
        made = agnocast.callable_of(thread)
        thread.emit(tracepoints.agnocast_agnocast_callable_start, time, thread.context, made)
    else:
        thread.emit(tracepoints.callback_start, time, thread.context, callback, is_intra)


def _end(thread: Thread, code: UserCode, time: int, callback: int) -> None:
    tracepoints = thread.machine.tracepoints
    if code.is_agnocast:
        made = agnocast.callable_of(thread)
        thread.emit(tracepoints.agnocast_agnocast_callable_end, time, thread.context, made)
    else:
        thread.emit(tracepoints.callback_end, time, thread.context, callback)


def _in_steps(
    steps: Steps,
    thread: Thread,
    facts: tuple[int, str, int, int, str, str, int, int],
    taken: Taken | None,
    subscription: SubscriptionObject | None,
    is_intra: int,
    code: UserCode,
    instance: CallbackInstance,
    has_end: bool,
) -> Steps:
    """Go through a callback that others can act between, or that may be cut short."""
    instance_id, callback = facts[0], facts[6]
    parent_id = thread.running[-1] if thread.running else None
    thread.running.append(instance_id)
    end: int | None = None
    try:
        end = yield from steps
        if has_end:
            _end(thread, code, end, callback)
        if code.links is not None:
            code.links.end(end, instance)
    finally:
        thread.running.pop()
        recorded = end if has_end else None
        _write(thread, facts, recorded, taken, subscription, is_intra, parent_id)
    return end


def _write(
    thread: Thread,
    facts: tuple[int, str, int, int, str, str, int, int],
    end: int | None,
    taken: Taken | None,
    subscription: SubscriptionObject | None,
    is_intra: int,
    parent_id: int | None,
) -> None:
    """Write down a callback instance and the take that it began with."""
    take_id = None
    if taken is not None and subscription is not None:
        take_id = taken.take_id
        taken.write(thread, subscription, facts[0])
        if subscription.is_sink:
            taken.reach_sink(thread, subscription, end)
    end_ns = None if end is None else end + thread.machine.epoch
    thread.scheduler.truth.callback_instance.add(*facts, end_ns, take_id, bool(is_intra), parent_id)
