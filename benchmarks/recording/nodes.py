"""One process of a system of real ROS 2 nodes, which write down what they do.

    python nodes.py SYSTEM PROCESS TRUTH

It says `ready` when its nodes spin, and ends when its standard input does.

Needs rclpy and no package of msgflow: another Python runs it. The rows of TRUTH are JSON, a line
each: `callback` (what ran, with which message), `publication`, `request` and `response` (what was
sent, in which callback, and, if it is feedback, for which goal). Times are of CLOCK_MONOTONIC,
around the call.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import json
import os
import queue
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random

import rclpy
from rcl_interfaces.srv import ListParameters
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNodeMixin
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import UInt64
from test_msgs.action import Fibonacci

try:
    from rclpy.experimental import EventsExecutor
except ImportError:  # Jazzy
    EventsExecutor = None


class Witness(Node):
    """A node that writes down its callbacks and what it sends.

    Ids of messages and requests are unique in the system: process, then a running number.
    """

    def __init__(self, name: str, truth: Truth) -> None:
        super().__init__(name)
        self._truth = truth
        self._name = self.get_fully_qualified_name()
        self._ids = itertools.count(os.getpid() << 32)
        # Also of one that comes again with its name.
        self._numbers = itertools.count((os.getpid() << 32) + 1)
        self._running = threading.local()
        self._actions = []
        self.ending = threading.Event()
        self.turn = None

    def every(self, seconds: float, work, group=None):
        """Do some work at a period; return the timer."""

        def run() -> None:
            begin = time.monotonic_ns()
            with self._callback(begin, "timer", str(seconds), 0) as row:
                work()
            row["t1"] = time.monotonic_ns()

        return self.create_timer(seconds, run, callback_group=group)

    def on(self, topic: str, work, group=None):
        """Do some work with each message of a topic; return the subscription."""

        def run(message: UInt64) -> None:
            begin = time.monotonic_ns()
            with self._callback(begin, "sub", topic, message.data) as row:
                work()
            row["t1"] = time.monotonic_ns()

        return self.create_subscription(UInt64, topic, run, 10, callback_group=group)

    def on_awaiting(self, topic: str, seconds: float, work, group=None) -> None:
        """Do some work with each message of a topic, some time after it came.

        The callback is a coroutine: it is written down when it begins, and what it sends names it.
        """

        async def run(message: UInt64) -> None:
            begin = time.monotonic_ns()
            with self._callback(begin, "sub", topic, message.data) as row:
                call = self._running.number
                over = Future()
                timer = self.create_timer(seconds, lambda: over.set_result(None))
            row["t1"] = time.monotonic_ns()
            await over
            timer.cancel()
            self.destroy_timer(timer)
            work(call=call)

        self.create_subscription(UInt64, topic, run, 10, callback_group=group)

    def on_working(self, topic: str, *starts) -> None:
        """Start jobs with each message of a topic: each of `starts` is given what to run."""

        def run(message: UInt64) -> None:
            begin = time.monotonic_ns()
            with self._callback(begin, "sub", topic, message.data) as row:
                for start, work in starts:
                    start(functools.partial(work, call=self._running.number))
            row["t1"] = time.monotonic_ns()

        self.create_subscription(UInt64, topic, run, 10)

    def after_turns(self, seconds: float, work) -> None:
        """Do some work at a period, between turns of the executor: no callback, no timer."""
        self.turn = (seconds, work)

    def serve(self, service: str, work) -> None:
        """Do some work for each request, and answer."""

        def run(request: ListParameters.Request, response: ListParameters.Response):
            begin = time.monotonic_ns()
            with self._callback(begin, "service", service, request.depth) as row:
                work()
            row["t1"] = time.monotonic_ns()
            response.result.names = [str(request.depth)]
            return response

        self.create_service(ListParameters, service, run)

    def serve_by(self, service: str, other: str, work, group=None) -> None:
        """Ask another service for each request, do some work when it has answered, and answer."""
        client = self.create_client(ListParameters, other, callback_group=group)

        async def run(request: ListParameters.Request, response: ListParameters.Response):
            begin = time.monotonic_ns()
            with self._callback(begin, "service", service, request.depth) as row:
                call = self._running.number
                asked = ListParameters.Request(depth=next(self._ids))
                with self._sent("request", other, asked.depth):
                    future = client.call_async(asked)
            row["t1"] = time.monotonic_ns()
            await future
            work(call=call)
            response.result.names = [str(request.depth)]
            return response

        self.create_service(ListParameters, service, run, callback_group=group)

    def waiting_caller(self, service: str, group=None):
        """Return a function that sends a request, and waits for its answer on its thread."""
        client = self.create_client(ListParameters, service, callback_group=group)

        def send() -> None:
            if client.service_is_ready():
                request = ListParameters.Request(depth=next(self._ids))
                with self._sent("request", service, request.depth):
                    future = client.call_async(request)
                answered = threading.Event()
                future.add_done_callback(lambda _: answered.set())
                answered.wait(1.0)

        return send

    def publisher(self, topic: str):
        """Return a new publisher."""
        return self.create_publisher(UInt64, topic, 10)

    def sender(self, topic: str):
        """Return a function that publishes a message to a topic."""
        publisher = self.publisher(topic)

        def send(**more: int) -> None:
            message = UInt64(data=next(self._ids))
            with self._sent("publication", topic, message.data, **more):
                publisher.publish(message)

        return send

    def caller(self, service: str, work):
        """Return a function that sends a request, and does some work when the answer comes."""
        client = self.create_client(ListParameters, service)

        def answered(future) -> None:
            (answer,) = future.result().result.names
            with self._callback(time.monotonic_ns(), "client", service, int(answer)):
                work()

        def send() -> None:
            if client.service_is_ready():
                request = ListParameters.Request(depth=next(self._ids))
                with self._sent("request", service, request.depth):
                    future = client.call_async(request)
                future.add_done_callback(answered)

        return send

    def act(self, action: str, work, messages: int, other: str | None = None) -> None:
        """Execute goals: do some work before each message of feedback. Each fifth is rejected.

        Args:
            action: its name.
            work: what is done.
            messages: how many there are for each goal.
            other: an action whose result is awaited behind each message: execution is a coroutine.
        """

        # What accepted a goal is the reason for all that its execution does.
        accepted = {}
        ask = None if other is None else self._asker(other, ReentrantCallbackGroup())

        def decide(goal: Fibonacci.Goal) -> GoalResponse:
            is_accepted = goal.order % 5 != 0
            begin, name = time.monotonic_ns(), f"{action}/_action/send_goal"
            with self._callback(begin, "service", name, goal.order, is_accepted) as row:
                accepted[goal.order] = self._running.number
            row["t1"] = time.monotonic_ns()
            return GoalResponse.ACCEPT if is_accepted else GoalResponse.REJECT

        def execute(goal) -> Fibonacci.Result:
            number = goal.request.order
            for _ in range(messages):
                work()
                if goal.is_cancel_requested:
                    goal.canceled()
                    return Fibonacci.Result()
                feed(goal, number)
            goal.succeed()
            return Fibonacci.Result(sequence=[number])

        async def execute_awaiting(goal) -> Fibonacci.Result:
            number = goal.request.order
            for _ in range(messages):
                work(call=accepted[number])
                feed(goal, number)
                await ask(accepted[number])
            work(call=accepted[number])
            goal.succeed()
            return Fibonacci.Result(sequence=[number])

        def feed(goal, number: int) -> None:
            message = next(self._ids)
            place = {"goal": number, "call": accepted[number]}
            with self._sent("publication", f"{action}/_action/feedback", message, **place):
                # Numbers of 32 bits.
                sequence = [number, message >> 32, message % (1 << 32)]
                goal.publish_feedback(Fibonacci.Feedback(sequence=sequence))

        self._actions.append(
            ActionServer(
                self, Fibonacci, action, execute if ask is None else execute_awaiting,
                callback_group=ReentrantCallbackGroup(),
                goal_callback=decide, cancel_callback=lambda goal: CancelResponse.ACCEPT,
            )
        )  # fmt: skip

    def sender_of_goals(self, action: str):
        """Return a function that sends a goal, and asks for its result; cancels each seventh."""
        client = ActionClient(self, Fibonacci, action)
        goals = itertools.count(1)

        def send() -> None:
            if client.server_is_ready():
                number = next(goals)
                with self._sent("request", f"{action}/_action/send_goal", number):
                    future = client.send_goal_async(Fibonacci.Goal(order=number))
                future.add_done_callback(lambda future: answered(number, future.result()))

        def answered(number: int, goal) -> None:
            with self._callback(
                time.monotonic_ns(), "client", f"{action}/_action/send_goal", number
            ):
                if goal.accepted:
                    with self._sent("request", f"{action}/_action/get_result", number):
                        future = goal.get_result_async()
                    future.add_done_callback(lambda _: finished(number))
                    if number % 7 == 0:
                        goal.cancel_goal_async()

        def finished(number: int) -> None:
            with self._callback(
                time.monotonic_ns(), "client", f"{action}/_action/get_result", number
            ):
                pass

        return send

    def pursue(self, heard: str, action: str, group=None) -> None:
        """Send a goal for each message of a topic, and publish when it is accepted and is over.

        The callback is a coroutine. Each message of feedback is answered on /fed.
        """
        ask = self._asker(action, group, self.sender("/fed"))
        accepted, ended = self.sender("/accepted"), self.sender("/result")

        async def run(message: UInt64) -> None:
            begin = time.monotonic_ns()
            with self._callback(begin, "sub", heard, message.data) as row:
                call = self._running.number
            row["t1"] = time.monotonic_ns()
            await ask(call, lambda: accepted(call=call))
            ended(call=call)

        self.create_subscription(UInt64, heard, run, 10, callback_group=group)

    def _asker(self, action: str, group, answer=None):
        """Return a coroutine that sends a goal and awaits its result, for a callback."""
        client = ActionClient(self, Fibonacci, action, callback_group=group)
        goals = itertools.count(1)

        def fed(message) -> None:
            _, high, low = message.feedback.sequence
            name = f"{action}/_action/feedback"
            with self._callback(time.monotonic_ns(), "sub", name, (high << 32) + low):
                if answer is not None:
                    answer()

        async def ask(call: int, accepted=lambda: None) -> None:
            number = next(goals)
            with self._sent("request", f"{action}/_action/send_goal", number, call=call):
                future = client.send_goal_async(Fibonacci.Goal(order=number), fed)
            goal = await future
            accepted()
            if goal.accepted:
                with self._sent("request", f"{action}/_action/get_result", number, call=call):
                    future = goal.get_result_async()
                await future

        return ask

    @contextlib.contextmanager
    def _callback(self, begin: int, kind: str, name: str, message: int, accepted=None):
        """Write down a callback, whose row it yields: a caller who is nearer knows its end."""
        number = self._running.number = next(self._numbers)
        row = {"kind": kind, "name": name, "id": message, "n": number, "accepted": accepted}
        try:
            yield row
        finally:
            self._running.number = 0
            self._write("callback", begin, row)

    @contextlib.contextmanager
    def _sent(self, kind: str, topic: str, message: int, **more: int):
        begin = time.monotonic_ns()
        yield
        number = getattr(self._running, "number", 0)
        self._write(kind, begin, {"topic": topic, "id": message, "cb": number, **more})

    def _write(self, what: str, begin: int, row: dict[str, object]) -> None:
        end = time.monotonic_ns()
        place = {"node": self._name, "pid": os.getpid(), "tid": threading.get_native_id()}
        row.update(k=what, t0=begin, t1=end, **place)
        self._truth.write(row)


class Truth:
    """The rows of a process: what happened."""

    def __init__(self) -> None:
        self._rows = []

    def write(self, row: dict[str, object]) -> None:
        """Add a row: what takes time comes later, since a callback waits."""
        self._rows.append(row)

    def save(self, path: Path) -> None:
        """Write all rows, a line each, after what an earlier life of the process wrote."""
        with path.open("a") as file:
            file.writelines(f"{json.dumps(row)}\n" for row in self._rows)


def busy(seconds: float) -> None:
    """Use the CPU for so long."""
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass


def take_turns(executor, seconds: float, work) -> None:
    """Let an executor do what is due, and some work at a period, until ROS shuts down."""
    due = time.monotonic()
    while rclpy.ok():
        executor.spin_once(max(0.0, due - time.monotonic()))
        if time.monotonic() >= due:
            work()
            due += seconds


def source(truth: Truth) -> list[Node]:
    """Publish /scan with a period of 50 ms."""
    node = Witness("source", truth)
    node.every(0.05, node.sender("/scan"))
    return [node]


def relay(truth: Truth, name: str = "filter", heard: str = "/scan", said: str = "/filtered"):
    """Answer each message of a topic after a millisecond."""
    node = Witness(name, truth)
    send = node.sender(said)

    def work() -> None:
        busy(0.001)
        send()

    node.on(heard, work)
    return [node]


def sink(truth: Truth) -> list[Node]:
    """Hear what others publish."""
    node = Witness("sink", truth)
    for topic in ("/filtered", "/tick", "/result"):
        node.on(topic, lambda: busy(0.000_2))
    return [node]


def relay_with_timer(truth: Truth) -> list[Node]:
    """Answer each message, and publish /tick with a period of its own."""
    (node,) = relay(truth)
    node.every(0.02, node.sender("/tick"))
    return [node]


def server(truth: Truth) -> list[Node]:
    """Answer requests, and publish a message meanwhile."""
    node = Witness("server", truth)
    node.serve("/answer", node.sender("/filtered"))
    return [node]


def client(truth: Truth) -> list[Node]:
    """Send a request each 60 ms, and publish /result when it is answered."""
    node = Witness("client", truth)
    node.every(0.06, node.caller("/answer", node.sender("/result")))
    return [node]


def several(truth: Truth) -> list[Node]:
    """Three nodes for one executor, one with callbacks that may run side by side."""
    node = Witness("reentrant", truth)
    group = ReentrantCallbackGroup()
    send = node.sender("/tick")
    node.on("/scan", lambda: (time.sleep(0.03), send()), group)
    exclusive = Witness("exclusive", truth)
    one = MutuallyExclusiveCallbackGroup()
    result = exclusive.sender("/result")
    exclusive.on("/tick", lambda: (busy(0.001), result()), one)
    exclusive.every(0.035, lambda: busy(0.000_5), one)
    return [node, exclusive, *relay(truth)]


def actor(truth: Truth) -> list[Node]:
    """Execute goals of two actions."""
    node = Witness("actor", truth)
    node.act("/dock", lambda: time.sleep(0.01), 3)
    node.act("/move", lambda: time.sleep(0.03), 5)
    return [node]


def asker(truth: Truth) -> list[Node]:
    """Send goals: of one action when the last one is over, of the other one sooner."""
    node = Witness("asker", truth)
    node.every(0.08, node.sender_of_goals("/dock"))
    node.every(0.11, node.sender_of_goals("/move"))
    return [node]


def commander(truth: Truth) -> list[Node]:
    """Send a goal for each message of /scan, and await its result; also answer /tick at once."""
    node = Witness("commander", truth)
    node.pursue("/scan", "/move", ReentrantCallbackGroup())
    send = node.sender("/filtered")
    node.on("/tick", lambda: (busy(0.000_5), send()))
    return [node]


def mover(truth: Truth) -> list[Node]:
    """Execute goals, each with goals of another action, which are awaited; also answer /tick."""
    node = Witness("mover", truth)
    node.act("/move", node.sender("/progress"), 3, "/grip")
    send = node.sender("/heard")
    node.on("/tick", lambda: (busy(0.000_5), send()))
    return [node]


def both(truth: Truth) -> list[Node]:
    """Send goals, and execute them, in one executor."""
    return [*commander(truth), *mover(truth)]


def gripper(truth: Truth) -> list[Node]:
    """Execute goals."""
    node = Witness("gripper", truth)
    node.act("/grip", lambda: time.sleep(0.002), 2)
    return [node]


def goal_sink(truth: Truth) -> list[Node]:
    """Hear what is published for goals."""
    node = Witness("goal_sink", truth)
    for topic in ("/fed", "/accepted", "/result", "/progress", "/filtered", "/heard"):
        node.on(topic, lambda: busy(0.000_2))
    return [node]


def beating(truth: Truth) -> list[Node]:
    """Publish /scan and, more often, /tick."""
    node = Witness("beating", truth)
    node.every(0.09, node.sender("/scan"))
    node.every(0.011, node.sender("/tick"))
    return [node]


def three_nodes(truth: Truth) -> list[Node]:
    """Three nodes for one executor, which is busy: two answer messages, one has a timer."""
    timer = Witness("timer", truth)
    tick = timer.sender("/tick")
    timer.every(0.02, lambda: (busy(0.004), tick()))
    answering = relay(truth, "answering", "/tick", "/result")
    return [timer, *answering, *relay(truth)]


def looping(truth: Truth) -> list[Node]:
    """Hear /scan, and publish /tick by a clock of its own, between two turns of the executor."""
    node = Witness("looping", truth)
    node.on("/scan", lambda: busy(0.001))
    node.after_turns(0.04, node.sender("/tick"))
    return [node]


def deaf(truth: Truth) -> list[Node]:
    """Hear /filtered, and destroy the subscription when enough has come; /scan goes on."""
    node = Witness("deaf", truth)
    left = itertools.count(20, -1)

    def work() -> None:
        if next(left) == 0:
            node.destroy_subscription(subscription)

    subscription = node.on("/filtered", work)
    node.on("/scan", lambda: None)
    return [node]


def hanging(truth: Truth) -> list[Node]:
    """Hear /filtered; one of the callbacks does not return until the system ends."""
    node = Witness("hanging", truth)
    left = itertools.count(20, -1)
    node.on("/filtered", lambda: node.ending.wait() if next(left) == 0 else None)
    return [node]


def resetting(truth: Truth) -> list[Node]:
    """Publish /tick after a pause: each message of /scan starts the period of the timer anew.

    Another timer is cancelled, and goes on later.
    """
    node = Witness("resetting", truth)
    watchdog = node.every(0.03, node.sender("/tick"))
    node.on("/scan", watchdog.reset)
    paused = node.every(0.025, node.sender("/result"))
    turns = itertools.count()
    node.every(0.31, lambda: paused.cancel() if next(turns) % 2 == 0 else paused.reset())
    return [node]


class PlannedError(Exception):
    """What a callback raises on purpose."""


def raising(truth: Truth) -> list[Node]:
    """Answer each message; the callback of each fifth raises, and the node goes on."""
    node = Witness("raising", truth)
    send = node.sender("/filtered")
    turns = itertools.count()

    def work() -> None:
        send()
        if next(turns) % 5 == 0:
            raise PlannedError

    node.on("/scan", work)
    return [node]


def awaiting(truth: Truth) -> list[Node]:
    """Answer each message of /scan after 40 ms, while those of /tick are answered at once.

    Several callbacks of /scan go on at the same time.
    """
    node = Witness("awaiting", truth)
    node.on_awaiting("/scan", 0.04, node.sender("/filtered"), ReentrantCallbackGroup())
    result = node.sender("/result")
    node.on("/tick", lambda: (busy(0.001), result()))
    return [node]


def working(truth: Truth) -> list[Node]:
    """Answer each message of /scan on other threads, after 5 to 80 ms: several at a time."""
    node = Witness("working", truth)
    pool, waiting = ThreadPoolExecutor(3), queue.Queue()
    random = Random(1)

    def later(send):
        def work(**more: int) -> None:
            time.sleep(random.uniform(0.005, 0.08))
            send(**more)

        return work

    def work_off() -> None:
        while True:
            waiting.get()()

    threading.Thread(target=work_off, daemon=True).start()
    node.on_working(
        "/scan",
        (pool.submit, later(node.sender("/pooled"))),
        (lambda work: pool.submit(time.sleep, 0.02).add_done_callback(lambda _: work()),
         node.sender("/done")),
        (lambda work: threading.Thread(target=work).start(), later(node.sender("/threaded"))),
        (lambda work: threading.Timer(random.uniform(0.01, 0.1), work).start(),
         node.sender("/timed")),
        (waiting.put, later(node.sender("/queued"))),
    )  # fmt: skip
    result = node.sender("/result")
    node.on("/tick", lambda: (busy(0.001), result()))
    return [node]


def ticking(truth: Truth) -> list[Node]:
    """Publish /scan and, more often, /tick."""
    node = Witness("ticking", truth)
    node.every(0.05, node.sender("/scan"))
    node.every(0.031, node.sender("/tick"))
    return [node]


class Managed(LifecycleNodeMixin, Witness):
    """A managed node."""

    def __init__(self, name: str, truth: Truth) -> None:
        Witness.__init__(self, name, truth)
        LifecycleNodeMixin.__init__(self)

    def publisher(self, topic: str):
        """Return one that publishes while the node is active."""
        return self.create_lifecycle_publisher(UInt64, topic, 10)


def managed(truth: Truth) -> list[Node]:
    """Answer each message while active: a timer activates the node, and deactivates it."""
    node = Managed("managed", truth)
    send = node.sender("/filtered")
    is_active = [False]

    def turn() -> None:
        (node.trigger_deactivate if is_active[0] else node.trigger_activate)()
        is_active[0] = not is_active[0]

    node.trigger_configure()
    node.on("/scan", lambda: send() if is_active[0] else None)
    node.every(0.3, turn)
    return [node]


def between(truth: Truth) -> list[Node]:
    """Answer requests with the answer of another service, and publish a message before that."""
    node = Witness("between", truth)
    node.serve_by("/answer", "/other", node.sender("/filtered"), ReentrantCallbackGroup())
    return [node]


def other(truth: Truth) -> list[Node]:
    """Answer requests."""
    node = Witness("other", truth)
    node.serve("/other", lambda: busy(0.001))
    return [node]


def waiting(truth: Truth) -> list[Node]:
    """Send a request for each message, wait for its answer, and publish a message."""
    node = Witness("waiting", truth)
    group = ReentrantCallbackGroup()
    ask, send = node.waiting_caller("/other", group), node.sender("/tick")
    node.on("/scan", lambda: (ask(), send()), group)
    return [node]


SYSTEMS = {
    "pipeline": {"sink": (sink, SingleThreadedExecutor), "filter": (relay, SingleThreadedExecutor),
                 "source": (source, SingleThreadedExecutor)},
    "timer": {"sink": (sink, SingleThreadedExecutor),
              "filter": (relay_with_timer, SingleThreadedExecutor),
              "source": (source, SingleThreadedExecutor)},
    "services": {"sink": (sink, SingleThreadedExecutor), "server": (server, SingleThreadedExecutor),
                 "client": (client, SingleThreadedExecutor)},
    "multi_threaded": {"sink": (sink, SingleThreadedExecutor),
                       "several": (several, MultiThreadedExecutor),
                       "source": (source, SingleThreadedExecutor)},
    "actions": {"actor": (actor, MultiThreadedExecutor), "asker": (asker, SingleThreadedExecutor)},
    "events": {"sink": (sink, EventsExecutor), "filter": (relay, EventsExecutor),
               "source": (source, EventsExecutor)},
    "three_nodes": {"sink": (sink, SingleThreadedExecutor),
                    "three": (three_nodes, SingleThreadedExecutor),
                    "source": (source, SingleThreadedExecutor)},
    "looping": {"sink": (sink, SingleThreadedExecutor),
                "looping": (looping, SingleThreadedExecutor),
                "source": (source, SingleThreadedExecutor)},
    "two_domains": {"sink": (sink, SingleThreadedExecutor),
                    "filter": (relay, SingleThreadedExecutor),
                    "source": (source, SingleThreadedExecutor),
                    "other": (sink, SingleThreadedExecutor)},
    "destroyed": {"deaf": (deaf, SingleThreadedExecutor),
                  "filter": (relay, SingleThreadedExecutor),
                  "source": (source, SingleThreadedExecutor)},
    "hanging": {"hanging": (hanging, SingleThreadedExecutor),
                "sink": (sink, SingleThreadedExecutor),
                "filter": (relay, SingleThreadedExecutor),
                "source": (source, SingleThreadedExecutor)},
    "resetting": {"sink": (sink, SingleThreadedExecutor),
                  "resetting": (resetting, SingleThreadedExecutor),
                  "source": (source, SingleThreadedExecutor)},
    "raising": {"sink": (sink, SingleThreadedExecutor),
                "raising": (raising, SingleThreadedExecutor),
                "source": (source, SingleThreadedExecutor)},
    "managed": {"sink": (sink, SingleThreadedExecutor),
                "managed": (managed, SingleThreadedExecutor),
                "source": (source, SingleThreadedExecutor)},
    "calling": {"sink": (sink, SingleThreadedExecutor), "other": (other, SingleThreadedExecutor),
                "between": (between, SingleThreadedExecutor),
                "waiting": (waiting, MultiThreadedExecutor),
                "client": (client, SingleThreadedExecutor),
                "source": (source, SingleThreadedExecutor)},
    "restarts": {"sink": (sink, SingleThreadedExecutor), "filter": (relay, SingleThreadedExecutor),
                 "source": (source, SingleThreadedExecutor)},
    "late": {"sink": (sink, SingleThreadedExecutor),
             "several": (several, MultiThreadedExecutor),
             "source": (source, SingleThreadedExecutor)},
    "mixed": {"sink": (sink, SingleThreadedExecutor),
              "filter": (relay_with_timer, SingleThreadedExecutor),
              "source": (source, SingleThreadedExecutor)},
    "goals": {"sink": (goal_sink, SingleThreadedExecutor),
              "gripper": (gripper, SingleThreadedExecutor),
              "mover": (mover, SingleThreadedExecutor),
              "commander": (commander, SingleThreadedExecutor),
              "beating": (beating, SingleThreadedExecutor)},
    "goals_together": {"sink": (goal_sink, SingleThreadedExecutor),
                       "gripper": (gripper, SingleThreadedExecutor),
                       "both": (both, MultiThreadedExecutor),
                       "beating": (beating, SingleThreadedExecutor)},
    "goals_threads": {"sink": (goal_sink, SingleThreadedExecutor),
                      "gripper": (gripper, MultiThreadedExecutor),
                      "mover": (mover, MultiThreadedExecutor),
                      "commander": (commander, MultiThreadedExecutor),
                      "beating": (beating, SingleThreadedExecutor)},
    "awaiting": {"sink": (sink, SingleThreadedExecutor),
                 "awaiting": (awaiting, SingleThreadedExecutor),
                 "ticking": (ticking, SingleThreadedExecutor)},
    "awaiting_threads": {"sink": (sink, SingleThreadedExecutor),
                         "awaiting": (awaiting, MultiThreadedExecutor),
                         "ticking": (ticking, SingleThreadedExecutor)},
    "working": {"sink": (sink, SingleThreadedExecutor), "working": (working, MultiThreadedExecutor),
                "ticking": (ticking, SingleThreadedExecutor)},
}  # fmt: skip
if EventsExecutor is None:
    del SYSTEMS["events"]
# The domains of processes that do not hear the others.
DOMAINS = {"other": 7}


def main() -> None:
    """Run a process of a system until the standard input ends."""
    system, process, path = sys.argv[1:]
    make, executor_class = SYSTEMS[system][process]
    truth = Truth()
    rclpy.init(domain_id=DOMAINS.get(process))
    executor = executor_class()
    nodes = make(truth)
    for node in nodes:
        executor.add_node(node)

    def finish() -> None:
        sys.stdin.read()
        for node in nodes:
            node.ending.set()
        rclpy.shutdown()

    end = threading.Thread(target=finish)
    end.start()
    print("ready", flush=True)
    try:
        # Its spin() of rclpy 9.1 does nothing but use the CPU.
        while system == "events" and rclpy.ok():
            executor.spin_once(0.1)
        for seconds, work in filter(None, (node.turn for node in nodes)):
            take_turns(executor, seconds, work)
        while rclpy.ok():
            with contextlib.suppress(PlannedError):
                executor.spin()
    except ExternalShutdownException:
        pass
    except Exception:
        # A callback may run while ROS shuts down.
        if rclpy.ok():
            raise
    end.join()
    truth.save(Path(path))
    # Threads of the middleware may still call Python while it ends.
    os._exit(0)


if __name__ == "__main__":
    main()
