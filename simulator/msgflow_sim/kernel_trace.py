"""Trace of a kernel as lttng-modules or perf writes it, and the truth about what its CPUs ran."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol
from uuid import UUID

from msgflow_sim.ctf import PerfWriter, Tracepoint, TraceWriter, thread_context
from msgflow_sim.events import KERNEL_SIGNATURES, PERF_NAMES, perf_fields
from msgflow_sim.interrupts import interrupts
from msgflow_sim.kernel import INTERRUPT, SOFTIRQ, TIMER
from msgflow_sim.layout import EventType, Layout

if TYPE_CHECKING:
    from msgflow_sim.ctf import TraceIdentity
    from msgflow_sim.host_clock import HostClock
    from msgflow_sim.interrupts import Interrupt
    from msgflow_sim.kernel import Kernel, Run, Scheduled
    from msgflow_sim.truth import Truth

_HANDLER = 0xFFFF_8880_0000_1000
# By what is handled: event and values of its begin and its end.
_HANDLED: dict[str, tuple[tuple[str, tuple[object, ...]], tuple[str, tuple[object, ...]]]] = {
    TIMER: (
        ("timer_hrtimer_expire_entry", (_HANDLER, 0, 0xFFFF_FFFF_8110_0000)),
        ("timer_hrtimer_expire_exit", (_HANDLER,)),
    ),
    INTERRUPT: (("irq_handler_entry", (48, "nvme0q1")), ("irq_handler_exit", (48, 1))),
    SOFTIRQ: (("irq_softirq_entry", (3,)), ("irq_softirq_exit", (3,))),
}
_LAYOUT = Layout(
    "kernel", "", tuple(EventType(name, fields) for name, fields in KERNEL_SIGNATURES.items())
)
# By how much the kernel numbers threads in containers higher than these do.
_CONTAINED = 40_000
_NAMESPACE = 4_026_531_836
_RUNNABLE, _SLEEPING, _UNINTERRUPTIBLE = 0, 1, 2
# How long before its first turn a thread is created.
_CREATION_NS = 3_000


def write_kernel(
    kernel: Kernel,
    directory: Path,
    identity: TraceIdentity,
    clock: HostClock,
    truth: Truth,
    end: int,
    tracer: str,
) -> None:
    """Write the trace and the truth of what was up to time `end`; see `Recording` for `tracer`."""
    runs = kernel.runs(end)
    digest = sha256(f"{identity.uuid}/{tracer}".encode()).digest()
    identity = replace(identity, uuid=UUID(bytes=digest[:16], version=4))
    losses = _Losses(
        [(clock.elapsed(begin), clock.elapsed(to)) for begin, to in kernel.description.losses]
    )
    make = _Perf if tracer == "perf" else _Lttng
    trace: _Trace = make(directory / make.name, identity, len(runs), losses)
    handled = [*interrupts(runs)]
    events = [*_switches(runs, end), *_interruptions(handled)]
    by_thread: dict[Scheduled, list[Run]] = {}
    for run in sorted((run for of_cpu in runs for run in of_cpu), key=attrgetter("start")):
        by_thread.setdefault(run.thread, []).append(run)
    for thread, own in by_thread.items():
        events += _begins(thread, own[0], has_ids=kernel.description.has_ids)
        for before, run in pairwise(own):
            events += _changes(before, run)
    events.sort(key=attrgetter("time", "rank"))
    current: list[Scheduled | None] = [None for _ in runs]
    for event in events:
        trace.emit(event, clock.elapsed(event.time), current[event.cpu])
        if event.name == "sched_switch":
            current[event.cpu] = event.next_thread
    trace.close(clock.elapsed(end))
    _write_truth(truth, identity.hostname, clock, by_thread, runs, end)
    for each in handled:
        truth.interrupt.add(
            identity.hostname, each.cpu, each.kind, each.start + clock, each.end + clock
        )
    for begin, to in kernel.description.losses:
        truth.kernel_loss.add(identity.hostname, begin + clock, to + clock, make.counts_losses)


class _Trace(Protocol):
    """A trace as one of the tracers writes it."""

    def emit(self, event: _Event, time: int, thread: Scheduled | None) -> None:
        """Record an event of a CPU on which a thread runs, or none."""

    def close(self, end: int) -> None:
        """Complete the files."""


class _Lttng:
    """As lttng-modules writes it."""

    name = "kernel"
    counts_losses = True

    def __init__(
        self, directory: Path, identity: TraceIdentity, cpu_count: int, losses: _Losses
    ) -> None:
        identity = replace(identity, buffering=("global", 0, ""))
        self._writer = TraceWriter(directory, _LAYOUT, identity, cpu_count, faults=losses)
        self._tracepoints = {
            name: Tracepoint(name, number, fields, fields)
            for number, (name, fields) in enumerate(KERNEL_SIGNATURES.items())
        }

    def emit(self, event: _Event, time: int, thread: Scheduled | None) -> None:
        """See `_Trace`."""
        context = _idle(event.cpu) if thread is None else thread.context
        tracepoint = self._tracepoints[event.name]
        self._writer.streams[event.cpu].emit(tracepoint, time, context, *event.values)

    def close(self, end: int) -> None:
        """See `_Trace`."""
        self._writer.close(end)


class _Perf:
    """As perf writes it: it knows nothing of containers, and does not tell what it loses."""

    name = "perf"
    counts_losses = False

    def __init__(
        self, directory: Path, identity: TraceIdentity, cpu_count: int, losses: _Losses
    ) -> None:
        declared = {
            name: [
                replace(field, name=field.name.replace("tid", "pid"))
                for field in perf_fields(event)
            ]
            for event, name in PERF_NAMES.items()
        }
        self._writer = PerfWriter(directory, declared, identity, cpu_count)
        self._losses = losses

    def emit(self, event: _Event, time: int, thread: Scheduled | None) -> None:
        """See `_Trace`."""
        if self._losses.is_losing(time):
            return
        ids = (0, 0) if thread is None else (kernel_tid(thread), _kernel_pid(thread))
        names = (field.name for field in KERNEL_SIGNATURES[event.name])
        given = dict(zip(names, event.values, strict=True))
        values = [_as_perf(field.name, given[field.name]) for field in perf_fields(event.name)]
        self._writer.emit(PERF_NAMES[event.name], event.cpu, time, *ids, values)

    def close(self, end: int) -> None:
        """See `_Trace`."""
        self._writer.close()


def _as_perf(field: str, value: Any) -> Any:
    """The value of a field: of priorities, LTTng takes away 100."""
    if isinstance(value, bytes):
        return value.decode()
    return value + 100 if field.endswith("prio") else value


@dataclass(frozen=True, slots=True)
class _Event:
    """An event of the kernel; of several at one time, those of a lower rank come first."""

    time: int
    rank: int
    cpu: int
    name: str
    values: tuple[object, ...]
    next_thread: Scheduled | None = None


class _Losses:
    """Loses what happens at some times, and counts it."""

    def __init__(self, times: Sequence[tuple[int, int]]) -> None:
        self._times = times

    def lost_events(self, cpu: int) -> int:
        """None behind full packets."""
        return 0

    def is_filled(self) -> bool:
        """They are never."""
        return False

    def is_packet_lost(self) -> bool:
        """None is."""
        return False

    def is_losing(self, time: int) -> bool:
        """Whether what happens at `time` is lost."""
        return any(begin <= time < end for begin, end in self._times)

    def emitted(self, cpu: int, time: int, context: bytes) -> None:
        """The truth is of what happened."""

    def unrecorded(
        self, cpu: int, tracepoint: Tracepoint, time: int, context: bytes, cause: str
    ) -> None:
        """Likewise."""

    def missing_packet(self, trace: bytes, cpu: int, since: int, end: int, cause: str) -> None:
        """Likewise."""


def kernel_tid(thread: Scheduled) -> int:
    """What the kernel numbers a thread by."""
    return thread.tid + (_CONTAINED if thread.description.container else 0)


def _kernel_pid(thread: Scheduled) -> int:
    """Likewise for its process."""
    return kernel_tid(thread) - thread.tid + thread.description.pid


def _name(thread: Scheduled) -> bytes:
    return thread.description.name.encode()[:15]


def _priority(thread: Scheduled) -> int:
    """Its priority as LTTng shows it."""
    return thread.priority - 100


def _idle(cpu: int) -> bytes:
    return thread_context(0, 0, f"swapper/{cpu}")


def _switches(runs: Sequence[Sequence[Run]], last: int) -> Iterator[_Event]:
    """What each CPU went from and to, until the last moment; between runs it is idle."""
    for cpu, of_cpu in enumerate(runs):
        idle = (f"swapper/{cpu}".encode(), 0, 20)
        for before, run in pairwise((None, *of_cpu, None)):
            left = (*idle, _RUNNABLE)
            if before is not None:
                state = _UNINTERRUPTIBLE if before.is_uninterruptible else _SLEEPING
                state = _RUNNABLE if before.is_preempted else state
                left = (*_of(before.thread), state)
                if before.end < last and (run is None or run.start > before.end):
                    values = (*left, *idle)
                    yield _Event(before.end, 0, cpu, "sched_switch", values)
                    left = (*idle, _RUNNABLE)
            if run is not None:
                values = (*left, *_of(run.thread))
                yield _Event(run.start, 5, cpu, "sched_switch", values, run.thread)


def _interruptions(handled: Sequence[Interrupt]) -> Iterator[_Event]:
    """The begin and the end of each."""
    for each in handled:
        (begin, first), (end, last) = _HANDLED[each.kind]
        yield _Event(each.start, 1, each.cpu, begin, first)
        yield _Event(each.end, 4, each.cpu, end, last)


def _of(thread: Scheduled) -> tuple[bytes, int, int]:
    """Its name, number and priority, as events of the kernel have them."""
    return _name(thread), kernel_tid(thread), _priority(thread)


def _begins(thread: Scheduled, run: Run, *, has_ids: bool) -> Iterator[_Event]:
    """The creation of a thread, which tells its ids."""
    if has_ids:
        tid = kernel_tid(thread)
        vtids = (tid, thread.tid) if thread.description.container else (tid,)
        values = (b"bash", 1, 1, _name(thread), tid, vtids, _kernel_pid(thread), _NAMESPACE)
        yield _Event(max(run.start - _CREATION_NS, 0), 1, run.cpu, "sched_process_fork", values)


def _changes(before: Run, run: Run) -> Iterator[_Event]:
    """What happened to a thread between two times at which it had a CPU."""
    thread = run.thread
    moved = (*_of(thread), before.cpu, run.cpu)
    waking = run.waking
    if waking is not None:
        kind, cpu = waking.kind, waking.cpu
        woken = (*_of(thread), run.cpu)
        (begin, first), (end, last) = _HANDLED[TIMER]
        if kind is TIMER:
            yield _Event(waking.time, 1, cpu, begin, first)
        yield _Event(waking.time, 2, cpu, "sched_waking", woken)
        if before.cpu != run.cpu:
            yield _Event(waking.time, 3, cpu, "sched_migrate_task", moved)
        if kind is TIMER:
            yield _Event(waking.time, 4, cpu, end, last)
    elif before.cpu != run.cpu:
        yield _Event(run.start, 3, run.cpu, "sched_migrate_task", moved)


def _write_truth(
    truth: Truth,
    hostname: str,
    clock: HostClock,
    by_thread: dict[Scheduled, list[Run]],
    runs: Sequence[Sequence[Run]],
    last: int,
) -> None:
    for of_cpu in runs:
        for run in of_cpu:
            thread = run.thread
            truth.cpu_run.add(
                hostname,
                run.cpu,
                kernel_tid(thread),
                thread.description.name,
                thread.priority,
                run.start + clock,
                run.end + clock,
            )
    for thread, own in by_thread.items():
        if not thread.description.nodes:
            continue
        place = (hostname, thread.description.pid, thread.tid)
        for before, after in zip(own, (*own[1:], None), strict=True):
            waking = None if after is None else after.waking
            asleep = "uninterruptible" if before.is_uninterruptible else "sleeping"
            states: list[tuple[str, int, int, int | None]] = [
                ("running", before.cpu, before.start, before.end)
            ]
            if after is None and before.end == last:
                states = [("running", before.cpu, before.start, None)]
            elif after is None:
                state = "preempted" if before.is_preempted else asleep
                states.append((state, before.cpu, before.end, None))
            elif waking is not None:
                states.append((asleep, before.cpu, before.end, waking.time))
                states.append(("runnable", after.cpu, waking.time, after.start))
            else:
                states.append(("preempted", before.cpu, before.end, after.start))
            for state, cpu, start, end in states:
                woken: tuple[str | None, int | None] = (None, None)
                if waking is not None and state in {asleep, "runnable"}:
                    woken = waking.kind, None if waking.by is None else waking.by.tid
                if end is None or end > start:
                    end_ns = None if end is None else end + clock
                    truth.thread_state.add(*place, state, cpu, start + clock, end_ns, *woken)
