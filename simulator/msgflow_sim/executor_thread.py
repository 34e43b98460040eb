"""Threads that spin an executor, as rclcpp does it.

The loop: get_next_ready; if there was nothing wait_for_work and get_next_ready once more; execute.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from msgflow_sim.callbacks import run_buffer, run_subscription, run_timer
from msgflow_sim.entity import MICROSECOND
from msgflow_sim.kernel import SOFTIRQ, TIMER
from msgflow_sim.machine import Run, RunningProcess, Steps, Thread
from msgflow_sim.objects import IntraBuffer, SubscriptionObject, TimerObject
from msgflow_sim.scheduler import tail
from msgflow_sim.services import ClientObject, ServiceObject, run_client, run_service

if TYPE_CHECKING:
    from msgflow_sim.executor import Entity, Executor
    from msgflow_sim.transport import Middleware

HANDLERS: Mapping[type, Callable[..., Run]] = {
    TimerObject: run_timer,
    SubscriptionObject: run_subscription,
    ServiceObject: run_service,
    ClientObject: run_client,
    IntraBuffer: run_buffer,
}
"""The function that runs a ready entity, by its class."""

# Guard conditions and graph events wake executors that have nothing to do.
_SPURIOUS_WAKE_UP = 0.1

_WAIT = "wait"
_PROCESS = "process"
_EXECUTE = "execute"
_NO_TIMEOUT = -1
# Others are executed without rclcpp_executor_execute.
_ANNOUNCED = (TimerObject, SubscriptionObject)


class ExecutorThread(Thread):
    """A thread of a process that executes callbacks."""

    def __init__(self, process: RunningProcess, tid: int, middleware: Middleware) -> None:
        super().__init__(process, tid)
        process.threads.append(self)
        self._middleware = middleware
        # What the thread does, and since when [ns since the epoch].
        self._state: tuple[int, str] | None = None
        self._is_idle = False
        self._asleep_since = 0
        self._wake_at: int | None = None

    def wake(self, time: int, kind: str = SOFTIRQ) -> None:
        """Something has arrived at `time` for the executor that the thread waits in."""
        start = max(time, self._asleep_since)
        if self.machine.kernel is not None:
            woken = self.machine.kernel.wake(self, start, kind)
            if woken is not None:
                self.go_on(woken)
            return
        wake_at = start + 6 * MICROSECOND + tail(self.random, 5 * MICROSECOND)
        if self._wake_at is None or wake_at < self._wake_at:
            self._wake_at = wake_at
            self.go_on(wake_at)

    def stop(self) -> None:
        """The process ends: a thread that waits ends at once, others when they have executed."""
        if self._is_idle or self.process.is_stepwise:
            self.cut()

    def shut_down(self, time: int) -> None:
        """ROS is shut down: the thread does not wait any more, and goes on when it has executed."""
        if self._is_idle:
            self.go_on(max(time, self._asleep_since))

    def finish(self) -> None:
        """Write down what has begun and whose end was not seen."""
        self.cut()
        self._write_state(None)

    def spin(
        self,
        executor: Executor,
        time: int,
        until: int | None = None,
        is_done: Callable[[], bool] | None = None,
    ) -> Steps:
        """Execute what is ready from `time` on; returns the time at which the spinning ended.

        Ends when the process does, at `until`, or when `is_done` after an execution. Within a
        callback the thread has a CPU already, and has one in the end.
        """
        if is_done is None and until is None:
            time = yield time
            while later := self.take_cpu(time):
                time = yield later
        while not self.process.is_stopped:
            if (until is not None and time >= until) or (is_done is not None and is_done()):
                break
            if executor.owner is not None and executor.owner is not self:
                executor.block(self)
                self._is_idle = True
                time = yield None
                self._is_idle = False
                while later := self.take_cpu(time):
                    time = yield later
                continue
            executor.owner = self
            self._enter(executor, _PROCESS, time)
            entity = executor.pick(time)
            if entity is None:
                self._fall_asleep(executor, time, until)
                time = yield None
                while later := self.take_cpu(time):
                    time = yield later
                self._is_idle = False
                executor.sleeper = None
                executor.collect(time)
                self._enter(executor, _PROCESS, time)
                entity = executor.pick(time)
                if entity is None:
                    # It may have to wait for the executor next, but has used its CPU up to here.
                    self.keep_cpu(time + 1)
                    executor.release(time)
                    time += 900 + int(self.random() * 3_000)
                    continue
            executor.release(time)
            time = yield from self._execute(executor, entity, time)
        return time

    def poll(self, executor: Executor, time: int, pause: int) -> Steps:
        """Execute what is ready, again and again, and do something else for `pause` in between.

        Ends when the process does; returns the time of that.
        """
        time = yield time
        while later := self.take_cpu(time):
            time = yield later
        while not self.process.is_stopped:
            self._enter(executor, _WAIT, time, 0)
            time += 1_500 + int(self.random() * 3_000)
            executor.collect(time)
            self._enter(executor, _PROCESS, time)
            while (entity := executor.pick(time)) is not None:
                time = yield from self._execute(executor, entity, time)
                self._enter(executor, _PROCESS, time)
            self.keep_cpu(time + 1)
            self._is_idle, self._asleep_since = True, time + 1
            time = yield time + pause
            self._is_idle = False
            while later := self.take_cpu(time):
                time = yield later
        return time

    def _execute(self, executor: Executor, entity: Entity, time: int) -> Steps:
        """Execute something; returns the time at which the thread goes on, with a CPU."""
        time += 800 + int(entity.random() * 3_500)
        entity.group.is_busy = True
        kind = type(entity)
        if isinstance(entity, _ANNOUNCED) and not entity.code.is_agnocast:
            self._enter(executor, _EXECUTE, time, entity.handle)
        end = HANDLERS[kind](self, self._middleware, entity, time)
        if not isinstance(end, int):
            end = yield from end
        end += 400 + int(entity.random() * 2_000)
        self.keep_cpu(end)
        time = yield end
        entity.group.is_busy = False
        if executor.thread_count > 1 and not entity.group.is_reentrant:
            executor.wake(time)
        while later := self.take_cpu(time):
            time = yield later
        return time

    def _fall_asleep(self, executor: Executor, time: int, until: int | None) -> None:
        random = self.random
        time += 300 + int(random() * 2_500)
        timeout = _NO_TIMEOUT if until is None else max(0, until - time)
        self._enter(executor, _WAIT, time, timeout)
        asleep = time + 400
        self.keep_cpu(asleep)
        executor.sleeper = self
        self._is_idle = True
        self._asleep_since = asleep
        self._wake_at = None
        due = executor.next_wake_up(asleep)
        if executor.timeout_ns is not None:
            until = asleep + executor.timeout_ns
            if not self.process.is_rclcpp:
                self._emit_timer(time, executor.timeout_ns)
        if until is not None and (due is None or until < due):
            due = until
        if due is not None:
            self.wake(due, TIMER)
        if random() < _SPURIOUS_WAKE_UP:
            self.wake(asleep + 15 * MICROSECOND, TIMER)

    def _emit_timer(self, time: int, period: int) -> None:
        """A wait of rclpy that may time out has a timer, which exists as long as the wait."""
        memory = self.process.memory
        handle = memory.allocate()
        self.emit(self.machine.tracepoints.rcl_timer_init, time, self.context, handle, period)
        memory.free(handle)

    def _enter(self, executor: Executor, state: str, time: int, argument: int = 0) -> None:
        """Emit the event that begins a state, and write it down."""
        if not executor.has_events:
            return
        tracepoints = self.machine.tracepoints
        if state is _PROCESS:
            self.emit(tracepoints.rclcpp_executor_get_next_ready, time, self.context)
        elif state is _WAIT:
            self.emit(tracepoints.rclcpp_executor_wait_for_work, time, self.context, argument)
        else:
            self.emit(tracepoints.rclcpp_executor_execute, time, self.context, argument)
        start_ns = time + self.machine.epoch
        self._write_state(start_ns)
        self._state = (start_ns, state)

    def _write_state(self, end_ns: int | None) -> None:
        if self._state is not None:
            self.scheduler.truth.executor_state.add(
                self.machine.hostname,
                self.process.pid,
                self.tid,
                self._state[0],
                end_ns,
                self._state[1],
            )
