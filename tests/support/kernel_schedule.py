"""A kernel trace beside ROS events, switch by switch."""

from __future__ import annotations

from typing import Any

from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
KERNEL = 1
HOG, TIMER = 7, 8
BLOCKED, LOST = 1, 0
"""States in which a thread leaves its CPU: it waits, or it had more to do."""


class Kernel:
    """Records what CPUs do, in a trace of the kernel."""

    def __init__(self, system: RosSystem, trace: int = KERNEL, **source: Any) -> None:
        self._system = system
        self._trace = trace
        self.shift_ns = 0
        given = {"hostname": "alpha", "clock": "boot", "tracer": "lttng-modules 2.13.9"} | source
        system.add_source(trace, **given)

    def add(
        self,
        name: str,
        ts: int,
        cpu: int | None = 0,
        ids: tuple[int, int, int | None] = (-1, -1, None),
        **fields: Any,
    ) -> int:
        """Add an event, in a thread with these ids and namespace of ids, as contexts tell."""
        pid, tid, pid_ns = ids
        where = Thread(pid, tid, cpu=cpu, trace=self._trace, name=None, pid_ns=pid_ns)
        self._system.add(name, where, ts=ts + self.shift_ns, **fields)
        return ts

    def switch(
        self,
        ts: int,
        before: int,
        after: int,
        state: int = LOST,
        cpu: int | None = 0,
        ids: tuple[int, int, int | None] = (-1, -1, None),
        **fields: Any,
    ) -> int:
        """Let a thread take the CPU from another one."""
        return self.add(
            "sched_switch",
            ts,
            cpu,
            ids,
            prev_tid=before,
            prev_prio=20,
            prev_state=state,
            next_tid=after,
            next_prio=19,
            next_comm=f"thread {after}",
            **fields,
        )

    def wake(self, ts: int, tid: int, cpu: int = 0, target_cpu: int = 0) -> int:
        return self.add("sched_waking", ts, cpu, tid=tid, target_cpu=target_cpu)


def call(system: RosSystem, begin: int, end: int, thread: Thread = MAIN) -> None:
    """Let a callback run for so long."""
    system.add("ros2:callback_start", thread, ts=begin, callback=0xC1, is_intra_process=0)
    system.add("ros2:callback_end", thread, ts=end, callback=0xC1)


def recorded(system: RosSystem, **source: Any) -> Kernel:
    """Record a callback from 1000 to 2000 that is preempted, and then sleeps."""
    kernel = Kernel(system, **source)
    kernel.switch(900, 0, 41)
    kernel.switch(1100, 41, HOG)
    kernel.switch(1300, HOG, 41)
    kernel.switch(1500, 41, 0, BLOCKED)
    kernel.add("timer_hrtimer_expire_entry", 1690)
    kernel.wake(1700, 41)
    kernel.add("timer_hrtimer_expire_exit", 1710)
    kernel.switch(1800, 0, 41)
    kernel.switch(2100, 41, 0, BLOCKED)
    kernel.switch(3000, 0, HOG)
    call(system, 1000, 2000)
    return kernel
