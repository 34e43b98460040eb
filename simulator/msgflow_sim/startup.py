"""Startup of a process, from rcl_init to spin: its events, in the order of its release of ROS 2.

The steps are separate, so that other processes start meanwhile.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow_sim import entity, symbols, system
from msgflow_sim.creation import PARAMETER_EVENTS, ROSOUT, Creator, NodeContext
from msgflow_sim.discovery import Discovery, DiscoveryListener
from msgflow_sim.entity import MICROSECOND
from msgflow_sim.executor import Executor
from msgflow_sim.executor_thread import ExecutorThread
from msgflow_sim.intra_process import publish_intra
from msgflow_sim.links import link_objects
from msgflow_sim.machine import at_once
from msgflow_sim.publication import publish
from msgflow_sim.user_thread import UserThread

if TYPE_CHECKING:
    from msgflow_sim.machine import RunningProcess, Steps
    from msgflow_sim.objects import PublisherObject
    from msgflow_sim.services import ServiceNetwork
    from msgflow_sim.transport import Middleware

_INTERNAL_DEPTH = 1000
_PARAMETER_SUBSCRIPTION = entity.Subscription(
    PARAMETER_EVENTS, work=entity.Work(700, 900), depth=_INTERNAL_DEPTH
)


class Startup:
    """Starts one process: creates its objects one by one and lets its executors spin."""

    def __init__(
        self,
        process: RunningProcess,
        middleware: Middleware,
        discovery: Discovery,
        network: ServiceNetwork,
        version: str,
    ) -> None:
        self.thread = ExecutorThread(process, process.pid, middleware)
        self._process = process
        self._middleware = middleware
        self._discovery = discovery
        self._version = version
        self._scheduler = process.scheduler
        self._executors = tuple(
            Executor(
                process.scheduler.dice(process.name, "executor", number),
                description,
                is_rclcpp=process.is_rclcpp,
                is_traced=process.is_traced,
                is_hashed=process.machine.layout.is_ready_hashed,
            )
            for number, description in enumerate(process.description.executors)
        )
        self._creator = Creator(self.thread, middleware, discovery, network)
        self._user_thread = UserThread(process, self._creator)
        self._listener: DiscoveryListener | None = None
        self._links = link_objects(process.description.nodes)
        self._created: dict[str, NodeContext] = {}
        self._steps = self._sequence()

    def begin(self, time: int, _: None = None) -> None:
        """Do the next step at `time` and plan the one after it."""
        thread = self.thread
        if self._process.is_stopped:
            return
        if later := thread.take_cpu(time):
            self._scheduler.at(later, self.begin)
            return
        self._creator.time = time
        if next(self._steps, None) is None:
            self._spin(time)
            return
        time = self._creator.time + MICROSECOND
        thread.keep_cpu(time)
        self._scheduler.at(time, self.begin)

    def end(self, time: int, _: None = None) -> None:
        """The process ends at `time`: its threads do as soon as they have executed, or at once.

        Its middleware says goodbye, unless it is killed.
        """
        self._process.is_stopped = True
        if self._listener is not None:
            self._discovery.leave(self._listener)
        self._middleware.end_process(self._process, time)
        self._user_thread.cut()
        for thread in self._process.threads:
            if thread is self.thread and not self._process.description.is_killed:
                self.thread.shut_down(time)
            else:
                thread.stop()

    def _spin(self, time: int) -> None:
        """Let all threads of all executors spin; the first one is the main thread."""
        number = 0
        for executor, description in zip(
            self._executors, self._process.description.executors, strict=True
        ):
            if description.kind == "nested":
                continue
            for _ in range(description.thread_count):
                thread = self.thread
                steps = self._main(executor, description, time)
                if number:
                    tid = self._process.description.tid(number)
                    thread = ExecutorThread(self._process, tid, self._middleware)
                    steps = thread.spin(executor, time)
                thread.begin(time, steps)
                number += 1
                time += 15 * MICROSECOND
        self._user_thread.begin_if_needed(time)

    def _main(self, executor: Executor, description: system.Executor, time: int) -> Steps:
        """What the main thread does: it spins or polls, and then ROS is shut down."""
        thread, creator = self.thread, self._creator
        if description.polled_ns is None:
            time = yield from thread.spin(executor, time)
        else:
            time = yield from thread.poll(executor, time, description.polled_ns)
        for node in self._process.description.nodes:
            if node.is_agnocast:
                continue
            time = yield time
            while later := thread.take_cpu(time):
                time = yield later
            creator.time = time
            creator.announce()
            time = thread.hold(creator.time)
        return time

    def _sequence(self) -> Iterator[bool]:
        process, creator = self._process, self._creator
        if any(not node.is_agnocast for node in process.description.nodes):
            creator.emit("rcl_init", process.memory.allocate(), self._version)
            creator.work(800 * MICROSECOND)
            if process.is_traced and not process.is_rclcpp:
                creator.emit("rclcpp_callback_register", 0, "#msgflow python 3.12.3")
            self._listener = DiscoveryListener(process)
            creator.discovery(self._listener.rmw_handle)
            self._discovery.join(self._listener)
        if any(node.is_agnocast for node in process.description.nodes):
            creator.emit("agnocast_agnocast_init", process.memory.allocate())
        for topic in process.description.readers:
            creator.reader(topic)
        names_executors = process.machine.layout.declares("ros2_caret:construct_executor")
        for executor, described in zip(self._executors, process.description.executors, strict=True):
            if executor.is_agnocast or (names_executors and process.description.nodes):
                executor.handle = process.memory.allocate()
                threads = "single" if described.thread_count == 1 else "multi"
                kind = f"{threads}_threaded_executor"
                if executor.is_agnocast:
                    creator.emit(
                        "agnocast_agnocast_construct_executor", executor.handle, f"agnocast_{kind}"
                    )
                else:
                    creator.emit("ros2_caret_construct_executor", executor.handle, kind)
        yield True
        for node in process.description.nodes:
            yield from self._create_node(node)

    def _create_node(self, node: system.Node) -> Iterator[bool]:
        creator, memory = self._creator, self._process.memory
        context = NodeContext.of(
            node, memory.allocate(), self._executors, self._links, creator.dice
        )
        self._created[node.full_name] = context
        creator.work(300 * MICROSECOND)
        for group, executor in context.groups.values():
            if executor.handle:
                group.handle = memory.allocate()
        if node.is_agnocast:
            creator.emit("agnocast_agnocast_node_init", context.handle, node.name, node.namespace)
            yield from self._create_shared(context)
            yield True
            return
        creator.announce()
        described = (context.handle, memory.allocate(), node.name, node.namespace)
        is_rosout_first = self._process.machine.layout.is_rosout_first
        if not is_rosout_first:
            creator.emit("rcl_node_init", *described)
            yield True
        # Its handle is on the stack and copied later. Until Iron it is made as part of the node.
        context.rosout = rosout = creator.publisher(
            context, entity.Publisher(ROSOUT, _INTERNAL_DEPTH), is_rclcpp=False
        )
        yield True
        if is_rosout_first:
            creator.emit("rcl_node_init", *described)
            yield True
        yield from self._create_parameters(context)
        yield from self._create_shared(context)
        self._publish(rosout)
        yield True

    def _create_shared(self, node: NodeContext) -> Iterator[bool]:
        """The objects of a node, and then its callback groups join executors that are named."""
        yield from self._create_objects(node)
        for group, executor in node.groups.values():
            kind = "reentrant" if group.is_reentrant else "mutually_exclusive"
            if executor.is_agnocast:
                self._creator.emit(
                    "agnocast_agnocast_add_callback_group",
                    executor.handle,
                    node.handle,
                    group.handle,
                    kind,
                )
            elif executor.handle:
                self._creator.emit(
                    "ros2_caret_add_callback_group", executor.handle, group.handle, kind
                )

    def _create_parameters(self, node: NodeContext) -> Iterator[bool]:
        """What every node has, but those that have said that they do without."""
        creator = self._creator
        events: PublisherObject | None = None
        if node.description.has_parameters:
            for name, symbol in symbols.parameter_services():
                service = entity.Service(f"{node.description.full_name}/{name}")
                creator.service(node, service, symbol)
                yield True
            events = creator.publisher(
                node,
                entity.Publisher(
                    PARAMETER_EVENTS,
                    _INTERNAL_DEPTH,
                    intra_process=node.description.uses_intra_process,
                ),
            )
            yield True
            # One event per parameter that is declared.
            self._publish(events)
            yield True
        if self._process.is_rclcpp:
            listener = replace(
                _PARAMETER_SUBSCRIPTION, intra_process=node.description.uses_intra_process
            )
            creator.listen(creator.subscription(node, listener, symbols.PARAMETER_EVENTS))
            yield True
        for _ in range(3 if events is not None else 0):
            assert events is not None
            self._publish(events)
            yield True

    def _create_objects(self, node: NodeContext) -> Iterator[bool]:
        creator, description = self._creator, node.description
        if description.is_managed:
            yield from self._create_lifecycle(node)
        for publisher in description.publishers:
            node.publishers[publisher.topic] = creator.publisher(node, publisher)
            yield True
        for client in description.clients:
            creator.client(node, client)
            yield True
        for subscription in description.subscriptions:
            symbol = symbols.subscription_callback(description.name, subscription.message_type)
            created = None
            if subscription.created_ns is None:
                created = creator.subscription(node, subscription, symbol)
                creator.listen(created)
                yield True
            self._user_thread.plan(node, subscription, symbol, created)
        for service in description.services:
            if _is_of_lifecycle(node, service):
                continue
            symbol = symbols.service_callback(description.name)
            creator.spin_service(creator.service(node, service, symbol))
            yield True
        for server in description.action_servers:
            creator.action_server(node, server)
            yield True
        for action_client in description.action_clients:
            creator.action_client(node, action_client)
            yield True
        for number, timer in enumerate(description.timers):
            creator.timer(node, timer, number)
            yield True
        if description.links:
            creator.links(node, self._created)
            yield True

    def _create_lifecycle(self, node: NodeContext) -> Iterator[bool]:
        """The state machine of a managed node, behind its services and before their callbacks."""
        creator, services = self._creator, []
        events = creator.publisher(
            node, entity.Publisher(f"{node.description.full_name}/transition_event", kind="rcl")
        )
        yield True
        described = {service.name: service for service in node.description.services}
        for name in symbols.LIFECYCLE_SERVICES:
            full_name = f"{node.description.full_name}/{name}"
            service = described.get(full_name, entity.Service(full_name))
            services.append(creator.rcl_service(node, service))
            yield True
        creator.lifecycle(node, events)
        for created in services:
            creator.copied_service(created, symbols.service_callback("lifecycle_node"))
            creator.spin_service(created)
        yield True

    def _publish(self, publisher: PublisherObject) -> None:
        creator, thread, middleware = self._creator, self.thread, self._middleware
        creator.work(8 * MICROSECOND)
        if publisher.intra is None:
            creator.time = publish(thread, middleware, publisher, creator.time, None)
            return
        # No other thread of the process reads the buffers yet.
        creator.time = at_once(publish_intra(thread, middleware, publisher, creator.time, None))


def _is_of_lifecycle(node: NodeContext, service: entity.Service) -> bool:
    names = {f"{node.description.full_name}/{name}" for name in symbols.LIFECYCLE_SERVICES}
    return node.description.is_managed and service.name in names
