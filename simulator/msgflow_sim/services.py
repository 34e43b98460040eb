"""Services and clients: requests, the callbacks that answer them, and responses.

No executor event tells of them. A response is taken by an executor of the client, which calls the
user's code without a callback that is traced.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from msgflow_sim.callback_instance import CallbackInstance
from msgflow_sim.callbacks import run_callback
from msgflow_sim.latency import latency_between
from msgflow_sim.machine import Run, settle
from msgflow_sim.scheduler import tail
from msgflow_sim.user_code import execute

if TYPE_CHECKING:
    from msgflow_sim.executor import CallbackGroup, Executor
    from msgflow_sim.machine import RunningProcess, Steps, Thread
    from msgflow_sim.objects import UserCode
    from msgflow_sim.scheduler import Dice, Scheduler
    from msgflow_sim.transport import Middleware
    from msgflow_sim.truth import Truth

    Answer = Callable[[Thread, Middleware, "ServiceObject", "Request", int], int]


@dataclass(slots=True, eq=False)
class Request:
    """A request and its response; `caller` is the callback instance that sent it.

    Names in `_ns` are times on the clock of the host where it happened. `goal` is that of an
    action.
    """

    request_id: int
    client: ClientObject
    sequence_number: int
    caller: int | None
    sent_tid: int
    sent_ns: int
    service: ServiceObject | None = None
    taken_tid: int | None = None
    taken_ns: int | None = None
    callback_instance_id: int | None = None
    stamp_ns: int | None = None
    answered_tid: int | None = None
    answered_ns: int | None = None
    received_tid: int | None = None
    received_ns: int | None = None
    goal: Goal | None = None


@dataclass(slots=True, eq=False)
class Goal:
    """A goal of an action: which of its client's it is, and what became of it.

    `asking` asks for its result; `waiting` is that request while the server has none. `is_over`
    when the result is there.
    """

    number: int
    request: Request
    is_accepted: bool = False
    is_cancelled: bool = False
    is_over: bool = False
    asking: Request | None = None
    waiting: Request | None = None


@dataclass(slots=True, eq=False)
class ServiceObject:
    """A service as it exists in its process.

    `waiting` are requests without a response; `action` answers requests of an action.
    """

    network: ServiceNetwork
    process: RunningProcess
    executor: Executor
    group: CallbackGroup
    node: str
    name: str
    handle: int
    rmw_handle: int
    callback: int
    message: int
    code: UserCode
    is_deferred: bool = False
    is_answered_later: bool = False
    action: Answer | None = None
    requests: deque[Request | None] = field(default_factory=deque)
    waiting: deque[Request] = field(default_factory=deque)
    random: Dice = field(init=False)
    kind: ClassVar[str] = "service"

    def __post_init__(self) -> None:
        process = self.process
        self.random = process.scheduler.dice(process.name, self.node, self.name, "service")

    def is_ready(self, time: int) -> bool:
        """Whether a request is there."""
        return bool(self.requests)


@dataclass(slots=True, eq=False)
class ClientObject:
    """A client as it exists in its process.

    Attributes:
        answered: number of the last response taken.
        responses: those that have come; None stands for one to another client of the service.
        action: does what follows from a response of an action.
    """

    network: ServiceNetwork
    process: RunningProcess
    executor: Executor
    group: CallbackGroup
    node: str
    name: str
    handle: int
    rmw_handle: int
    gid: bytes
    message: int
    code: UserCode
    sequence_number: int = 0
    answered: int = 0
    action: Callable[[Thread, Request, int], int] | None = None
    responses: deque[Request | None] = field(default_factory=deque)
    random: Dice = field(init=False)
    kind: ClassVar[str] = "client"

    def __post_init__(self) -> None:
        process = self.process
        self.random = process.scheduler.dice(process.name, self.node, self.name, "client")

    def is_ready(self, time: int) -> bool:
        """Whether a response is there."""
        return bool(self.responses)


class ServiceNetwork:
    """Carries requests to the service of that name, and responses back."""

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        self._services: dict[str, ServiceObject] = {}
        self._clients: dict[str, list[ClientObject]] = {}
        self._requests: list[Request] = []

    def add(self, service: ServiceObject) -> None:
        """A service was created."""
        self._services[service.name] = service

    def add_client(self, client: ClientObject) -> None:
        """A client was created."""
        self._clients.setdefault(client.name, []).append(client)

    def send_request(self, time: int, request: Request) -> None:
        """Send a request; without such a service it is lost."""
        self._requests.append(request)
        service = self._services.get(request.client.name)
        if service is not None and not service.process.is_stopped:
            arrival = self._arrival(time, request.client, service)
            self._scheduler.at(arrival, self._arrive, (service, request))

    def send_response(self, time: int, service: ServiceObject, request: Request) -> None:
        """Send a response: all clients of the service get it, one can take it."""
        for client in self._clients[service.name]:
            if client is request.client or not client.process.is_stopped:
                arrival = self._arrival(time, service, client)
                response = request if client is request.client else None
                self._scheduler.at(arrival, self._arrive, (client, response))

    def finish(self) -> None:
        """Write down what became of each request."""
        for request in self._requests:
            write_request(self._scheduler.truth, request)

    def _arrive(
        self, time: int, delivery: tuple[ServiceObject | ClientObject, Request | None]
    ) -> None:
        owner, request = delivery
        queue = owner.requests if isinstance(owner, ServiceObject) else owner.responses
        queue.append(request)
        owner.executor.arrive(owner, time)

    def _arrival(
        self, time: int, source: ServiceObject | ClientObject, target: ServiceObject | ClientObject
    ) -> int:
        latency = latency_between(source.process, target.process)
        return time + latency.base + tail(source.random, latency.tail)


def call(
    thread: Thread, client: ClientObject, time: int, cause: CallbackInstance | None
) -> tuple[int, Request]:
    """Send a request; returns the time at which the call returns, and the request."""
    random, machine = client.random, thread.machine
    client.sequence_number += 1
    sent = time + 400 + int(random() * 1_500)
    thread.emit(
        machine.tracepoints.rmw_send_request,
        sent,
        thread.context,
        client.rmw_handle,
        client.message,
        client.sequence_number,
    )
    request = Request(
        next(thread.scheduler.request_ids),
        client,
        client.sequence_number,
        None if cause is None else cause.callback_instance_id,
        thread.tid,
        sent + machine.epoch,
    )
    if cause is not None and cause.request_id is not None:
        thread.scheduler.truth.link_call.add(
            cause.request_id, cause.is_response, None, request.request_id, None
        )
    client.network.send_request(sent, request)
    return sent + 2_000 + int(random() * 4_000), request


def run_service(thread: Thread, middleware: Middleware, service: ServiceObject, time: int) -> Steps:
    """Take a request, run the callback, send the response; returns the time when that is done."""
    machine = thread.machine
    random, tracepoints, epoch = service.random, machine.tracepoints, machine.epoch
    time += 1_000 + int(random() * 5_000)
    request = service.requests.popleft()
    assert request is not None
    client = request.client
    thread.emit(
        tracepoints.rmw_take_request,
        time,
        thread.context,
        service.rmw_handle,
        service.message,
        client.gid,
        request.sequence_number,
        1,
    )
    request.service, request.taken_tid, request.taken_ns = service, thread.tid, time + epoch
    start = time + 600 + int(random() * 1_500)
    if service.action is not None:
        return service.action(thread, middleware, service, request, start)
    if service.code.is_callback:
        request.callback_instance_id = next(thread.scheduler.callback_instance_ids)
        end = yield from settle(
            run_callback(
                thread,
                middleware,
                service.code,
                start,
                service.callback,
                service.node,
                "service",
                instance_id=request.callback_instance_id,
                has_end=not service.is_deferred or machine.layout.has_end_of_deferred,
            )
        )
    else:
        now = turn(thread, request, time, is_response=False)
        end = yield from settle(execute(thread, middleware, service.code, start, now))
    if service.is_answered_later:
        service.waiting.append(request)
        return end
    return respond(thread, service, request, end)


def answer(
    thread: Thread, service: ServiceObject, time: int, cause: CallbackInstance | None
) -> int:
    """Send the response that a request waits for, if one does; returns the time after that."""
    if not service.waiting:
        return time
    request = service.waiting.popleft()
    if cause is not None and cause.request_id is not None:
        thread.scheduler.truth.link_call.add(
            cause.request_id, cause.is_response, None, None, request.request_id
        )
    return respond(thread, service, request, time)


def respond(thread: Thread, service: ServiceObject, request: Request, time: int) -> int:
    """Send the response to a request; returns the time at which that is done."""
    machine = thread.machine
    random = service.random
    stamp = time + 300 + int(random() * 500)
    sent = stamp + 60 + int(random() * 300)
    request.stamp_ns, request.answered_ns = machine.stamp_ns(stamp), sent + machine.epoch
    request.answered_tid = thread.tid
    thread.emit(
        machine.tracepoints.rmw_send_response,
        sent,
        thread.context,
        service.rmw_handle,
        service.message,
        request.client.gid,
        request.sequence_number,
        request.stamp_ns,
    )
    service.network.send_response(sent, service, request)
    return sent + 1_500


def run_client(thread: Thread, middleware: Middleware, client: ClientObject, time: int) -> Run:
    """Take a response and do what is to be done with it, in no callback that is traced.

    Nothing is there to take if it was one to another client.
    """
    random, machine = client.random, thread.machine
    time += 1_000 + int(random() * 5_000)
    request = client.responses.popleft()
    if request is None:
        thread.emit(
            machine.tracepoints.rmw_take_response,
            time,
            thread.context,
            client.rmw_handle,
            client.message,
            client.message,
            0,
            0,
        )
        return time
    thread.emit(
        machine.tracepoints.rmw_take_response,
        time,
        thread.context,
        client.rmw_handle,
        client.message,
        request.sequence_number,
        request.stamp_ns,
        1,
    )
    request.received_tid, request.received_ns = thread.tid, time + machine.epoch
    client.answered = request.sequence_number
    if client.action is not None:
        return client.action(thread, request, time + 1_000)
    now = turn(thread, request, time, is_response=True)
    return execute(thread, middleware, client.code, time + 1_000, now)


def turn(thread: Thread, request: Request, time: int, *, is_response: bool) -> CallbackInstance:
    """What a thread does with what it took, without a callback that is traced."""
    return CallbackInstance(
        None,
        None,
        (),
        None,
        None,
        thread.tid,
        time,
        request_id=request.request_id,
        is_response=is_response,
    )


def write_request(truth: Truth, request: Request) -> None:
    """Write down a request and, if there was one, the response."""
    client, service = request.client, request.service
    place: tuple[str | None, int | None, str | None, int | None] = (None, None, None, None)
    if service is not None:
        process = service.process
        place = (process.machine.hostname, process.pid, service.node, service.handle)
    host, pid, node, handle = place
    client_host, client_pid = client.process.machine.hostname, client.process.pid
    truth.request.add(
        request.request_id,
        client.name,
        client.gid,
        request.sequence_number,
        client_host,
        client_pid,
        request.sent_tid,
        client.node,
        client.handle,
        request.sent_ns,
        request.caller,
        host,
        pid,
        request.taken_tid,
        node,
        handle,
        request.taken_ns,
        request.callback_instance_id,
    )
    if request.answered_ns is not None:
        truth.response.add(
            request.request_id,
            client.name,
            client.gid,
            request.sequence_number,
            request.stamp_ns,
            host,
            pid,
            request.answered_tid,
            request.answered_ns,
            client_host,
            client_pid,
            request.received_tid,
            request.received_ns,
        )
    goal = request.goal
    if goal is not None and goal.request is request:
        truth.goal.add(
            request.request_id,
            None if request.answered_ns is None else goal.is_accepted,
            None if goal.asking is None else goal.asking.request_id,
        )
