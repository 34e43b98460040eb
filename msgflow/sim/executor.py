"""rclcpp's single-threaded executor in the main thread of a process.

The loop: get_next_ready; if there was nothing wait_for_work and get_next_ready once more; execute.
What is ready is decided when a wait ends: timers first, then subscriptions, one message of each;
only after all of them comes the next wait.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from msgflow.sim.callbacks import TimerObject, run_subscription, run_timer
from msgflow.sim.machine import RunningProcess, Thread
from msgflow.sim.system import MICROSECOND

if TYPE_CHECKING:
    from collections.abc import Callable

    from msgflow.sim.transport import Middleware, SubscriptionObject

# Guard conditions and graph events wake executors that have nothing to do.
_SPURIOUS_WAKE_UP = 0.1
# Some of these look like data on a subscription, which then is not there.
_FAILED_TAKE = 0.02

_WAIT = "wait"
_PROCESS = "process"
_EXECUTE = "execute"
_NO_TIMEOUT = -1


class ExecutorThread(Thread):
    """The main thread of a process once it spins.

    Attributes:
        timers: of all nodes of the process; likewise `subscriptions`.
    """

    def __init__(self, process: RunningProcess, middleware: Middleware) -> None:
        super().__init__(process, process.pid)
        self.timers: list[TimerObject] = []
        self.subscriptions: list[SubscriptionObject] = []
        self._middleware = middleware
        self._ready: deque[TimerObject | SubscriptionObject] = deque()
        self._state: str | None = None
        self._state_ns = 0
        self._sleeping = False
        self._asleep_since = 0
        self._wake_at: int | None = None
        # A resumption that was planned before another one replaced it is recognised by this.
        self._plan = 0

    def spin(self, time: int) -> None:
        """Begin to execute at `time`."""
        self._resume_at(time, self._continue)

    def wake(self, time: int) -> None:
        """Something has arrived at `time`: end the wait, if there is one."""
        if not self._sleeping:
            return
        start = max(time, self._asleep_since)
        wake_at = start + 6 * MICROSECOND + self.world.tail(5 * MICROSECOND)
        if self._wake_at is None or wake_at < self._wake_at:
            self._wake_at = wake_at
            self._resume_at(wake_at, self._wait_ended)

    def finish(self) -> None:
        """Write down the last state, whose end was not seen."""
        if self._state is not None:
            self._add_state(None)

    def _resume_at(self, time: int, action: Callable[[int, int], None]) -> None:
        self._plan += 1
        self.world.at(time, action, self._plan)

    def _wait_ended(self, time: int, plan: int) -> None:
        """The wait is over: see what is ready and execute the first of it."""
        if plan != self._plan:
            return
        if later := self.take_cpu(time):
            self._resume_at(later, self._wait_ended)
            return
        self._sleeping = False
        self._collect(time)
        self._enter(_PROCESS, time)
        if self._ready:
            self._execute(time)
            return
        time += 900 + int(self.world.random() * 3_000)
        self._enter(_PROCESS, time)
        self._wait(time)

    def _continue(self, time: int, plan: int) -> None:
        """After an execution: go on with what is ready, or wait."""
        if plan != self._plan:
            return
        if later := self.take_cpu(time):
            self._resume_at(later, self._continue)
            return
        self._enter(_PROCESS, time)
        if self._ready:
            self._execute(time)
        else:
            self._wait(time)

    def _collect(self, time: int) -> None:
        ready = self._ready
        ready.extend(timer for timer in self.timers if timer.due <= time)
        ready.extend(subscription for subscription in self.subscriptions if subscription.queue)
        if not ready and self.subscriptions and self.world.random() < _FAILED_TAKE:
            ready.append(self.subscriptions[-1])

    def _wait(self, time: int) -> None:
        random = self.world.random
        time += 300 + int(random() * 2_500)
        self._enter(_WAIT, time)
        asleep = time + 400
        self.keep_cpu(asleep)
        self._sleeping = True
        self._asleep_since = asleep
        self._wake_at = None
        due = min((timer.due for timer in self.timers), default=None)
        if any(subscription.queue for subscription in self.subscriptions):
            due = asleep
        if due is not None:
            self.wake(due)
        if random() < _SPURIOUS_WAKE_UP:
            self.wake(asleep + 15 * MICROSECOND)

    def _enter(self, state: str, time: int, handle: int = 0) -> None:
        """Emit the event that begins a state, and write down the state that it ends."""
        tracepoints = self.machine.tracepoints
        if state is _PROCESS:
            self.emit(tracepoints.rclcpp_executor_get_next_ready, time, self.context)
        elif state is _WAIT:
            self.emit(tracepoints.rclcpp_executor_wait_for_work, time, self.context, _NO_TIMEOUT)
        else:
            self.emit(tracepoints.rclcpp_executor_execute, time, self.context, handle)
        now = time + self.machine.epoch
        if self._state is not None:
            self._add_state(now)
        self._state = state
        self._state_ns = now

    def _add_state(self, end_ns: int | None) -> None:
        self.world.truth.executor_state.add(
            self.machine.hostname, self.process.pid, self.tid, self._state_ns, end_ns, self._state
        )

    def _execute(self, time: int) -> None:
        entity = self._ready.popleft()
        time += 800 + int(self.world.random() * 3_500)
        self._enter(_EXECUTE, time, entity.handle)
        if isinstance(entity, TimerObject):
            end = run_timer(self, self._middleware, entity, time)
        else:
            end = run_subscription(self, self._middleware, entity, time)
        end += 400 + int(self.world.random() * 2_000)
        self.keep_cpu(end)
        self._resume_at(end, self._continue)
