"""Executors: what their threads execute, and which thread waits.

In the order of rclcpp: what is ready is decided when a wait ends, timers first, then subscriptions,
then services, clients and intra-process buffers; only when nothing of it may be executed comes the
next wait. One thread at a time looks for something ready or waits; the others are blocked.

An events executor has a queue instead: what arrived first is executed first, and a timer stands
there from when it is due.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from msgflow_sim import system
    from msgflow_sim.scheduler import Scheduler

# Some guard conditions look like data on a subscription, which then is not there.
_FAILED_TAKE = 0.02

_HAVING_EVENTS = frozenset({"single_threaded", "multi_threaded", "nested"})
_WITHOUT_CALLBACKS = frozenset({"wait_set"})


@dataclass(slots=True)
class CallbackGroup:
    """Callbacks that exclude each other, unless it is reentrant; `is_busy` while one runs.

    `handle`: its address, where an event names it.
    """

    is_reentrant: bool = False
    is_busy: bool = False
    handle: int = 0


class Entity(Protocol):
    """Something that an executor executes."""

    @property
    def handle(self) -> int:
        """The handle that rclcpp_executor_execute names."""

    @property
    def group(self) -> CallbackGroup:
        """Its callback group."""

    def is_ready(self, time: int) -> bool:
        """Whether there is something to execute."""


class Timer(Entity, Protocol):
    """One that is ready from a time on; `due` is that time."""

    due: int


class Spinner(Protocol):
    """A thread that spins an executor."""

    def wake(self, time: int) -> None:
        """End its wait: something has arrived at `time`."""

    def go_on(self, time: int) -> None:
        """Plan its next step for `time`."""


class Executor:
    """What the threads of one executor share.

    Attributes:
        timers: of its nodes; likewise `subscriptions` and `waitables` (services, clients, buffers).
        has_events: it emits executor events.
        handle: its address, where an event names it.
        has_callbacks: it calls callbacks, which emit events.
        is_in_order: it is an events executor; `is_agnocast`: one of Agnocast.
        owner: the thread that looks for something ready, or waits; others are blocked meanwhile.
        sleeper: the thread that waits.
        thread_count: threads that spin it.
        timeout_ns: a wait ends after that at the latest; None: it may be for ever.
    """

    def __init__(
        self, scheduler: Scheduler, description: system.Executor, *, is_rclcpp: bool
    ) -> None:
        self.timers: list[Timer] = []
        self.subscriptions: list[Entity] = []
        self.waitables: list[Entity] = []
        self.has_events = is_rclcpp and description.kind in _HAVING_EVENTS
        self.has_callbacks = is_rclcpp and description.kind not in _WITHOUT_CALLBACKS
        self.is_in_order = description.kind == "events"
        self.is_agnocast = description.kind == "agnocast"
        self.handle = 0
        self.owner: Spinner | None = None
        self.sleeper: Spinner | None = None
        self.thread_count = description.thread_count
        self.timeout_ns = description.timeout_ns
        self._waits_busily = description.waits_busily
        self._scheduler = scheduler
        self._ready: deque[Entity] = deque()
        self._arrived: deque[tuple[int, Entity]] = deque()
        self._blocked: deque[Spinner] = deque()

    def wake(self, time: int) -> None:
        """Something has arrived at `time`: end the wait, if there is one."""
        if self.sleeper is not None:
            self.sleeper.wake(time)

    def arrive(self, entity: Entity, time: int) -> None:
        """Something has arrived at `time` for an entity: it waits for that in the queue."""
        if self.is_in_order:
            self._arrived.append((time, entity))
        self.wake(time)

    def block(self, thread: Spinner) -> None:
        """Let a thread wait until it owns the executor."""
        self._blocked.append(thread)

    def release(self, time: int) -> None:
        """The owner has what it wanted: the next thread may look."""
        self.owner = None
        if self._blocked:
            self.owner = self._blocked.popleft()
            self.owner.go_on(time + 1_500 + int(self._scheduler.random() * 4_000))

    def forget(self, entity: Entity) -> None:
        """An entity does not exist any more."""
        for entities in (self.subscriptions, self.waitables, self._ready):
            if entity in entities:
                entities.remove(entity)
        self._arrived = deque(one for one in self._arrived if one[1] is not entity)

    def collect(self, time: int) -> None:
        """A wait is over: see what is ready."""
        ready = self._ready
        ready.clear()
        if self.is_in_order:
            return
        for timer in self.timers:
            if timer.due <= time:
                ready.append(timer)
        for subscription in self.subscriptions:
            if subscription.is_ready(time):
                ready.append(subscription)
        if self.waitables:
            ready.extend(entity for entity in self.waitables if entity.is_ready(time))
        if not ready and self.subscriptions and self._scheduler.random() < _FAILED_TAKE:
            ready.append(self.subscriptions[-1])

    def pick(self, time: int) -> Entity | None:
        """What to execute next; None if there is nothing, or if its groups are busy."""
        if self.is_in_order:
            timer = min(self.timers, key=lambda timer: timer.due, default=None)
            came = self._arrived[0][0] if self._arrived else time + 1
            if timer is not None and timer.due <= min(time, came):
                return timer
            return self._arrived.popleft()[1] if came <= time else None
        for position, entity in enumerate(self._ready):
            if _is_free(entity.group):
                del self._ready[position]
                return entity
        return None

    def next_wake_up(self, asleep: int) -> int | None:
        """When a wait that begins at `asleep` ends at the latest, None if it may be for ever."""
        due: int | None = self._arrived[0][0] if self._arrived else None
        for timer in self.timers:
            if (due is None or timer.due < due) and self._ends_wait(timer.group):
                due = timer.due
        for subscription in self.subscriptions:
            if subscription.is_ready(asleep) and self._ends_wait(subscription.group):
                return asleep
        for entity in self.waitables:
            if entity.is_ready(asleep) and self._ends_wait(entity.group):
                return asleep
        return due

    def _ends_wait(self, group: CallbackGroup) -> bool:
        return self._waits_busily or _is_free(group)


def _is_free(group: CallbackGroup) -> bool:
    return group.is_reentrant or not group.is_busy
