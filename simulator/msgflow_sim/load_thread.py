"""Threads of processes without ROS, which compute now and then."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow_sim.machine import RunningProcess, Steps, Thread

if TYPE_CHECKING:
    from msgflow_sim.system import Load


class LoadThread(Thread):
    """A thread that computes for a while, again and again."""

    def __init__(self, process: RunningProcess, load: Load) -> None:
        super().__init__(process, load.tid)
        self._load = load

    def work(self) -> Steps:
        """Compute when it is due, or as soon as there is a CPU after that."""
        due = self._load.start_ns
        time = yield due
        while later := self.take_cpu(time):
            time = yield later
        while True:
            time = yield from self.compute(time, self._load.busy_ns)
            due = max(due + self._load.period_ns, time + 1)
            time = yield from self.sleep(time, due - time)
