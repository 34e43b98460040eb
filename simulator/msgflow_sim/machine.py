"""Machines, processes and threads of a running simulation: which stream each writes."""

from __future__ import annotations

from collections.abc import Callable, Generator
from random import Random
from typing import TYPE_CHECKING

from msgflow_sim.ctf import thread_context
from msgflow_sim.kernel import TIMER

if TYPE_CHECKING:
    from msgflow_sim import system
    from msgflow_sim.host_clock import HostClock
    from msgflow_sim.kernel import Kernel
    from msgflow_sim.recorder import Recorder
    from msgflow_sim.recording import Recording
    from msgflow_sim.scheduler import Scheduler

# A woken thread sometimes finds itself on another CPU.
_MIGRATION = 1 / 128
# No thread changes its CPU and changes back faster than that.
_LEAST_STAY_NS = 20_000
_ALIGNMENT = 16
# From the moment in which a thread gives a mutex away until it sleeps, and from that in which it
# goes on until it asks for the mutex again.
_CALL_NS = 300


class Machine:
    """A host: its CPUs run one thread each at a time, and each writes one stream.

    Attributes:
        hostname: its name.
        epoch: its clock; added to a time, it gives the trace's time stamp.
        recorder: writes its traces.
        layout: of its traces.
        tracepoints: the events that can be emitted.
        free_at: for each CPU the time from which on it is free.
        publish_pace: how long a publication takes from layer to layer, as a share of the usual.
        kernel: what gives CPUs to threads where that is traced.
    """

    def __init__(
        self,
        hostname: str,
        epoch: HostClock,
        recorder: Recorder,
        recording: Recording,
        stamp_resolution: int = 1,
        publish_pace: float = 1.0,
        kernel: Kernel | None = None,
    ) -> None:
        self.kernel = kernel
        self.hostname = hostname
        self._stamp_resolution = stamp_resolution
        self.publish_pace = publish_pace
        self.epoch = epoch
        self.recorder = recorder
        self.layout = recorder.layout
        self.tracepoints = recorder.tracepoints
        self.emitters = recorder.emitters
        self.free_at = [0] * recorder.cpu_count
        self._realtime_offset_ns = recording.realtime_offset_ns
        self._slew_ppb = round(recording.slew_ppm * 1000)
        self._realtime_steps = recording.realtime_steps

    def stamp_ns(self, time: int) -> int:
        """What the clock that makes source stamps shows at `time` (ns since the epoch)."""
        now = time + self.epoch + self._realtime_offset_ns
        now += time * self._slew_ppb // 1_000_000_000
        now += sum(by for at, by in self._realtime_steps if time >= at)
        return now - now % self._stamp_resolution


class AddressSpace:
    """Heap and stacks of one process, with plausible addresses.

    The same seed gives the same addresses: processes with equal ids on two hosts have equal ones.
    """

    def __init__(self, seed: str) -> None:
        self._random = Random(seed)
        self._freed: list[int] = []
        self._heap = 0x5500_0000_0000 + (self._random.getrandbits(36) << 4 & ~0xFFF)
        self._main_stack = 0x7FFC_0000_0000 + (self._random.getrandbits(31) & ~0xF)
        self._thread_stack = 0x7F00_0000_0000 + (self._random.getrandbits(38) & ~0xFFF)

    def allocate(self) -> int:
        """Address of a new object on the heap; the one that was freed last is used again."""
        if self._freed:
            return self._freed.pop()
        self._heap += _ALIGNMENT * self._random.randrange(2, 200)
        return self._heap

    def free(self, address: int) -> None:
        """An object on the heap exists no more."""
        self._freed.append(address)

    def on_stack(self) -> int:
        """Address of a local variable of the main thread."""
        return self._main_stack - _ALIGNMENT * self._random.randrange(1, 500)

    def on_thread_stack(self) -> int:
        """Address of a local variable of the middleware's thread."""
        return self._thread_stack - _ALIGNMENT * self._random.randrange(1, 500)

    def garbage(self, size: int) -> bytes:
        """Bytes that were never initialised."""
        return self._random.randbytes(size)


class RunningProcess:
    """A process that exists.

    Attributes:
        description: what the scenario says about it.
        machine: where it runs.
        name: what tells it from others, but from other lives of it.
        number: its number among all processes; `life` counts those of this id before it.
        memory: its addresses.
        threads: those that execute callbacks.
        goal_threads: how many execute goals of actions; `agnocast_callbacks` likewise.
        is_stopped: it has ended, or ends as soon as its threads have executed what they execute.
        is_traced: its callbacks and executors have events.
        is_stepwise: it may end in the middle of a callback.
    """

    def __init__(
        self,
        scheduler: Scheduler,
        machine: Machine,
        description: system.Process,
        number: int,
        seed: str,
        life: int = 0,
    ) -> None:
        self.scheduler = scheduler
        self.machine = machine
        self.description = description
        self.number = number
        self.pid = description.pid
        self.name = f"{description.hostname}/{description.pid}"
        self.is_rclcpp = description.client_library == "rclcpp"
        self.is_traced = description.client_library != "rclpy"
        self.threads: list[Thread] = []
        self.is_stopped = False
        self.is_stepwise = description.is_killed
        self.memory = AddressSpace(f"{seed}/{description.pid}")
        random = self.memory.garbage(2)
        self._participant = (
            bytes((1, 15))
            + machine.hostname.encode()[-2:].rjust(2, b"\x2a")
            + (description.pid & 0xFFFF).to_bytes(2, "little")
            + bytes((random[0] ^ life, random[1]))
            + bytes((1, 0, 0, 0))
        )
        self.goal_threads = 0
        self.agnocast_callbacks = 0
        self._entities = 0

    def is_shut_down(self, time: int) -> bool:
        """Whether ROS is shut down at that time.

        Callbacks are simulated ahead, so `is_stopped` may not tell yet.
        """
        stop_ns = self.description.stop_ns
        return stop_ns is not None and time >= stop_ns

    def gid(self, kind: int) -> bytes:
        """A new DDS identifier (16 bytes; kind 3: writer, 4: reader) in an array of 24.

        The rest is what tracetools read beyond the end of the identifier.
        """
        self._entities += 1
        entity = self._entities.to_bytes(3, "big") + bytes((kind,))
        return self._participant + entity + self.memory.garbage(8)


# What a thread does, in steps: it yields the time of the next one, or None to wait for a wake-up,
# and is sent the time at which it goes on; the result is the time at which it has ended.
Steps = Generator[int | None, int, int]

# What is done without a step in between has ended at a known time.
Run = int | Steps


def settle(run: Run) -> Steps:
    """Go through the steps, if there are any."""
    return run if isinstance(run, int) else (yield from run)


def at_once(steps: Steps) -> int:
    """Go through steps during which nothing else can happen; returns when they have ended."""
    try:
        time = next(steps)
        while True:
            assert time is not None
            time = steps.send(time)
    except StopIteration as ended:
        return int(ended.value)


class Thread:
    """A thread: it gets a CPU for a stretch of time and emits events while it has it.

    Attributes:
        process: to which it belongs.
        context: its part of each record.
        random: its random numbers.
        emit: `emit(tracepoint, time, context, *values)` on the CPU it has.
        running: identifiers of the callback instances that go on, the innermost last.
        description: of its process.
        priority: as the kernel has it.
        computing: from when to when it has nothing else to do, so that others may have its CPU.
    """

    def __init__(self, process: RunningProcess, tid: int) -> None:
        self.process = process
        self.scheduler = process.scheduler
        self.machine = process.machine
        self.tid = tid
        self.random = self.scheduler.dice(process.name, "thread", tid)
        self.context = thread_context(process.pid, tid, process.description.name)
        self.cpu = process.number % len(self.machine.emitters)
        self.emit: Callable[..., None] = self.machine.emitters[self.cpu]
        self.running: list[int] = []
        self.description = process.description
        self.priority = process.description.priority
        self.computing = (0, 0)
        self._moved_ns = -_LEAST_STAY_NS
        self._steps: Steps | None = None
        # A step that was planned before another one replaced it is recognised by this.
        self._plan = 0

    def take_cpu(self, time: int) -> int:
        """Get a CPU at `time`: 0, or if none is free the time when one will be.

        The one it had last is preferred.
        """
        period, length = self.process.description.starved_ns
        if length and (passed := time % period) >= period - length:
            return time - passed + period
        if self.machine.kernel is not None:
            return self.machine.kernel.take(self, time)
        free_at = self.machine.free_at
        cpu = self.cpu
        if self.random() < _MIGRATION:
            cpu = (cpu + 1) % len(free_at)
        if time < self._moved_ns + _LEAST_STAY_NS:
            if free_at[self.cpu] > time:
                return free_at[self.cpu]
            cpu = self.cpu
        if free_at[cpu] > time:
            cpu = min(range(len(free_at)), key=free_at.__getitem__)
            if free_at[cpu] > time:
                return free_at[cpu]
        if cpu != self.cpu:
            self._moved_ns = time
        self.move(cpu)
        return 0

    def move(self, cpu: int) -> None:
        """Go on on a CPU."""
        self.cpu = cpu
        self.emit = self.machine.emitters[cpu]

    def keep_cpu(self, until: int) -> None:
        """Have the CPU until that time, which is after the last event emitted."""
        self.machine.free_at[self.cpu] = until
        if self.machine.kernel is not None:
            self.machine.kernel.keep(self, until)
        if until > self.scheduler.end:
            self.scheduler.end = until

    def hold(self, time: int) -> int:
        """Keep the CPU up to the next step at `time`; returns that, to be yielded."""
        self.keep_cpu(time + 1)
        return time

    def compute(self, time: int, length: int) -> Steps:
        """Compute for so long from `time` on; returns when that is done.

        Where the kernel is traced, others may have the CPU in between.
        """
        if self.machine.kernel is None:
            return time + length
        while True:
            self.computing = (time, time + length)
            end = yield self.hold(time + length)
            length -= end - time
            time = end
            self.computing = (0, 0)
            if not length:
                return time
            while later := self.take_cpu(time):
                time = yield later

    def sleep(self, time: int, length: int, kind: str = TIMER) -> Steps:
        """Sleep until something wakes it after so long; returns when it has a CPU again."""
        self.keep_cpu(time)
        woken: int | None = time + length
        if self.machine.kernel is not None:
            woken = self.machine.kernel.wake(self, time + length, kind)
        time = yield woken
        while later := self.take_cpu(time):
            time = yield later
        return time

    def lock(self, time: int, mutex: str) -> Steps:
        """Have a mutex from `time` on, or as soon as others have given it away."""
        kernel = self.machine.kernel
        if kernel is not None and not kernel.acquire(self, mutex, is_free=True):
            time = yield from self._wait(time)
        return time

    def wait(self, time: int, condition: str, mutex: str) -> Steps:
        """Wait until a condition is signalled, without the mutex, and have that again."""
        kernel = self.machine.kernel
        if kernel is not None and not kernel.acquire(self, condition, is_free=False):
            if mutex:
                self.release(time, mutex)
            time = yield from self._wait(time + _CALL_NS)
            if mutex:
                time = yield self.hold(time + _CALL_NS)
                time = yield from self.lock(time, mutex)
        return time

    def release(self, time: int, name: str) -> None:
        """Give a mutex away, or signal a condition."""
        if self.machine.kernel is not None:
            self.machine.kernel.release(self, name, time)

    def _wait(self, time: int) -> Steps:
        """Sleep until another thread wakes it; returns when it has a CPU again."""
        self.keep_cpu(time)
        time = yield None
        while later := self.take_cpu(time):
            time = yield later
        return time

    def begin(self, time: int, steps: Steps) -> None:
        """Let the thread do something from `time` on."""
        self._steps = steps
        self._plan += 1
        self.scheduler.at(time, self._first_step, self._plan)

    def go_on(self, time: int) -> None:
        """Plan the next step for `time`, in the place of any other."""
        self._plan += 1
        self.scheduler.at(time, self._step, self._plan)

    def cut(self) -> None:
        """End in the middle of whatever the thread does."""
        self._plan += 1
        if self._steps is not None:
            self._steps.close()
            self._steps = None

    def stop(self) -> None:
        """The process ends."""
        self.cut()

    def finish(self) -> None:
        """The simulation ends."""
        self.cut()

    def _first_step(self, _: int, plan: int) -> None:
        if plan != self._plan or self._steps is None:
            return
        following = next(self._steps)
        if following is not None:
            self.go_on(following)

    def _step(self, time: int, plan: int) -> None:
        if plan != self._plan or self._steps is None:
            return
        try:
            following = self._steps.send(time)
        except StopIteration:
            self._steps = None
            return
        if following is not None:
            self._plan += 1
            self.scheduler.at(following, self._step, self._plan)
