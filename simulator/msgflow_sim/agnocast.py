"""Agnocast: messages through shared memory, which its kernel module numbers.

They pass neither rcl nor DDS, and have events of their own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow_sim.take import Taken

if TYPE_CHECKING:
    from msgflow_sim.machine import Thread
    from msgflow_sim.objects import Message, PublisherObject, SubscriptionObject, TimerObject
    from msgflow_sim.transport import Middleware

# A thread that goes on late with its event, after the kernel has its message.
_LATE = 0.1
_NOTHING = 0


def put(
    thread: Thread, middleware: Middleware, publisher: PublisherObject, message: Message, time: int
) -> int:
    """Publish a message from `time` on; returns when its event is recorded, behind its sending."""
    random = publisher.random
    end = time + 400 + int(random() * 2_000)
    if random() < _LATE:
        end += 40_000 + int(random() * 40_000)
    message.entry_id = middleware.next_number(publisher.process, publisher.route)
    message.rmw, message.agnocast_ns = end, end + thread.machine.epoch
    thread.emit(
        thread.machine.tracepoints.agnocast_agnocast_publish,
        end,
        thread.context,
        publisher.handle,
        publisher.message,
        message.entry_id,
    )
    return end


def get(
    thread: Thread, middleware: Middleware, subscription: SubscriptionObject, time: int
) -> tuple[Taken | None, int]:
    """Take the oldest message for a callback, or for a poll; see `take`."""
    scheduler, machine = thread.scheduler, thread.machine
    reading = time + 500 + int(subscription.random() * 2_000)
    message = middleware.next_message(subscription, reading)
    is_poll = subscription.description.polled
    if message is None:
        if is_poll:
            thread.emit(
                machine.tracepoints.agnocast_agnocast_take,
                reading,
                thread.context,
                subscription.handle,
                _NOTHING,
                _NOTHING,
            )
        return None, reading
    taken = Taken(
        next(scheduler.take_ids),
        message,
        reading,
        "agnocast",
        None,
        agnocast_ns=reading + machine.epoch,
        is_replay=message.time < subscription.created,
    )
    if is_poll:
        thread.emit(
            machine.tracepoints.agnocast_agnocast_take,
            reading,
            thread.context,
            subscription.handle,
            subscription.message,
            message.entry_id,
        )
        return taken, reading
    thread.emit(
        machine.tracepoints.agnocast_agnocast_create_callable,
        reading,
        thread.context,
        callable_of(thread),
        subscription.message,
        message.entry_id,
        subscription.callback,
        subscription.callback,
    )
    # Before 2.2 it was queued, which took longer.
    return taken, reading + (6_000 if machine.layout.is_callable_queued else 0)


def make_timer_callable(thread: Thread, timer: TimerObject, time: int) -> None:
    """A timer is due."""
    thread.emit(
        thread.machine.tracepoints.agnocast_agnocast_create_timer_callable,
        time,
        thread.context,
        callable_of(thread),
        timer.handle,
    )


def callable_of(thread: Thread) -> int:
    """Address of what a thread calls: on its stack, the same each time."""
    return 0x7FE0_0000_0000 + (thread.tid << 16)
