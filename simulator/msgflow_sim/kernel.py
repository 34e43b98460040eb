"""Kernel of a host that is traced: which thread has which CPU.

Threads compute in steps that others may interrupt. A thread with a more urgent priority takes the
CPU, one with an equal priority after a slice of time. What happened is kept.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from msgflow_sim import system

TIMER, INTERRUPT, SOFTIRQ, THREAD = "timer", "interrupt", "softirq", "thread"
"""What wakes threads: a timer that expires, the interrupt of a disk, what that of the network left
for later, or a thread that gives a mutex away or signals a condition."""

_NETWORK_CPU = 0

# How long threads of equal priority compute in turn.
_SLICE_NS = 3_000_000
# From the waking of a thread until it has a CPU that is free.
_WAKE_UP_NS = 3_000
# A thread that lost its CPU goes to another one only after that; one that lets a more urgent one go
# first asks again after that.
_BALANCE_NS = 4_000
_YIELD_NS = 1_000
# A thread whose next turn begins so soon has not slept in between.
_TURN_NS = 2_000


class Scheduled(Protocol):
    """A thread; see `msgflow_sim.machine.Thread`."""

    tid: int
    cpu: int
    priority: int
    computing: tuple[int, int]
    context: bytes

    @property
    def description(self) -> system.Process:
        """What the scenario says about its process."""

    def go_on(self, time: int) -> None:
        """Plan its next step for `time`."""

    def move(self, cpu: int) -> None:
        """Go on on a CPU."""


@dataclass(frozen=True, slots=True)
class Waking:
    """A thread is woken: when, by what, on which CPU that was, and by which thread."""

    time: int
    kind: str
    cpu: int
    by: Scheduled | None = None


@dataclass(slots=True)
class Run:
    """A thread has a CPU. `waking` ended the sleep before it, if it slept.

    `is_preempted`: at the end it had more to do. `is_uninterruptible`: it waits for the disk then.
    """

    thread: Scheduled
    cpu: int
    start: int
    end: int
    waking: Waking | None = None
    is_preempted: bool = False
    is_uninterruptible: bool = False


@dataclass(slots=True)
class _Semaphore:
    """A binary one: a mutex that is free or not, or a condition that is signalled or not."""

    is_free: bool
    waiting: deque[Scheduled] = field(default_factory=deque)


class Kernel:
    """Gives CPUs to threads."""

    def __init__(self, description: system.KernelTrace, cpu_count: int) -> None:
        self.description = description
        self._free_at = [0] * cpu_count
        self._runs: list[list[Run]] = [[] for _ in self._free_at]
        self._latest: dict[Scheduled, Run] = {}
        self._wakings: dict[Scheduled, Waking] = {}
        self._wanted: dict[Scheduled, int] = {}
        self._semaphores: dict[tuple[int, str], _Semaphore] = {}

    def acquire(self, thread: Scheduled, name: str, *, is_free: bool) -> bool:
        """Have a mutex, which is free at first, or see a condition signalled, which is not.

        Returns whether that is so now; else it is when the thread is woken.
        """
        semaphore = self._semaphore(thread, name, is_free=is_free)
        if not semaphore.is_free:
            semaphore.waiting.append(thread)
            return False
        semaphore.is_free = False
        return True

    def release(self, thread: Scheduled, name: str, time: int) -> None:
        """Give a mutex away, or signal a condition: the next thread that waits is woken."""
        semaphore = self._semaphore(thread, name, is_free=False)
        if not semaphore.waiting:
            semaphore.is_free = True
            return
        next_thread = semaphore.waiting.popleft()
        woken = self.wake(next_thread, time, THREAD, thread)
        assert woken is not None
        next_thread.go_on(woken)

    def _semaphore(self, thread: Scheduled, name: str, *, is_free: bool) -> _Semaphore:
        """That of the process, or where its name begins with a slash, of all processes."""
        pid = 0 if name.startswith("/") else thread.description.pid
        return self._semaphores.setdefault((pid, name), _Semaphore(is_free))

    def wake(
        self, thread: Scheduled, time: int, kind: str, by: Scheduled | None = None
    ) -> int | None:
        """Wake a thread that sleeps at `time`, which may be later than now.

        Returns when it can go on; None if something else wakes it earlier.
        """
        latest = self._latest[thread]
        time = max(time, latest.end + 100)
        known = self._wakings.get(thread)
        if known is not None and known.time <= time:
            return None
        latest.is_uninterruptible = kind is INTERRUPT
        cpu = latest.cpu if by is None else by.cpu
        self._wakings[thread] = Waking(time, kind, _NETWORK_CPU if kind is SOFTIRQ else cpu, by)
        return time + _WAKE_UP_NS

    def take(self, thread: Scheduled, time: int) -> int:
        """Give a CPU to a thread at `time`: 0, or when it may ask again."""
        latest = self._latest.get(thread)
        if latest is not None and not latest.is_preempted and self._has(latest, time):
            if not self._is_wanted(thread, latest.cpu):
                return 0
            latest.is_preempted, latest.end = True, time
            self._free_at[latest.cpu] = time
        self._wanted.setdefault(thread, time)
        later = []
        for cpu in sorted(self._cpus(thread), key=lambda one: one != thread.cpu):
            may = self._may_take(thread, cpu, time)
            if latest is not None and thread not in self._wakings and cpu != latest.cpu:
                may = max(may, latest.end + _BALANCE_NS)
            # Of two that want a CPU now, the more urgent one comes first.
            if self._is_wanted(thread, cpu):
                may = max(may, time + _YIELD_NS)
            if may <= time:
                self._give(thread, cpu, time)
                return 0
            later.append(may)
        return min(later)

    def keep(self, thread: Scheduled, until: int) -> None:
        """Have the CPU until that time."""
        run = self._latest[thread]
        run.end = self._free_at[run.cpu] = until

    def _has(self, run: Run, time: int) -> bool:
        return self._runs[run.cpu][-1] is run and run.end >= time

    def _is_wanted(self, thread: Scheduled, cpu: int) -> bool:
        """Whether a more urgent thread waits for a CPU that a thread could have."""
        return any(
            other.priority < thread.priority and cpu in self._cpus(other) for other in self._wanted
        )

    def _cpus(self, thread: Scheduled) -> Sequence[int]:
        return thread.description.cpus or range(len(self._free_at))

    def _may_take(self, thread: Scheduled, cpu: int, time: int) -> int:
        """From when on a thread can have a CPU, as far as is known at `time`."""
        free_at = self._free_at[cpu]
        if free_at <= time:
            return time
        run = self._runs[cpu][-1]
        since, until = run.thread.computing
        if thread.priority > run.thread.priority or time >= until:
            return free_at
        if thread.priority == run.thread.priority:
            since = max(since, run.start + _SLICE_NS)
        return min(max(since, time), free_at)

    def _give(self, thread: Scheduled, cpu: int, time: int) -> None:
        if self._free_at[cpu] > time:
            lost = self._runs[cpu][-1]
            lost.end, lost.is_preempted = time, True
            lost.thread.go_on(time)
        latest = self._latest.get(thread)
        wanted, waking = self._wanted.pop(thread), self._wakings.pop(thread, None)
        if latest is not None and waking is None and not latest.is_preempted:
            if wanted - latest.end > _TURN_NS:
                woken = wanted if wanted < time else time - _TURN_NS // 2
                waking = Waking(woken, TIMER, latest.cpu)
            else:
                latest.is_preempted = True
        self._free_at[cpu] = time
        runs = self._runs[cpu]
        if latest is not None and runs and latest is runs[-1] and waking is None:
            # Nothing else had the CPU.
            latest.is_preempted, latest.end = False, time
            return
        run = Run(thread, cpu, time, time, waking)
        runs.append(run)
        self._latest[thread] = run
        thread.move(cpu)

    def runs(self, last: int) -> list[list[Run]]:
        """What each CPU ran up to time `last`."""
        return [
            [replace(run, end=min(run.end, last)) for run in of_cpu if run.start < last]
            for of_cpu in self._runs
        ]
