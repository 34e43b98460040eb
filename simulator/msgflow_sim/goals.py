"""Actions: goals that a client sends, a server accepts or rejects, executes and has a result of.

As in rclcpp: three services and two publishers, no callback that is traced. The server publishes
its status right after the answer to a goal that it accepts, before the answer to a request to
cancel, and after the result. Goals are executed on threads of their own.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from msgflow_sim.machine import Thread
from msgflow_sim.objects import Message
from msgflow_sim.publication import publish
from msgflow_sim.services import Goal, call, respond, turn

if TYPE_CHECKING:
    from msgflow_sim.callback_instance import CallbackInstance
    from msgflow_sim.entity import ActionClient, ActionServer
    from msgflow_sim.machine import RunningProcess, Steps
    from msgflow_sim.objects import PublisherObject
    from msgflow_sim.services import ClientObject, Request, ServiceObject
    from msgflow_sim.transport import Middleware

SEND_GOAL, CANCEL_GOAL, GET_RESULT = "send_goal", "cancel_goal", "get_result"
# In the order of rcl; the service of goals comes first.
SERVICES = (SEND_GOAL, CANCEL_GOAL, GET_RESULT)
FEEDBACK, STATUS = "feedback", "status"


def name_of(action: str, part: str) -> str:
    """Name of a service or topic of an action."""
    return f"{action}/_action/{part}"


@dataclass(slots=True, eq=False)
class ActionServerObject:
    """An action server as it exists in its process, with the threads that execute its goals."""

    description: ActionServer
    feedback: PublisherObject
    status: PublisherObject
    threads: list[GoalThread] = field(default_factory=list)
    # Accepted, while all threads are busy.
    waiting: deque[Goal] = field(default_factory=deque)

    def answer(
        self,
        thread: Thread,
        middleware: Middleware,
        service: ServiceObject,
        request: Request,
        time: int,
    ) -> int:
        """Do what a request of one of its services asks for."""
        goal = request.goal
        assert goal is not None
        now = turn(thread, request, time, is_response=False)
        part = service.name.rpartition("/")[2]
        if part == SEND_GOAL:
            every = self.description.rejects
            goal.is_accepted = not every or goal.number % every != 0
            time = respond(thread, service, request, time)
            if goal.is_accepted:
                time = _publish(thread, middleware, self.status, time, now, goal)
                self._start(goal, time)
        elif part == CANCEL_GOAL:
            if not goal.is_over:
                goal.is_cancelled = True
                time = _publish(thread, middleware, self.status, time, now, goal)
            time = respond(thread, service, request, time)
        elif goal.is_over:
            time = respond(thread, service, request, time)
        else:
            goal.waiting = request
        return time

    def _start(self, goal: Goal, time: int) -> None:
        self.waiting.append(goal)
        for thread in self.threads:
            if not thread.is_busy:
                thread.work_off(time)
                return


class GoalThread(Thread):
    """A thread that executes goals of an action server, one after the other."""

    def __init__(
        self,
        process: RunningProcess,
        tid: int,
        server: ActionServerObject,
        results: ServiceObject,
        middleware: Middleware,
    ) -> None:
        super().__init__(process, tid)
        process.threads.append(self)
        self.is_busy = False
        self._server = server
        self._results = results
        self._middleware = middleware

    def work_off(self, time: int) -> None:
        """Execute what waits."""
        self.is_busy = True
        self.begin(time, self._execute(time))

    def _execute(self, time: int) -> Steps:
        server = self._server
        time = yield time
        while later := self.take_cpu(time):
            time = yield later
        while server.waiting:
            goal = server.waiting.popleft()
            for _ in range(server.description.feedback):
                time += server.description.period_ns // 2
                time += int(self.random() * server.description.period_ns)
                time = yield time
                while later := self.take_cpu(time):
                    time = yield later
                if goal.is_cancelled:
                    break
                time = yield self.hold(self._publish(server.feedback, time, goal))
            goal.is_over = True
            if goal.waiting is not None:
                time = respond(self, self._results, goal.waiting, time)
            time = yield self.hold(self._publish(server.status, time, goal))
        self.is_busy = False
        return time

    def _publish(self, publisher: PublisherObject, time: int, goal: Goal) -> int:
        return _publish(self, self._middleware, publisher, time, None, goal)


@dataclass(slots=True, eq=False)
class ActionClientObject:
    """An action client as it exists in its process; `accepted` ones wait to be asked for."""

    description: ActionClient
    clients: dict[str, ClientObject]
    number: int = 0
    accepted: list[Goal] = field(default_factory=list)

    def send(self, thread: Thread, time: int, cause: CallbackInstance | None) -> int:
        """Ask for results that were not asked for at once, and send a goal."""
        while self.accepted:
            time = self._ask(thread, self.accepted.pop(0), time, cause)
        self.number += 1
        time, request = call(thread, self.clients[SEND_GOAL], time, cause)
        request.goal = Goal(self.number, request)
        return time

    def answered(self, thread: Thread, request: Request, time: int) -> int:
        """Do what follows from a response that was taken."""
        goal, description = request.goal, self.description
        assert goal is not None
        if request is not goal.request or not goal.is_accepted:
            return time
        now = turn(thread, request, time, is_response=True)
        if description.asks_at_once:
            time = self._ask(thread, goal, time, now)
        else:
            self.accepted.append(goal)
        if description.cancels and goal.number % description.cancels == 0:
            time, cancelling = call(thread, self.clients[CANCEL_GOAL], time, now)
            cancelling.goal = goal
        return time

    def _ask(self, thread: Thread, goal: Goal, time: int, cause: CallbackInstance | None) -> int:
        time, goal.asking = call(thread, self.clients[GET_RESULT], time, cause)
        goal.asking.goal = goal
        return time


def _publish(
    thread: Thread,
    middleware: Middleware,
    publisher: PublisherObject,
    time: int,
    instance: CallbackInstance | None,
    goal: Goal,
) -> int:
    """Publish feedback or status because of a goal."""
    message = Message(next(thread.scheduler.publication_ids), publisher, thread.tid, instance)
    thread.scheduler.truth.goal_message.add(goal.request.request_id, message.publication_id)
    return publish(thread, middleware, publisher, time, instance, message)
