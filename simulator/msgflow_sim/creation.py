"""Creation of the objects of a process: the events of their initialisation, in order.

What DDS and the middleware layer do for each is in `Creator` too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from msgflow_sim import entity, symbols
from msgflow_sim.actions import Lifecycle, NodeObjects, deeds
from msgflow_sim.entity import MICROSECOND
from msgflow_sim.executor import CallbackGroup, Executor
from msgflow_sim.goals import (
    FEEDBACK,
    SERVICES,
    STATUS,
    ActionClientObject,
    ActionServerObject,
    GoalThread,
    name_of,
)
from msgflow_sim.intra_process import put
from msgflow_sim.links import CallbackLinks, LinkObject
from msgflow_sim.objects import (
    IntraBuffer,
    IntraProcess,
    PublisherObject,
    RingBuffer,
    SubscriptionObject,
    TimerObject,
    UserCode,
)
from msgflow_sim.rmw import entity_of
from msgflow_sim.services import ClientObject, ServiceNetwork, ServiceObject

if TYPE_CHECKING:
    from msgflow_sim import system
    from msgflow_sim.discovery import Discovery
    from msgflow_sim.machine import Thread
    from msgflow_sim.scheduler import Dice
    from msgflow_sim.transport import Middleware

ROSOUT = "/rosout"
PARAMETER_EVENTS = "/parameter_events"
INTERNAL_TOPICS = frozenset({ROSOUT, PARAMETER_EVENTS})
_WRITER, _READER = 3, 4
# Those before it are of executors, the last one is the user's.
_FIRST_GOAL_THREAD = 4


@dataclass(slots=True)
class NodeContext:
    """A node that exists: what its other objects are created with."""

    description: system.Node
    handle: int
    groups: Mapping[str, tuple[CallbackGroup, Executor]]
    objects: NodeObjects
    links: tuple[LinkObject, ...] = ()
    publishers: dict[str, PublisherObject] = field(default_factory=dict)
    rosout: PublisherObject | None = None

    @classmethod
    def of(
        cls,
        node: system.Node,
        handle: int,
        executors: Sequence[Executor],
        links: Iterable[LinkObject],
        random_of: Callable[..., Dice],
    ) -> NodeContext:
        """A node without objects, with those of the links of its process that it has part in."""
        place = random_of(node.full_name)()
        groups = {"": (CallbackGroup(place=place, node_place=place), executors[node.executor])}
        for group in node.groups:
            number = node.executor if group.executor is None else group.executor
            place_of_group = random_of(node.full_name, group.name)()
            made = CallbackGroup(group.is_reentrant, place=place_of_group, node_place=place)
            groups[group.name] = (made, executors[number])
        own = tuple(link for link in links if node.full_name in {link.filled_by, link.used_by})
        publishers: dict[str, PublisherObject] = {}
        objects = NodeObjects(executors, publishers)
        return cls(node, handle, groups, objects, own, publishers)


class Creator:
    """Creates objects of a process on one of its threads.

    `time` is how far it has come; `random` says how long it takes.
    """

    def __init__(
        self, thread: Thread, middleware: Middleware, discovery: Discovery, network: ServiceNetwork
    ) -> None:
        self.time = 0
        self.thread = thread
        self.middleware = middleware
        self._discovery = discovery
        self._network = network
        self._process = thread.process
        self.random = self.dice("creation")
        self._memory = thread.process.memory
        self._tracepoints = thread.machine.tracepoints
        # Since Jazzy generic publishers, serialised and loaned messages have events.
        self._is_every_kind_traced = thread.machine.layout.is_stamped_by_rmw
        # CARET tells what is in callback groups.
        self._names_groups = thread.machine.layout.declares("ros2_caret:add_callback_group")
        self._announcer = self._memory.allocate()
        self._announcement = self._memory.on_stack()
        # DDS has writers of its own, which tell others what there is.
        self._discovery_writers = tuple(self._memory.allocate() for _ in range(3))

    def on(self, thread: Thread) -> Creator:
        """One that creates objects of the same process on another thread."""
        other = object.__new__(Creator)
        other.__dict__.update(self.__dict__)
        other.thread = thread
        return other

    def dice(self, *names: object) -> Dice:
        """Random numbers for an object of the process."""
        return self.thread.scheduler.dice(self._process.name, *names)

    def emit(self, name: str, *values: object) -> None:
        """Emit an event a little later than the one before."""
        thread = self.thread
        self.time += 300 + int(self.random() * 1_500)
        thread.emit(getattr(self._tracepoints, name), self.time, thread.context, *values)

    def _emit_of_rclcpp(self, name: str, *values: object) -> None:
        if self._process.is_traced:
            self.emit(name, *values)

    def work(self, duration: int) -> None:
        """Let time pass."""
        self.time += duration // 2 + int(self.random() * duration)

    def announce(self) -> None:
        """Tell other processes what there is."""
        self.time = self._discovery.announce(
            self.thread, self._announcer, self._announcement, self.time + 500, self.random
        )

    def discovery(self, rmw_handle: int) -> None:
        """The middleware's own publisher and its subscription of this handle."""
        self._writer(self._announcer, "ros_discovery_info")
        self._reader(rmw_handle, "ros_discovery_info")

    def publisher(
        self, node: NodeContext, description: entity.Publisher, *, is_rclcpp: bool = True
    ) -> PublisherObject:
        """A publisher; those that are not of rclcpp have a handle that is copied later."""
        self.work(250 * MICROSECOND)
        memory, topic = self._memory, description.topic
        if description.is_agnocast:
            handle = memory.allocate()
            self.emit(
                "agnocast_agnocast_publisher_init", handle, node.handle, topic, description.depth
            )
            shared = PublisherObject(
                self._process,
                node.description.full_name,
                topic,
                handle,
                handle,
                0,
                memory.on_stack(),
                True,
                False,
                self.time,
                [],
                description,
            )
            self.middleware.add_publisher(shared)
            return shared
        address: Callable[[], int] = memory.allocate if is_rclcpp else memory.on_stack
        rmw_handle, init_handle = memory.allocate(), address()
        self._writer(rmw_handle, f"rt{topic}")
        self.announce()
        self.emit(
            "rcl_publisher_init", init_handle, node.handle, rmw_handle, topic, description.depth
        )
        handle = init_handle
        while not is_rclcpp and handle == init_handle:
            handle = memory.on_stack()
        intra = None
        if description.intra_process:
            intra = IntraProcess([], None)
            if description.transient_local:
                intra.kept = RingBuffer(memory.allocate(), description.depth)
                self.emit("rclcpp_construct_ring_buffer", intra.kept.handle, description.depth)
                self.emit("rclcpp_buffer_to_ipb", intra.kept.handle, memory.allocate())
        publisher = PublisherObject(
            self._process,
            node.description.full_name,
            topic,
            init_handle,
            handle,
            rmw_handle,
            memory.on_stack(),
            is_rclcpp and self._process.is_rclcpp and description.kind not in {"serialized", "rcl"},
            topic in INTERNAL_TOPICS,
            self.time,
            [],
            description,
            intra,
            description.kind not in {"typed", "rcl"} and not self._is_every_kind_traced,
        )
        self.middleware.add_publisher(publisher)
        return publisher

    def subscription(
        self, node: NodeContext, description: entity.Subscription, symbol: str
    ) -> SubscriptionObject:
        """A subscription, which gets messages once it has been given to `listen`."""
        self.work(400 * MICROSECOND)
        memory, topic = self._memory, description.topic
        rmw_handle, handle = memory.allocate(), memory.allocate()
        subscription, callback = memory.allocate(), memory.allocate()
        group, executor = node.groups[description.group]
        if description.is_agnocast:
            rmw_handle = 0
            callback = 0 if description.polled else self._next_callback()
            self.emit(
                "agnocast_agnocast_subscription_init",
                handle,
                node.handle,
                memory.on_stack(),
                group.handle,
                f"dummy_take{topic}" if description.polled else symbol,
                topic,
                description.depth,
                callback,
                callback,
            )
            begin = self.time
        else:
            self._reader(rmw_handle, f"rt{topic}")
            begin = self.time
            self.announce()
            self.emit(
                "rcl_subscription_init", handle, node.handle, rmw_handle, topic, description.depth
            )
        code = self._code(node, description, executor, topic)
        publishes = description.publishes or any(
            isinstance(action, entity.Publish) for action in description.does
        )
        created = SubscriptionObject(
            next(self.thread.scheduler.subscription_ids),
            self._process,
            executor,
            group,
            description,
            node.description.full_name,
            handle,
            rmw_handle,
            callback,
            memory.allocate(),
            code,
            self._process.is_rclcpp and description.kind != "serialized",
            topic in INTERNAL_TOPICS,
            not publishes and not (code.links and code.links.inputs),
            begin,
        )
        if description.is_agnocast:
            node.objects.polled[topic] = created
            return created
        if description.intra_process:
            created.intra = self._buffer(created, symbol)
        self._emit_of_rclcpp("rclcpp_subscription_init", handle, subscription)
        self._emit_of_rclcpp("rclcpp_subscription_callback_added", subscription, callback)
        self._emit_of_rclcpp("rclcpp_callback_register", callback, symbol)
        if self._names_groups:
            self.emit("ros2_caret_callback_group_add_subscription", group.handle, handle)
        # Nothing tells of a loan; of serialised messages nothing did in old releases.
        is_hidden = description.kind == "serialized" and not self._is_every_kind_traced
        created.is_silent = description.kind == "loaned" or is_hidden
        code.is_callback &= not is_hidden
        created.addresses = (callback, subscription, handle, rmw_handle)
        node.objects.polled[topic] = created
        return created

    def listen(self, created: SubscriptionObject) -> None:
        """Let others know of a subscription, and its executor spin it."""
        description = created.description
        if not description.polled:
            created.executor.add(created)
        if created.intra is not None:
            created.executor.add(created.intra)
        self.middleware.add_subscription(created)
        if created.intra is not None and description.transient_local:
            self._replay(created.intra, description.topic)

    def end_subscription(self, subscription: SubscriptionObject) -> None:
        """Destroy a subscription."""
        self.middleware.end_subscription(subscription, self.time)
        subscription.executor.forget(subscription)
        if subscription.intra is not None:
            subscription.executor.forget(subscription.intra)
        for address in subscription.addresses:
            self._memory.free(address)
        self.time += 20 * MICROSECOND
        self.announce()

    def service(self, node: NodeContext, description: entity.Service, symbol: str) -> ServiceObject:
        """A service; it answers once it has been given to `spin_service`."""
        service = self.rcl_service(node, description)
        if not description.is_action:
            self._add_service_callback(service.handle, service.callback, symbol)
        return service

    def copied_service(self, service: ServiceObject, symbol: str) -> None:
        """A copy of a service of rcl, at another address, gets the callback: what a managed node
        does with the services of its lifecycle.
        """
        self._add_service_callback(self._memory.allocate(), service.callback, symbol)

    def rcl_service(self, node: NodeContext, description: entity.Service) -> ServiceObject:
        """A service of rcl, which has no callback yet."""
        self.work(250 * MICROSECOND)
        self.announce()
        memory, name = self._memory, description.name
        handle, callback = memory.allocate(), memory.allocate()
        for event, dds_topic in (
            ("create_reader", f"rq{name}Request"),
            ("create_writer", f"rr{name}Reply"),
        ):
            kind = _WRITER if event == "create_writer" else _READER
            self._entity(event, memory.allocate(), dds_topic, self._process.gid(kind))
        rmw_handle = memory.allocate()
        self.emit("rcl_service_init", handle, node.handle, rmw_handle, name)
        group, executor = node.groups[description.group]
        code = self._code(node, description, executor, name)
        if description.is_action:
            code = replace(code, is_callback=False)
        service = ServiceObject(
            self._network,
            self._process,
            executor,
            group,
            node.description.full_name,
            name,
            handle,
            rmw_handle,
            callback,
            memory.on_stack(),
            code,
            description.is_deferred,
            description.is_answered_later,
        )
        node.objects.services[name] = service
        return service

    def _add_service_callback(self, handle: int, callback: int, symbol: str) -> None:
        self._emit_of_rclcpp("rclcpp_service_callback_added", handle, callback)
        self._emit_of_rclcpp("rclcpp_callback_register", callback, symbol)

    def spin_service(self, service: ServiceObject) -> None:
        """Let the executor answer requests."""
        service.executor.add(service)
        self._network.add(service)

    def action_server(self, node: NodeContext, description: entity.ActionServer) -> None:
        """An action server, whose executor answers, and the threads that execute its goals."""
        action = description.action
        services = [
            self.rcl_service(
                node,
                entity.Service(name_of(action, part), group=description.group, is_action=True),
            )
            for part in SERVICES
        ]
        feedback, status = (
            self.publisher(node, entity.Publisher(name_of(action, part), kind="rcl"))
            for part in (FEEDBACK, STATUS)
        )
        server = ActionServerObject(description, feedback, status)
        for _ in range(description.threads):
            number = _FIRST_GOAL_THREAD + self._process.goal_threads
            self._process.goal_threads += 1
            server.threads.append(
                GoalThread(
                    self._process,
                    self._process.description.tid(number),
                    server,
                    services[-1],
                    self.middleware,
                )
            )
        for service in services:
            service.action = server.answer
            self.spin_service(service)

    def action_client(self, node: NodeContext, description: entity.ActionClient) -> None:
        """An action client."""
        clients = {
            part: self.client(
                node, entity.Client(name_of(description.action, part), group=description.group)
            )
            for part in SERVICES
        }
        client = ActionClientObject(description, clients)
        for each in clients.values():
            each.action = client.answered
        node.objects.action_clients[description.action] = client

    def client(self, node: NodeContext, description: entity.Client) -> ClientObject:
        """A client."""
        self.work(250 * MICROSECOND)
        self.announce()
        memory, name = self._memory, description.service
        handle, rmw_handle = memory.allocate(), memory.allocate()
        gid = self._process.gid(_READER)
        self._entity(
            "create_writer", memory.allocate(), f"rq{name}Request", self._process.gid(_WRITER)
        )
        self._entity("create_reader", memory.allocate(), f"rr{name}Reply", gid)
        self.emit("rmw_client_init", rmw_handle, gid[:16])
        self.emit("rcl_client_init", handle, node.handle, rmw_handle, name)
        group, executor = node.groups[description.group]
        actions = deeds(description.does, node.objects)
        code = UserCode(
            entity.Work(),
            tuple(node.publishers[topic] for topic in description.publishes),
            None,
            self.dice(node.description.full_name, name, "code"),
            actions,
            bool(actions),
        )
        client = ClientObject(
            self._network,
            self._process,
            executor,
            group,
            node.description.full_name,
            name,
            handle,
            rmw_handle,
            gid[:16],
            memory.on_stack(),
            code,
        )
        node.objects.clients[name] = client
        self._network.add_client(client)
        executor.add(client)
        return client

    def timer(self, node: NodeContext, description: entity.Timer, number: int) -> None:
        """A timer, which its executor calls; `number` counts those of the node."""
        self.work(20 * MICROSECOND)
        handle, callback = self._memory.allocate(), self._memory.allocate()
        period = description.period_ns
        symbol = symbols.timer_callback(node.description.name)
        group, executor = node.groups[description.group]
        if node.description.is_agnocast:
            callback = handle
            self.emit(
                "agnocast_agnocast_timer_init",
                handle,
                node.handle,
                self._memory.on_stack(),
                group.handle,
                symbol,
                period // self.thread.machine.layout.timer_unit_ns,
            )
        else:
            self.emit("rcl_timer_init", handle, period)
        period = int(period / description.rate)
        due = self.time + period
        if not node.description.is_agnocast:
            self._emit_of_rclcpp("rclcpp_timer_callback_added", handle, callback)
            self._emit_of_rclcpp("rclcpp_callback_register", callback, symbol)
            self._emit_of_rclcpp("rclcpp_timer_link_node", handle, node.handle)
            if self._names_groups:
                self.emit("ros2_caret_callback_group_add_timer", group.handle, handle)
        name = node.description.full_name
        code = self._code(node, description, executor, f"timer {number}")
        executor.add(
            TimerObject(
                name,
                handle,
                callback,
                period,
                code,
                group,
                due,
                self.dice(name, f"timer {number}"),
                description.reset_ns,
                list(description.periods),
            )
        )

    def links(self, node: NodeContext, created: Mapping[str, NodeContext]) -> None:
        """What user code says about its messages, once its objects are there."""
        for link in node.description.links:
            self.work(5 * MICROSECOND)
            filled_by = created[link.inputs_of] if link.inputs_of else node
            self.emit(
                f"message_link_{link.kind}",
                tuple(filled_by.objects.polled[topic].handle for topic in link.inputs),
                tuple(node.publishers[topic].handle for topic in link.outputs),
            )

    def lifecycle(self, node: NodeContext, events: PublisherObject) -> None:
        """The state machine of a managed node; `events` publishes its transitions."""
        name = node.description.full_name
        node.objects.lifecycle = Lifecycle(name, self._memory.allocate(), events)
        self.emit("rcl_lifecycle_state_machine_init", node.handle, node.objects.lifecycle.handle)

    def _code(
        self,
        node: NodeContext,
        description: entity.Subscription | entity.Timer | entity.Service,
        executor: Executor,
        name: str,
    ) -> UserCode:
        publishers = tuple(node.publishers[topic] for topic in description.publishes)
        actions = deeds(description.does, node.objects)
        return UserCode(
            description.work,
            publishers,
            node.rosout if description.logs else None,
            self.dice(node.description.full_name, name, "code"),
            actions,
            bool(actions)
            or self._process.is_stepwise
            or any(each.intra is not None or each.description.is_agnocast for each in publishers),
            executor.has_callbacks,
            _links(node, description),
            deeds(description.first, node.objects)
            if isinstance(description, entity.Subscription)
            else (),
            description.is_agnocast
            if isinstance(description, entity.Subscription)
            else node.description.is_agnocast,
        )

    def _next_callback(self) -> int:
        """What Agnocast calls a callback: pid and number."""
        self._process.agnocast_callbacks += 1
        return self._process.pid << 32 | self._process.agnocast_callbacks

    def _buffer(self, subscription: SubscriptionObject, symbol: str) -> IntraBuffer:
        """The intra-process object of a subscription, which has a callback of its own."""
        memory = self._memory
        capacity = subscription.description.depth
        ring = RingBuffer(memory.allocate(), capacity)
        ipb, intra, callback = memory.allocate(), memory.allocate(), memory.allocate()
        self.emit("rclcpp_construct_ring_buffer", ring.handle, capacity)
        self.emit("rclcpp_buffer_to_ipb", ring.handle, ipb)
        self.emit("rclcpp_ipb_to_subscription", ipb, intra)
        self.emit("rclcpp_subscription_callback_added", intra, callback)
        self.emit("rclcpp_callback_register", callback, symbol)
        self.emit("rclcpp_subscription_init", subscription.handle, intra)
        return IntraBuffer(subscription, ring, callback)

    def _replay(self, buffer: IntraBuffer, topic: str) -> None:
        """Publishers of the process have kept messages for a subscription that comes late."""
        for kept in self.middleware.kept_in(self._process, topic):
            for message in kept.messages:
                self.time += 400
                put(self.thread, self.middleware, buffer, message, self.time)

    def _writer(self, rmw_handle: int, dds_topic: str) -> None:
        """A publisher of the middleware layer and its DDS writer."""
        gid = self._process.gid(_WRITER)
        self._entity("create_writer", entity_of(rmw_handle), dds_topic, gid)
        self.emit("rmw_publisher_init", rmw_handle, gid)

    def _reader(self, rmw_handle: int, dds_topic: str) -> None:
        """A subscription of the middleware layer and its DDS reader."""
        gid = self._process.gid(_READER)
        self._entity("create_reader", entity_of(rmw_handle), dds_topic, gid)
        self.emit("rmw_subscription_init", rmw_handle, gid)

    def reader(self, topic: str) -> None:
        """A reader of DDS alone, which messages of ROS reach."""
        process = self._process
        self.work(250 * MICROSECOND)
        self._entity("create_reader", self._memory.allocate(), f"rt{topic}", process.gid(_READER))
        self.thread.scheduler.truth.reader.add(
            process.machine.hostname, process.pid, topic, self.time + process.machine.epoch
        )

    def _entity(self, event: str, handle: int, dds_topic: str, gid: bytes) -> None:
        """DDS creates a writer or reader, and announces it with a writer of its own."""
        stamp_ns = self.thread.machine.stamp_ns(self.time + 250)
        writer = self._discovery_writers[1 if event == "create_writer" else 2]
        self.emit("dds_write", writer, 0, stamp_ns)
        if self._tracepoints.dds_write.pack is not None:
            self._add_write_to_truth(stamp_ns)
        self.emit(f"dds_{event}", handle, dds_topic, gid[:12], gid[12:16], gid[:16])

    def _add_write_to_truth(self, stamp_ns: int) -> None:
        """DDS has published for itself; only its own event tells."""
        thread = self.thread
        truth = thread.scheduler.truth
        place = (thread.machine.hostname, thread.process.pid, thread.tid)
        publication_id = next(thread.scheduler.publication_ids)
        truth.publication.add(
            publication_id,
            *place,
            None,
            None,
            None,
            None,
            None,
            None,
            None,
            stamp_ns,
            None,
            True,
            None,
            None,
        )
        truth.dds_event.add(publication_id, *place, "dds:write", self.time + thread.machine.epoch)


def _links(
    node: NodeContext, description: entity.Subscription | entity.Timer | entity.Service
) -> CallbackLinks | None:
    topic = description.topic if isinstance(description, entity.Subscription) else None
    name = node.description.full_name
    inputs = tuple(
        link for link in node.links if link.filled_by == name and topic in link.description.inputs
    )
    outputs = tuple(
        link
        for link in node.links
        if link.used_by == name and {*description.publishes} & {*link.description.outputs}
    )
    return CallbackLinks(topic, inputs, outputs) if inputs or outputs else None
