"""Hosts, processes and threads of a running simulation: who writes into which stream."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.sim.ctf import thread_context
from msgflow.sim.memory import AddressSpace

if TYPE_CHECKING:
    from collections.abc import Callable

    from msgflow.sim import system
    from msgflow.sim.recorder import Recorder
    from msgflow.sim.recording import Recording
    from msgflow.sim.world import World

# A woken thread sometimes finds itself on another CPU.
_MIGRATION = 1 / 128


class Machine:
    """A host: its CPUs run one thread each at a time, and each writes one stream.

    Attributes:
        hostname: its name.
        epoch: what its clock shows at time 0 (ns since the epoch); added to a time, it gives the
            trace's time stamp.
        recorder: writes its traces.
        layout: of its traces.
        tracepoints: the events that can be emitted.
        free_at: for each CPU the time from which on it is free.
    """

    def __init__(self, hostname: str, epoch: int, recorder: Recorder, recording: Recording) -> None:
        self.hostname = hostname
        self.epoch = epoch
        self.recorder = recorder
        self.layout = recorder.layout
        self.tracepoints = recorder.tracepoints
        self.emitters = recorder.emitters
        self.free_at = [0] * recorder.cpu_count
        self._stamp_epoch = epoch + recording.realtime_offset_ns
        self._slew_ppb = round(recording.slew_ppm * 1000)

    def stamp_ns(self, time: int) -> int:
        """What the clock that makes source stamps shows at `time` (ns since the epoch)."""
        return time + self._stamp_epoch + time * self._slew_ppb // 1_000_000_000


class RunningProcess:
    """A process that exists.

    Attributes:
        description: what the scenario says about it.
        machine: where it runs.
        number: its number among all processes.
        memory: its addresses.
    """

    def __init__(
        self, world: World, machine: Machine, description: system.Process, number: int, seed: str
    ) -> None:
        self.world = world
        self.machine = machine
        self.description = description
        self.number = number
        self.pid = description.pid
        self.memory = AddressSpace(f"{seed}/{description.pid}")
        self._participant = (
            bytes((1, 15))
            + machine.hostname.encode()[-2:].rjust(2, b"\x2a")
            + description.pid.to_bytes(2, "little")
            + self.memory.garbage(2)
            + bytes((1, 0, 0, 0))
        )
        self._entities = 0

    def gid(self, kind: int) -> bytes:
        """A new DDS identifier (16 bytes; kind 3: writer, 4: reader) in an array of 24.

        The rest is what tracetools read beyond the end of the identifier.
        """
        self._entities += 1
        entity = self._entities.to_bytes(3, "big") + bytes((kind,))
        return self._participant + entity + self.memory.garbage(8)


class Thread:
    """A thread: it gets a CPU for a stretch of time and emits events while it has it.

    Attributes:
        process: to which it belongs.
        context: its part of each record.
        emit: `emit(tracepoint, time, context, *values)` on the CPU it has.
    """

    def __init__(self, process: RunningProcess, tid: int) -> None:
        self.process = process
        self.world = process.world
        self.machine = process.machine
        self.tid = tid
        self.context = thread_context(process.pid, tid, process.description.name)
        self.cpu = process.number % len(self.machine.emitters)
        self.emit: Callable[..., None] = self.machine.emitters[self.cpu]

    def take_cpu(self, time: int) -> int:
        """Get a CPU at `time`: 0, or if none is free the time when one will be.

        The one it had last is preferred.
        """
        free_at = self.machine.free_at
        cpu = self.cpu
        if self.world.random() < _MIGRATION:
            cpu = (cpu + 1) % len(free_at)
        if free_at[cpu] > time:
            cpu = min(range(len(free_at)), key=free_at.__getitem__)
            if free_at[cpu] > time:
                return free_at[cpu]
        self.cpu = cpu
        self.emit = self.machine.emitters[cpu]
        return 0

    def keep_cpu(self, until: int) -> None:
        """Have the CPU until that time, which is after the last event emitted."""
        self.machine.free_at[self.cpu] = until
        if until > self.world.end:
            self.world.end = until
