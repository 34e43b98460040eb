"""CARET's library, which is loaded into processes: it tells when messages arrived in them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from msgflow_sim.machine import Thread

if TYPE_CHECKING:
    from msgflow_sim.machine import RunningProcess
    from msgflow_sim.objects import Message, SubscriptionObject

_NUMBER = 8


class DataListener(Thread):
    """The thread of the middleware that puts messages into the queues of a process.

    `heard`: those that have come, and that it has had no CPU for.
    """

    def __init__(
        self,
        process: RunningProcess,
        arrive: Callable[[int, tuple[SubscriptionObject, Message]], None],
    ) -> None:
        super().__init__(process, process.description.tid(_NUMBER))
        self.heard: deque[tuple[SubscriptionObject, Message]] = deque()
        self._arrive = arrive

    def hear(self, time: int, delivery: tuple[SubscriptionObject, Message]) -> None:
        """A message has come."""
        self.heard.append(delivery)
        if len(self.heard) == 1:
            self._tell(time)

    def _tell(self, time: int, _: None = None) -> None:
        is_there = not self.process.is_stopped
        if is_there and (later := self.take_cpu(time)):
            self.scheduler.at(later, self._tell)
            return
        while self.heard:
            subscription, message = delivery = self.heard.popleft()
            if is_there:
                told = self.machine.tracepoints.ros2_caret_on_data_available
                self.emit(told, time, self.context, message.stamp_for(subscription))
            self._arrive(time, delivery)
            time += 400
        if is_there:
            self.keep_cpu(time)
