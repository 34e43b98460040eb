"""Actions of callbacks besides publishing: call, send a goal, spin, poll, change state, record."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from msgflow_sim import agnocast
from msgflow_sim.callback_instance import CallbackInstance
from msgflow_sim.entity import (
    Answer,
    Call,
    Poll,
    Publish,
    Record,
    SendGoal,
    Spin,
    TellTime,
    Transition,
)
from msgflow_sim.publication import publish
from msgflow_sim.services import ClientObject, ServiceObject, answer, call
from msgflow_sim.take import take

if TYPE_CHECKING:
    from msgflow_sim.entity import Action
    from msgflow_sim.executor import Executor
    from msgflow_sim.executor_thread import ExecutorThread
    from msgflow_sim.goals import ActionClientObject
    from msgflow_sim.machine import Steps
    from msgflow_sim.objects import PublisherObject, SubscriptionObject
    from msgflow_sim.transport import Middleware

_LONGEST_WAIT_NS = 1_000_000_000
_TRANSITIONS = {
    "unconfigured": ("configuring", "inactive"),
    "inactive": ("activating", "active"),
    "active": ("deactivating", "inactive"),
}


@dataclass(slots=True)
class Lifecycle:
    """The state machine of a managed node."""

    node: str
    handle: int
    events: PublisherObject
    state: str = "unconfigured"


@dataclass(slots=True)
class NodeObjects:
    """What actions of the callbacks of a node refer to."""

    executors: Sequence[Executor]
    publishers: dict[str, PublisherObject]
    clients: dict[str, ClientObject] = field(default_factory=dict)
    services: dict[str, ServiceObject] = field(default_factory=dict)
    action_clients: dict[str, ActionClientObject] = field(default_factory=dict)
    polled: dict[str, SubscriptionObject] = field(default_factory=dict)
    lifecycle: Lifecycle | None = None


def deeds(actions: Sequence[Action], objects: NodeObjects) -> tuple[Callable[..., Steps], ...]:
    """Actions as `deed(thread, middleware, time, instance)`."""
    return tuple(partial(_DEEDS[type(action)], action, objects) for action in actions)


def _call(
    action: Call,
    objects: NodeObjects,
    thread: ExecutorThread,
    _: Middleware,
    time: int,
    instance: CallbackInstance | None,
) -> Steps:
    client = objects.clients[action.service]
    time = call(thread, client, time, instance)[0]
    if action.spins is None:
        return time
    number = client.sequence_number
    return (
        yield from thread.spin(
            objects.executors[action.spins],
            time,
            time + _LONGEST_WAIT_NS,
            lambda: client.answered >= number,
        )
    )


def _send_goal(
    action: SendGoal,
    objects: NodeObjects,
    thread: ExecutorThread,
    _: Middleware,
    time: int,
    instance: CallbackInstance | None,
) -> Steps:
    return objects.action_clients[action.action].send(thread, time, instance)
    yield  # It takes no step, but is called as one that does.


def _spin(
    action: Spin,
    objects: NodeObjects,
    thread: ExecutorThread,
    _: Middleware,
    time: int,
    __: CallbackInstance | None,
) -> Steps:
    if len(thread.running) > action.depth:
        return time
    return (
        yield from thread.spin(objects.executors[action.executor], time, time + action.duration_ns)
    )


def _poll(
    action: Poll,
    objects: NodeObjects,
    thread: ExecutorThread,
    middleware: Middleware,
    time: int,
    instance: CallbackInstance | None,
) -> Steps:
    subscription = objects.polled[action.topic]
    take_one = agnocast.get if subscription.description.is_agnocast else take
    taken, time = take_one(thread, middleware, subscription, time)
    if taken is not None:
        taken.write(thread, subscription, None)
        if instance is not None:
            instance.polled[action.topic] = CallbackInstance(
                None, None, taken.message.origins, taken.take_id, taken.rmw_ns, thread.tid
            )
    return time + 500
    yield  # It takes no step, but is called as one that does.


def _publish(
    action: Publish,
    objects: NodeObjects,
    thread: ExecutorThread,
    middleware: Middleware,
    time: int,
    instance: CallbackInstance | None,
) -> Steps:
    return publish(thread, middleware, objects.publishers[action.topic], time, instance)
    yield  # It takes no step, but is called as one that does.


def _answer(
    action: Answer,
    objects: NodeObjects,
    thread: ExecutorThread,
    _: Middleware,
    time: int,
    instance: CallbackInstance | None,
) -> Steps:
    return answer(thread, objects.services[action.service], time, instance)
    yield  # It takes no step, but is called as one that does.


def _transition(
    _: Transition,
    objects: NodeObjects,
    thread: ExecutorThread,
    middleware: Middleware,
    time: int,
    instance: CallbackInstance | None,
) -> Steps:
    lifecycle = objects.lifecycle
    assert lifecycle is not None
    machine = thread.machine
    for state in _TRANSITIONS[lifecycle.state]:
        # rcl publishes a transition before it emits the event.
        time = publish(thread, middleware, lifecycle.events, time + 4_000, instance)
        time += int(lifecycle.events.random() * 20_000)
        thread.emit(
            machine.tracepoints.rcl_lifecycle_transition,
            time,
            thread.context,
            lifecycle.handle,
            lifecycle.state,
            state,
        )
        thread.scheduler.truth.lifecycle_transition.add(
            machine.hostname,
            thread.process.pid,
            thread.tid,
            lifecycle.node,
            time + machine.epoch,
            lifecycle.state,
            state,
        )
        lifecycle.state = state
    return time + 1_000
    yield  # It takes no step, but is called as one that does.


def _record(
    _: Record,
    __: NodeObjects,
    thread: ExecutorThread,
    ___: Middleware,
    time: int,
    instance: CallbackInstance | None,
) -> Steps:
    machine, scheduler = thread.machine, thread.scheduler
    number = next(scheduler.user_event_ids)
    values = (number, number / 4, f"frame {number}")
    thread.emit(machine.tracepoints.my_pkg_frame_done, time, thread.context, *values)
    scheduler.truth.user_event.add(
        number,
        machine.hostname,
        thread.process.pid,
        thread.tid,
        "my_pkg:frame_done",
        time + machine.epoch,
        None if instance is None else instance.callback_instance_id,
        *values,
    )
    return time + 300
    yield  # It takes no step, but is called as one that does.


def _tell_time(
    told: TellTime,
    _: NodeObjects,
    thread: ExecutorThread,
    __: Middleware,
    time: int,
    ___: CallbackInstance | None,
) -> Steps:
    stamp = int(time * told.pace)
    thread.emit(thread.machine.tracepoints.ros2_caret_sim_time, time, thread.context, stamp)
    return time + 300
    yield  # It takes no step, but is called as one that does.


_DEEDS: Mapping[type, Callable[..., Steps]] = {
    Call: _call,
    SendGoal: _send_goal,
    Spin: _spin,
    Poll: _poll,
    Publish: _publish,
    Answer: _answer,
    Transition: _transition,
    Record: _record,
    TellTime: _tell_time,
}
