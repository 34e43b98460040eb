"""User code in a callback, or instead of one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow_sim.entity import Work
from msgflow_sim.intra_process import publish_intra
from msgflow_sim.kernel import INTERRUPT
from msgflow_sim.machine import settle
from msgflow_sim.publication import publish

if TYPE_CHECKING:
    from msgflow_sim.callback_instance import CallbackInstance
    from msgflow_sim.links import CallbackLinks
    from msgflow_sim.machine import Run, Steps, Thread
    from msgflow_sim.objects import UserCode
    from msgflow_sim.scheduler import Dice
    from msgflow_sim.transport import Middleware

# A callback that only puts a message into a cache.
_KEEPING = Work(1_000, 2_000)


def execute(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    start: int,
    instance: CallbackInstance | None,
) -> Run:
    """Run user code: compute, publish, do, log; returns the time at which it ends."""
    if code.first:
        return _execute_first(thread, middleware, code, start, instance)
    if code.links is not None and instance is not None:
        return _execute_linked(thread, middleware, code, code.links, start, instance)
    return _execute(thread, middleware, code, start, instance)


def _execute_first(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    start: int,
    instance: CallbackInstance | None,
) -> Steps:
    """Run user code that does something before it looks at its message."""
    time = start + 200
    for deed in code.first:
        time = yield thread.hold(time)
        time = yield from deed(thread, middleware, time, instance)
    rest = replace(code, first=())
    return (yield from settle(execute(thread, middleware, rest, time, instance)))


def _execute_linked(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    links: CallbackLinks,
    start: int,
    instance: CallbackInstance,
) -> Run:
    """Run user code that fills or uses caches; it may have to wait for other inputs."""

    def cause(topic: str, time: int) -> CallbackInstance:
        return links.cause(topic, instance, {}, time)

    if links.gates(is_late=False) or links.gates(is_late=True):
        return _fill_and_publish(thread, middleware, code, links, start, instance)
    chosen = replace(code, is_stepwise=code.is_stepwise or bool(code.publishers))
    return _execute(thread, middleware, chosen, start, instance, cause)


def _fill_and_publish(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    links: CallbackLinks,
    start: int,
    instance: CallbackInstance,
) -> Steps:
    """Put a message into caches that fire; what other threads did before that is known then."""
    time = yield thread.hold(start)
    fired = links.fill(instance, is_late=False)
    work = code.work
    if links.gates(is_late=True):
        time = yield thread.hold(time + _duration(code.random, work, start))
        fired |= links.fill(instance, is_late=True)
        work = _KEEPING
    published: Counter[str] = Counter()
    publishers = tuple(
        each
        for each in code.publishers
        if links.may_publish(each.topic, fired)
        for _ in range(links.set_count(each.topic, fired))
    )
    if not publishers and links.is_gated([each.topic for each in code.publishers]):
        work = _KEEPING

    def cause(topic: str, time: int) -> CallbackInstance:
        published[topic] += 1
        return links.cause(topic, instance, fired, time, published[topic] - 1)

    chosen = replace(
        code, work=work, publishers=publishers, is_stepwise=code.is_stepwise or bool(publishers)
    )
    return (yield from settle(_execute(thread, middleware, chosen, time, instance, cause)))


def _execute(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    start: int,
    instance: CallbackInstance | None,
    cause: Callable[[str, int], CallbackInstance] | None = None,
) -> Run:
    work = code.work
    duration = _duration(code.random, work, start)
    before = duration * work.percent_before // 100
    rest = 200 + duration * (100 - work.percent_before) // 100
    if code.is_stepwise or thread.machine.kernel is not None:
        return _step(thread, middleware, code, start + 200, before, rest, instance, cause)
    time = start + 200 + before
    for publisher in code.publishers:
        time = publish(thread, middleware, publisher, time, instance)
    if code.log is not None:
        time = publish(thread, middleware, code.log, time, instance)
    return time + rest


def _duration(random: Dice, work: Work, start: int) -> int:
    duration = work.typical_ns + int(random() * work.spread_ns)
    if work.slow_probability and random() < work.slow_probability:
        duration += int((1 + random()) * work.slow_ns / 2)
    paces = [pace for since, pace in work.paces if since <= start]
    return int(duration * paces[-1]) if paces else duration


def _step(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    start: int,
    before: int,
    rest: int,
    instance: CallbackInstance | None,
    cause: Callable[[str, int], CallbackInstance] | None,
) -> Steps:
    mutex, condition = code.work.mutex, code.work.waits_for
    if mutex or condition:
        # Others may have locked, unlocked or signalled it before that moment.
        start = yield thread.hold(start)
    if mutex:
        start = yield from thread.lock(start, mutex)
    if condition:
        start = yield from thread.wait(start, condition, mutex)
    time = yield from thread.compute(start, before)
    if code.work.sleep_ns:
        time = yield from thread.sleep(time, code.work.sleep_ns)
    if code.work.page_fault_ns:
        time = yield from thread.sleep(time, code.work.page_fault_ns, INTERRUPT)
    for publisher in code.publishers:
        time = yield thread.hold(time)
        # What has ended before it began is known by now, on whatever thread it was.
        caused_by = instance if cause is None else cause(publisher.topic, time)
        if publisher.intra is not None:
            time = yield from publish_intra(thread, middleware, publisher, time, caused_by)
        else:
            time = publish(thread, middleware, publisher, time, caused_by)
    for deed in code.deeds:
        time = yield thread.hold(time)
        time = yield from deed(thread, middleware, time, instance)
    if code.log is not None:
        time = publish(thread, middleware, code.log, time, instance)
    if code.work.signals:
        time = yield thread.hold(time)
        thread.release(time, code.work.signals)
    time = yield from thread.compute(time, rest)
    if mutex:
        thread.release(time, mutex)
    return (yield thread.hold(time))
