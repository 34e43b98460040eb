"""Discovery traffic of the middleware: ros_discovery_info, which passes no layer of rcl.

Whenever an object is created, its process publishes what it has; a listener thread of every
process takes that. The takes carry no stamp (no message info is asked for), and a process takes
nothing of what it said itself (`taken = 0`).
"""

from __future__ import annotations

from collections import deque

from msgflow_sim.latency import latency_between
from msgflow_sim.machine import RunningProcess, Thread
from msgflow_sim.rmw import read, write
from msgflow_sim.scheduler import Dice, tail

_TOPIC = "ros_discovery_info"
_NUMBER = 9


class DiscoveryListener(Thread):
    """The thread of a process that takes discovery messages."""

    def __init__(self, process: RunningProcess) -> None:
        super().__init__(process, process.description.tid(_NUMBER))
        self.rmw_handle = process.memory.allocate()
        self._message = process.memory.on_thread_stack()
        self._heard: deque[int] = deque()
        self._awake = False
        self._done = 0

    def hear(self, time: int, taken: int) -> None:
        """A message has arrived; `taken` is 0 for the own ones, else 1."""
        self._heard.append(taken)
        if not self._awake:
            self._awake = True
            awake = time + 10_000 + tail(self.random, 20_000)
            self.scheduler.at(max(awake, self._done), self._listen)

    def _listen(self, time: int, _: None) -> None:
        if self.process.is_stopped:
            return
        if later := self.take_cpu(time):
            self.scheduler.at(later, self._listen)
            return
        while self._heard:
            taken = self._heard.popleft()
            time = read(self, self.rmw_handle, self._message, time, 0, taken)
            time += 1_500 + int(self.random() * 2_000)
        self.keep_cpu(time)
        self._awake = False
        self._done = time


class Discovery:
    """All listeners, and the publications that they listen to."""

    def __init__(self) -> None:
        self._listeners: list[DiscoveryListener] = []

    def join(self, listener: DiscoveryListener) -> None:
        """A process can be heard and hears from now on."""
        self._listeners.append(listener)

    def leave(self, listener: DiscoveryListener) -> None:
        """A process has ended."""
        self._listeners.remove(listener)

    def announce(
        self, thread: Thread, rmw_handle: int, message: int, time: int, random: Dice
    ) -> int:
        """Publish what the process has, from `time` on; returns the time when that is done."""
        scheduler, machine = thread.scheduler, thread.machine
        written = write(thread, rmw_handle, message, time, random)
        publication_id = next(scheduler.publication_ids)
        written.add_to_truth(thread, publication_id)
        scheduler.truth.publication.add(
            publication_id,
            machine.hostname,
            thread.process.pid,
            thread.tid,
            None,
            _TOPIC,
            None,
            rmw_handle,
            None,
            None,
            written.rmw + machine.epoch,
            written.stamp_ns,
            None,
            True,
            None,
            None,
        )
        for listener in self._listeners:
            latency = latency_between(thread.process, listener.process)
            arrival = written.end + latency.base + tail(random, latency.tail)
            scheduler.at(arrival, listener.hear, int(listener.process is not thread.process))
        return written.end + 5_000 + int(random() * 10_000)
