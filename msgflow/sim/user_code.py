"""What user code does in a callback, or instead of one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from msgflow.sim.entity import Work
from msgflow.sim.intra import publish_intra
from msgflow.sim.publish import CallbackInstance, publish

if TYPE_CHECKING:
    from collections.abc import Callable

    from msgflow.sim.links import CallbackLinks
    from msgflow.sim.machine import Run, Steps, Thread
    from msgflow.sim.transport import Middleware, PublisherObject


@dataclass(slots=True)
class UserCode:
    """What a callback does.

    Attributes:
        work: how long it computes.
        publishers: where it publishes, in this order.
        log: the publisher of /rosout, if it logs.
        deeds: what it does then, each `deed(thread, middleware, time, instance)`.
        is_stepwise: other threads must be able to act between its publications.
        is_callback: it runs in a callback that is traced.
        links: what it has to do with caches of its node.
    """

    work: Work
    publishers: tuple[PublisherObject, ...]
    log: PublisherObject | None
    deeds: tuple[Callable[..., Steps], ...] = ()
    is_stepwise: bool = False
    is_callback: bool = True
    links: CallbackLinks | None = None


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
    if code.links is not None and instance is not None:
        return _execute_linked(thread, middleware, code, code.links, start, instance)
    return _execute(thread, middleware, code, start, instance)


def _execute_linked(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    links: CallbackLinks,
    start: int,
    instance: CallbackInstance,
) -> Run:
    """Run user code that fills or uses caches; it may have to wait for other inputs."""
    fired = links.begin(instance)
    publishers = tuple(each for each in code.publishers if links.may_publish(each.topic, fired))
    is_keeping = not publishers and links.is_gated([each.topic for each in code.publishers])
    chosen = replace(
        code,
        work=_KEEPING if is_keeping else code.work,
        publishers=publishers,
        is_stepwise=code.is_stepwise or bool(publishers),
    )

    def cause(topic: str) -> CallbackInstance:
        return links.cause(topic, instance, fired)

    return _execute(thread, middleware, chosen, start, instance, cause)


def _execute(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    start: int,
    instance: CallbackInstance | None,
    cause: Callable[[str], CallbackInstance] | None = None,
) -> Run:
    random = thread.world.random
    work = code.work
    duration = work.typical_ns + int(random() * work.spread_ns)
    if work.slow_probability and random() < work.slow_probability:
        duration += int((1 + random()) * work.slow_ns / 2)
    time = start + 200 + duration * work.percent_before // 100
    rest = 200 + duration * (100 - work.percent_before) // 100
    if code.is_stepwise:
        return _step(thread, middleware, code, time, rest, instance, cause)
    for publisher in code.publishers:
        time = publish(thread, middleware, publisher, time, instance)
    if code.log is not None:
        time = publish(thread, middleware, code.log, time, instance)
    return time + rest


def _step(
    thread: Thread,
    middleware: Middleware,
    code: UserCode,
    time: int,
    rest: int,
    instance: CallbackInstance | None,
    cause: Callable[[str], CallbackInstance] | None,
) -> Steps:
    for publisher in code.publishers:
        time = yield thread.hold(time)
        # What has ended before it began is known by now, on whatever thread it was.
        caused_by = instance if cause is None else cause(publisher.topic)
        if publisher.intra is not None:
            time = yield from publish_intra(thread, middleware, publisher, time, caused_by)
        else:
            time = publish(thread, middleware, publisher, time, caused_by)
    for deed in code.deeds:
        time = yield thread.hold(time)
        time = yield from deed(thread, middleware, time, instance)
    if code.log is not None:
        time = publish(thread, middleware, code.log, time, instance)
    return (yield thread.hold(time + rest))
