"""Executors: what their threads execute, and which thread waits.

What is ready is decided when a wait ends; only when nothing of it may be executed comes the next
wait. In rclcpp timers are first, then subscriptions, services, clients and intra-process buffers.
Of one kind, the order is that of a map of callback groups by address, and by creation in each;
since Jazzy that of a hash map. rclpy goes node by node through a set. None of these orders is that
of creation, each is another one whenever the process starts. One thread at a time looks for
something ready or waits; the others are blocked.

An events executor has a queue instead: what arrived first is executed first, and a timer stands
there from when it is due.
"""

from __future__ import annotations

from bisect import insort
from collections import deque
from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

if TYPE_CHECKING:
    from msgflow_sim import system
    from msgflow_sim.scheduler import Dice

# Some guard conditions look like data on a subscription, which then is not there.
_FAILED_TAKE = 0.02

_HAVING_EVENTS = frozenset({"single_threaded", "multi_threaded", "nested"})
_RCLCPP = ("timer", "subscription", "service", "client", "waitable")
# Its nodes have no intra-process buffers.
_RCLPY = ("timer", "subscription", "client", "service", "waitable")
_WITHOUT_CALLBACKS = frozenset({"wait_set"})


@dataclass(slots=True)
class CallbackGroup:
    """Callbacks that exclude each other, unless it is reentrant; `is_busy` while one runs.

    Attributes:
        handle: its address, where an event names it.
        place: where it stands among the groups of a process; `node_place` its node among nodes.
    """

    is_reentrant: bool = False
    is_busy: bool = False
    handle: int = 0
    place: float = 0.0
    node_place: float = 0.0


class Entity(Protocol):
    """Something that an executor executes."""

    kind: ClassVar[str]

    @property
    def random(self) -> Dice:
        """Its random numbers."""

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
        random: its random numbers.
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
        self,
        random: Dice,
        description: system.Executor,
        *,
        is_rclcpp: bool,
        is_traced: bool,
        is_hashed: bool,
    ) -> None:
        self.random = random
        self.timers: list[Timer] = []
        self.subscriptions: list[Entity] = []
        self.waitables: list[Entity] = []
        self.has_events = is_traced and description.kind in _HAVING_EVENTS
        self.has_callbacks = is_traced and description.kind not in _WITHOUT_CALLBACKS
        self.is_in_order = description.kind == "events"
        self.is_agnocast = description.kind == "agnocast"
        self.handle = 0
        self.owner: Spinner | None = None
        self.sleeper: Spinner | None = None
        self.thread_count = description.thread_count
        self.timeout_ns = description.timeout_ns
        self._waits_busily = description.waits_busily
        self._is_rclcpp = is_rclcpp
        self._is_hashed = is_hashed
        # All of it, in the order in which it is looked for.
        self._entities: list[tuple[tuple[float, ...], Entity]] = []
        self._ready: deque[Entity] = deque()
        self._arrived: deque[tuple[int, Entity]] = deque()
        self._blocked: deque[Spinner] = deque()

    def add(self, entity: Entity) -> None:
        """Execute something from now on."""
        order = _RCLCPP if self._is_rclcpp else _RCLPY
        kind, group, number = order.index(entity.kind), entity.group, len(self._entities)
        if not self._is_rclcpp:
            place: tuple[float, ...] = (group.node_place, kind, number)
        elif self._is_hashed:
            place = (kind, entity.random(), number)
        else:
            place = (kind, group.place, number)
        insort(self._entities, (place, entity), key=itemgetter(0))
        lists: dict[str, list[Any]] = {"timer": self.timers, "subscription": self.subscriptions}
        lists.get(entity.kind, self.waitables).append(entity)

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
            self.owner.go_on(time + 1_500 + int(self.random() * 4_000))

    def forget(self, entity: Entity) -> None:
        """An entity does not exist any more."""
        for entities in (self.subscriptions, self.waitables, self._ready):
            if entity in entities:
                entities.remove(entity)
        self._arrived = deque(one for one in self._arrived if one[1] is not entity)
        self._entities = [one for one in self._entities if one[1] is not entity]

    def collect(self, time: int) -> None:
        """A wait is over: see what is ready."""
        ready = self._ready
        ready.clear()
        if self.is_in_order:
            return
        ready.extend(entity for _, entity in self._entities if entity.is_ready(time))
        if not ready and self.subscriptions and self.random() < _FAILED_TAKE:
            ready.append(self.subscriptions[-1])

    def pick(self, time: int) -> Entity | None:
        """What to execute next; None if there is nothing, or if its groups are busy."""
        if self.is_in_order:
            timer = min(self.timers, key=lambda timer: timer.due, default=None)
            came = self._arrived[0][0] if self._arrived else time + 1
            if timer is not None and timer.due <= min(time, came):
                return timer
            return self._arrived.popleft()[1] if came <= time else None
        busy = []
        found = None
        while self._ready and found is None:
            entity = self._ready.popleft()
            if _is_free(entity.group):
                found = entity
            elif not self._forgets(entity):
                busy.append(entity)
        self._ready.extendleft(reversed(busy))
        return found

    def _forgets(self, entity: Entity) -> bool:
        """Whether something whose group is busy waits for the next wait, not for its group."""
        return not self._is_rclcpp or (self._is_hashed and entity.kind != "timer")

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
