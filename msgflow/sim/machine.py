"""Hosts, processes and threads of a running simulation: who writes into which stream."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from msgflow.sim.ctf import Tracepoint, TraceWriter, thread_context
from msgflow.sim.memory import AddressSpace

if TYPE_CHECKING:
    from collections.abc import Callable

    from msgflow.sim import system
    from msgflow.sim.world import World

# A woken thread sometimes finds itself on another CPU.
_MIGRATION = 1 / 128


@dataclass(frozen=True, slots=True)
class Tracepoints:
    """The event classes that the simulation emits; field names are event names."""

    rcl_init: Tracepoint
    rcl_node_init: Tracepoint
    rmw_publisher_init: Tracepoint
    rcl_publisher_init: Tracepoint
    rclcpp_publish: Tracepoint
    rcl_publish: Tracepoint
    rmw_publish: Tracepoint
    rmw_subscription_init: Tracepoint
    rcl_subscription_init: Tracepoint
    rclcpp_subscription_init: Tracepoint
    rclcpp_subscription_callback_added: Tracepoint
    rmw_take: Tracepoint
    rcl_take: Tracepoint
    rclcpp_take: Tracepoint
    rcl_service_init: Tracepoint
    rclcpp_service_callback_added: Tracepoint
    rcl_timer_init: Tracepoint
    rclcpp_timer_callback_added: Tracepoint
    rclcpp_timer_link_node: Tracepoint
    rclcpp_callback_register: Tracepoint
    callback_start: Tracepoint
    callback_end: Tracepoint
    rclcpp_executor_get_next_ready: Tracepoint
    rclcpp_executor_wait_for_work: Tracepoint
    rclcpp_executor_execute: Tracepoint

    @classmethod
    def of(cls, trace: TraceWriter) -> Tracepoints:
        """Those of a trace."""
        return cls(**{field.name: trace.tracepoint(f"ros2:{field.name}") for field in fields(cls)})


class Machine:
    """A host: its CPUs run one thread each at a time, and each writes one stream.

    Attributes:
        hostname: its name.
        epoch: what its clock shows at time 0 (ns since the epoch); added to a time, it gives the
            trace's time stamp and the ROS stamp.
        trace: its trace.
        tracepoints: the event classes of its trace.
        free_at: for each CPU the time from which on it is free.
    """

    def __init__(self, hostname: str, epoch: int, trace: TraceWriter) -> None:
        self.hostname = hostname
        self.epoch = epoch
        self.trace = trace
        self.tracepoints = Tracepoints.of(trace)
        self.emitters = tuple(stream.emit for stream in trace.streams)
        self.free_at = [0] * len(trace.streams)


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
