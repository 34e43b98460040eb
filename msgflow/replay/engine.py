"""The event loop of a replay: executors look for what is ready, callbacks run and publish.

The simulator's engine is another one: it draws what happens, passes every layer, and writes events
of a trace. Here nothing is drawn: each run of a callback repeats a recorded one.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable
from heapq import heappop, heappush
from itertools import count
from typing import Any

from msgflow.replay.system import EVENTS, Callback, Executor, Sent, System

# Where a flow began: which it is and when, with the chain that it has come along.
Origin = tuple[int, int, int | None]
_KEPT = 16
_NEVER = 1 << 62


class _Message:
    """A message in a queue."""

    __slots__ = ("at", "number", "origins", "serial")

    def __init__(self, number: int, at: int, origins: list[Origin], serial: int = 0) -> None:
        self.number = number
        self.at = at
        self.origins = origins
        self.serial = serial


class _Group:
    """Callbacks that exclude each other; `needed`: for so long they do others."""

    __slots__ = ("is_busy", "needed")

    def __init__(self) -> None:
        self.is_busy = False
        self.needed = 0


class _Task:
    """A callback that is replayed: what waits for it."""

    __slots__ = ("callback", "due", "group", "period", "queue")

    def __init__(self, callback: Callback, group: _Group | None) -> None:
        self.callback = callback
        self.group = group
        self.queue: deque[_Message] = deque(maxlen=callback.depth or None)
        self.period = callback.period
        self.due = callback.origin

    def is_ready(self, time: int) -> bool:
        return self.due <= time if self.period is not None else bool(self.queue)

    def is_free(self) -> bool:
        return self.group is None or not self.group.is_busy


class _Spinner:
    """An executor that is replayed: which of its threads look, wait, or stand in line."""

    __slots__ = (
        "arrived",
        "description",
        "is_looking",
        "line",
        "needed",
        "ready",
        "since",
        "sleeps",
        "tasks",
        "timers",
        "wake_at",
    )

    def __init__(self, description: Executor) -> None:
        self.description = description
        self.tasks: list[_Task] = []
        self.timers: list[_Task] = []
        self.ready: list[_Task] = []
        self.arrived: deque[tuple[int, _Task]] = deque()
        self.is_looking = False
        self.line = 0
        self.needed = 0
        self.sleeps = False
        self.since = 0
        self.wake_at: int | None = None


class Replay:
    """One replay of a system; `latencies` has how long the flows of each path took.

    Attributes:
        ran: what ran: callback, when its thread looked for it, begin, end, when its thread was
            free, and the place in `sent` of its message, from 1 (0: it took none).
        sent: what was published: the publication that it repeats, when, and the place in `ran` of
            what published it, from 1 (0: nothing that is replayed).
    """

    def __init__(self, system: System) -> None:
        self.ran: list[tuple[int, int, int, int, int, int]] = []
        self.sent: list[tuple[int, int, int]] = []
        self._system = system
        self._agenda: list[tuple[int, int, Callable[..., None], tuple[Any, ...]]] = []
        self._order = count()
        self._roots = count()
        self._first: dict[tuple[int, int], int] = {}
        self._spinners = {key: _Spinner(each) for key, each in system.executors.items()}
        groups: dict[object, _Group] = defaultdict(_Group)
        self._tasks = {
            key: _Task(each, None if each.group is None else groups[each.executor, each.group])
            for key, each in system.callbacks.items()
        }
        for task in self._tasks.values():
            spinner = self._spinners[task.callback.executor]
            spinner.tasks.append(task)
            if task.period is not None:
                spinner.timers.append(task)
        for spinner in self._spinners.values():
            spinner.tasks.sort(key=lambda task: task.callback.rank)
        self._inputs: dict[int, list[int]] = defaultdict(list)
        self._makes: dict[int, list[int]] = defaultdict(list)
        self._kept: list[dict[int, deque[tuple[int, list[Origin]]]]] = []
        self._waiting: list[dict[int, list[Origin]]] = []
        for number, link in enumerate(system.links):
            self._kept.append({key: deque(maxlen=_KEPT) for key in link.inputs})
            self._waiting.append({})
            for key in link.inputs:
                self._inputs[key].append(number)
            for key in link.outputs:
                self._makes[key].append(number)

    def latencies(self) -> dict[int, list[int]]:
        """Let everything happen, and return by path how long its flows took."""
        for spinner in self._spinners.values():
            for _ in range(spinner.description.threads):
                self._at(spinner.description.start, self._look, spinner)
        for time, sent in self._system.outside:
            self._at(time, self._publish_outside, sent)
        for task in self._tasks.values():
            if task.period is None and task.callback.subscription is None:
                for key, each in task.callback.instances.items():
                    self._at(each.at, self._arrive, task, _Message(key, each.at, []))
        agenda, end = self._agenda, self._system.end
        while agenda and agenda[0][0] <= end:
            time, _, action, arguments = heappop(agenda)
            action(time, *arguments)
        taken: dict[int, list[int]] = defaultdict(list)
        for (path, _), latency in self._first.items():
            taken[path].append(latency)
        return taken

    def loads(self) -> dict[int, float]:
        """Return by executor what share of the time of its threads its callbacks needed.

        One group may need all the time of one thread.
        """
        loads = {}
        for key, spinner in self._spinners.items():
            description = spinner.description
            needed = [spinner.needed / description.threads]
            needed += [task.group.needed for task in spinner.tasks if task.group is not None]
            loads[key] = max(needed) / max(1, self._system.end - description.start)
        return loads

    def _at(self, time: int, action: Callable[..., None], *arguments: Any) -> None:
        heappush(self._agenda, (time, next(self._order), action, arguments))

    def _look(self, time: int, spinner: _Spinner) -> None:
        """A thread wants to look for work: one at a time does."""
        if spinner.is_looking:
            spinner.line += 1
            return
        spinner.is_looking = True
        task = self._pick(spinner, time)
        if task is not None:
            self._release(time, spinner)
            self._begin(time, spinner, task)
            return
        spinner.sleeps = True
        spinner.since = time + spinner.description.falling
        spinner.wake_at = None
        if spinner.arrived or any(task.queue and task.is_free() for task in spinner.tasks):
            self._wake(spinner.since, spinner, None)
        for task in spinner.timers:
            if task.is_free():
                known = task.callback.instances.get(_turn(task))
                self._wake(task.due, spinner, None if known is None else known.waking)

    def _wake(self, time: int, spinner: _Spinner, waking: int | None) -> None:
        """Something is there: a wait ends soon, if there is one."""
        if not spinner.sleeps:
            return
        description = spinner.description
        at = time + (description.waking if waking is None else waking)
        if time <= spinner.since:
            # It was there before: the thread does not fall asleep.
            at = spinner.since + description.polling
        if spinner.wake_at is None or at < spinner.wake_at:
            spinner.wake_at = at
            self._at(at, self._go_on, spinner)

    def _go_on(self, time: int, spinner: _Spinner) -> None:
        """A wait is over: what is ready now is served before the next one."""
        if not spinner.sleeps or spinner.wake_at != time:
            return
        spinner.sleeps = False
        spinner.ready = [task for task in spinner.tasks if task.is_ready(time)]
        task = self._pick(spinner, time)
        self._release(time, spinner)
        if task is None:
            self._at(time + spinner.description.falling, self._look, spinner)
        else:
            self._begin(time, spinner, task)

    def _pick(self, spinner: _Spinner, time: int) -> _Task | None:
        if spinner.description.kind == EVENTS:
            timer = min(spinner.timers, key=lambda task: task.due, default=None)
            came = spinner.arrived[0][0] if spinner.arrived else time + 1
            if timer is not None and timer.due <= min(time, came):
                return timer
            return spinner.arrived.popleft()[1] if came <= time else None
        description, busy = spinner.description, []
        found = None
        while spinner.ready and found is None:
            task = spinner.ready.pop(0)
            if task.is_free():
                found = task
            elif not description.forgets or (task.period is not None and not description.is_python):
                busy.append(task)
        spinner.ready[:0] = busy
        return found

    def _release(self, time: int, spinner: _Spinner) -> None:
        spinner.is_looking = False
        if spinner.line:
            spinner.line -= 1
            self._at(time, self._look, spinner)

    def _begin(self, time: int, spinner: _Spinner, task: _Task) -> None:
        """A thread has chosen a callback, which then begins."""
        if task.group is not None:
            task.group.is_busy = True
        key, at = 0, time
        if task.period is not None:
            key, at = _turn(task), task.due
            task.due += task.period
            if task.due < time:
                task.due += (1 + (time - task.due - 1) // task.period) * task.period
            if task.due > task.callback.until:
                # Its process ended, or the recording.
                task.due = _NEVER
        elif task.queue:
            # The rest of what its run is like depends on the message that it takes.
            key, at = task.queue[0].number, task.queue[0].at
        known = task.callback.instances.get(key) or task.callback.like(at, None, frozenset())
        self._at(time + (0 if known is None else known.before), self._run, spinner, task, key, at)

    def _run(self, time: int, spinner: _Spinner, task: _Task, key: int, at: int) -> None:
        """A callback begins: it takes its message, publishes, and ends."""
        callback = task.callback
        origins: list[Origin] = []
        serial = 0
        if task.period is None:
            if not task.queue:
                self._end(time, spinner, task)
                return
            message = task.queue.popleft()
            key, at, origins = message.number, message.at, message.origins
            serial = message.serial
        gathered, fires, outputs = self._fill(callback.subscription, origins)
        instance = callback.instances.get(key)
        is_own = instance is not None and (
            fires is None or fires == any(each.publisher in outputs for each in instance.sent)
        )
        if not is_own:
            instance = callback.like(at, fires, outputs) or instance
        if instance is None:
            self._end(time, spinner, task)
            return
        end = time + int(instance.duration * callback.factor)
        looked, free = time - instance.before, end + instance.after
        spinner.needed += free - looked
        if task.group is not None:
            task.group.needed += free - looked
        self.ran.append((callback.number, looked, time, end, free, serial))
        place = len(self.ran)
        root: list[Origin] | None = None
        for sent in instance.sent:
            made = list(origins)
            for number in self._makes.get(sent.publisher, ()):
                if self._system.links[number].kind == "partial_sync":
                    made += gathered.get(number, ())
                else:
                    made += self._newest(number, callback.subscription, time)
            if not made and callback.subscription is None:
                root = root or [(next(self._roots), time, None)]
                made = root
            at = time + int(sent.offset * callback.factor)
            self._send(at, sent, made, is_own, place)
        self._arrived(end, origins)
        for number in self._inputs.get(callback.subscription or 0, ()):
            self._kept[number][callback.subscription or 0].append((end, origins))
        if callback.awaited:
            # Its thread is free before; what its group excludes is not.
            free = end - int((end - time) * callback.awaited)
            self._at(free + instance.after, self._look, spinner)
            self._at(end, self._leave, spinner, task)
        else:
            self._at(end + instance.after, self._end, spinner, task)

    def _fill(
        self, subscription: int | None, origins: list[Origin]
    ) -> tuple[dict[int, list[Origin]], bool | None, frozenset[int]]:
        """Keep a message for links that wait for all inputs.

        Returns for each that is complete what the others had, whether one is (None: it is an input
        of none), and the publishers of these links.
        """
        gathered: dict[int, list[Origin]] = {}
        fires: bool | None = None
        outputs: frozenset[int] = frozenset()
        for number in self._inputs.get(subscription or 0, ()):
            link = self._system.links[number]
            if link.kind != "partial_sync":
                continue
            waiting = self._waiting[number]
            waiting[subscription or 0] = origins
            fires, outputs = bool(fires), outputs | link.outputs
            if len(waiting) == len(link.inputs):
                fires = True
                gathered[number] = [
                    each for key, kept in waiting.items() if key != subscription for each in kept
                ]
                waiting.clear()
        return gathered, fires, outputs

    def _newest(self, number: int, subscription: int | None, time: int) -> list[Origin]:
        """What the caches of a link have at a time."""
        made: list[Origin] = []
        for key, kept in self._kept[number].items():
            ended = [each for each in kept if each[0] <= time]
            if ended and key != subscription:
                made += max(ended, key=lambda each: each[0])[1]
        return made

    def _arrived(self, end: int, origins: list[Origin]) -> None:
        """Flows that end with a callback are over."""
        for root, begin, chain in origins:
            path = self._system.paths.get(chain or 0)
            if path is not None:
                latency = end - begin
                known = self._first.get((path, root))
                if known is None or latency < known:
                    self._first[path, root] = latency

    def _end(self, time: int, spinner: _Spinner, task: _Task) -> None:
        """A thread is done with a callback."""
        self._leave(time, spinner, task)
        self._look(time, spinner)

    def _leave(self, time: int, spinner: _Spinner, task: _Task) -> None:
        """Others of the group of a callback may run."""
        if task.group is not None:
            task.group.is_busy = False
            self._wake(time, spinner, None)

    def _publish_outside(self, time: int, sent: Sent) -> None:
        self._send(time, sent, [(next(self._roots), time, None)], is_own=True, ran=0)

    def _send(self, time: int, sent: Sent, origins: list[Origin], is_own: bool, ran: int) -> None:
        """A message is under way to all that get it."""
        self.sent.append((sent.number, time, ran))
        serial = len(self.sent)
        steps = self._system.steps
        for key, delay in sent.delays.items():
            task = self._tasks.get(key)
            if task is None:
                continue
            subscription = task.callback.subscription or 0
            if sent.publisher < 0:
                # A request or response, which is a step of no chain.
                led = dict.fromkeys(origins)
            else:
                led = {
                    (root, begin, step): None
                    for root, begin, chain in origins
                    if (step := steps.get((chain, sent.publisher, subscription))) is not None
                }
            message = _Message(sent.number if is_own else 0, time, list(led), serial)
            self._at(time + delay, self._arrive, task, message)

    def _arrive(self, time: int, task: _Task, message: _Message) -> None:
        spinner = self._spinners[task.callback.executor]
        is_full = len(task.queue) == task.queue.maxlen
        task.queue.append(message)
        if spinner.description.kind == EVENTS and not is_full:
            spinner.arrived.append((time, task))
        if task.is_free():
            self._wake(time, spinner, None)


def _turn(task: _Task) -> int:
    """How often a timer was due before, if it is as it was; else -1."""
    callback = task.callback
    if callback.period is None or callback.is_retimed:
        return -1
    return round((task.due - callback.origin) / callback.period)
