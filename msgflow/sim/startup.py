"""From rcl_init to spin: the events of a starting process, in the order of its release of ROS 2.

The steps are separate, so that other processes start meanwhile.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from msgflow.sim import symbols, system
from msgflow.sim.callbacks import TimerObject
from msgflow.sim.discovery import Discovery, DiscoveryListener
from msgflow.sim.executor import ExecutorThread
from msgflow.sim.publish import publish
from msgflow.sim.system import MICROSECOND
from msgflow.sim.transport import Middleware, PublisherObject, SubscriptionObject
from msgflow.sim.write import entity_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from msgflow.sim.machine import RunningProcess

_INTERNAL_DEPTH = 1000
_PARAMETER_EVENTS = "/parameter_events"
_ROSOUT = "/rosout"
_PARAMETER_SUBSCRIPTION = system.Subscription(
    _PARAMETER_EVENTS, work=system.Work(700, 900), depth=_INTERNAL_DEPTH
)


class Startup:
    """Starts one process: creates its objects one by one and lets its executor spin."""

    def __init__(
        self,
        process: RunningProcess,
        middleware: Middleware,
        discovery: Discovery,
        version: str,
    ) -> None:
        self.thread = ExecutorThread(process, middleware)
        self._process = process
        self._middleware = middleware
        self._discovery = discovery
        self._version = version
        self._world = process.world
        self._memory = process.memory
        self._tracepoints = process.machine.tracepoints
        self._time = 0
        self._announcer = 0
        self._announcement = 0
        # DDS has writers of its own, which tell others what there is.
        self._discovery_writers = tuple(process.memory.allocate() for _ in range(3))
        self._steps = self._sequence()

    def begin(self, time: int, _: None = None) -> None:
        """Do the next step at `time` and plan the one after it."""
        thread = self.thread
        if later := thread.take_cpu(time):
            self._world.at(later, self.begin)
            return
        self._time = time
        if next(self._steps, None) is None:
            thread.spin(time)
            return
        self._time += MICROSECOND
        thread.keep_cpu(self._time)
        self._world.at(self._time, self.begin)

    def _emit(self, name: str, *values: object) -> None:
        """Emit an event a little later than the one before."""
        self._time += 300 + int(self._world.random() * 1_500)
        self.thread.emit(getattr(self._tracepoints, name), self._time, self.thread.context, *values)

    def _work(self, duration: int) -> None:
        self._time += duration // 2 + int(self._world.random() * duration)

    def _announce(self) -> None:
        self._time = self._discovery.announce(
            self.thread, self._announcer, self._announcement, self._time + 500
        )

    def _sequence(self) -> Iterator[bool]:
        process = self._process
        self._emit("rcl_init", self._memory.allocate(), self._version)
        self._work(800 * MICROSECOND)
        self._announcer = self._memory.allocate()
        self._announcement = self._memory.on_stack()
        listener = DiscoveryListener(process)
        self._create_writer(self._announcer, "ros_discovery_info")
        self._create_reader(listener.rmw_handle, "ros_discovery_info")
        self._discovery.join(listener)
        yield True
        for node in process.description.nodes:
            yield from self._create_node(node)

    def _create_node(self, node: system.Node) -> Iterator[bool]:
        handle = self._memory.allocate()
        name = node.full_name
        self._work(300 * MICROSECOND)
        self._announce()
        described = (handle, self._memory.allocate(), node.name, node.namespace)
        is_rosout_first = self._process.machine.layout.is_rosout_first
        if not is_rosout_first:
            self._emit("rcl_node_init", *described)
            yield True
        # Its handle is on the stack and copied later. Until Iron it is made as part of the node.
        rosout = self._create_publisher(name, handle, _ROSOUT, _INTERNAL_DEPTH, is_rclcpp=False)
        yield True
        if is_rosout_first:
            self._emit("rcl_node_init", *described)
            yield True
        for service, symbol in symbols.parameter_services():
            self._create_service(handle, f"{name}/{service}", symbol)
            yield True
        events = self._create_publisher(name, handle, _PARAMETER_EVENTS, _INTERNAL_DEPTH)
        yield True
        # One event per parameter that is declared.
        self._publish(events)
        yield True
        self._create_subscription(
            name, handle, _PARAMETER_SUBSCRIPTION, symbols.PARAMETER_EVENTS, (), None
        )
        yield True
        for _ in range(3):
            self._publish(events)
            yield True
        publishers = {}
        for publisher in node.publishers:
            publishers[publisher.topic] = self._create_publisher(
                name, handle, publisher.topic, publisher.depth, size_bytes=publisher.size_bytes
            )
            yield True
        for subscription in node.subscriptions:
            self._create_subscription(
                name, handle, subscription,
                symbols.subscription_callback(node.name, subscription.message_type),
                tuple(publishers[topic] for topic in subscription.publishes),
                rosout if subscription.logs else None,
            )  # fmt: skip
            yield True
        for timer in node.timers:
            targets = tuple(publishers[topic] for topic in timer.publishes)
            self._create_timer(node, handle, timer, targets, rosout if timer.logs else None)
            yield True
        self._publish(rosout)
        yield True

    def _publish(self, publisher: PublisherObject) -> None:
        self._work(8 * MICROSECOND)
        self._time = publish(self.thread, self._middleware, publisher, self._time, None)

    def _create_publisher(
        self,
        node: str,
        node_handle: int,
        topic: str,
        depth: int,
        *,
        is_rclcpp: bool = True,
        size_bytes: int = 0,
    ) -> PublisherObject:
        self._work(250 * MICROSECOND)
        self._announce()
        memory = self._memory
        address: Callable[[], int] = memory.allocate if is_rclcpp else memory.on_stack
        rmw_handle, init_handle = memory.allocate(), address()
        self._create_writer(rmw_handle, f"rt{topic}")
        self._emit("rcl_publisher_init", init_handle, node_handle, rmw_handle, topic, depth)
        handle = init_handle
        while not is_rclcpp and handle == init_handle:
            handle = memory.on_stack()
        publisher = PublisherObject(
            self._process, node, topic, init_handle, handle, rmw_handle, memory.on_stack(),
            is_rclcpp, topic in {_ROSOUT, _PARAMETER_EVENTS}, self._time, [], size_bytes,
        )  # fmt: skip
        self._middleware.add_publisher(publisher)
        return publisher

    def _create_subscription(
        self,
        node: str,
        node_handle: int,
        description: system.Subscription,
        symbol: str,
        publishers: tuple[PublisherObject, ...],
        log: PublisherObject | None,
    ) -> None:
        self._work(400 * MICROSECOND)
        self._announce()
        memory = self._memory
        rmw_handle, handle = memory.allocate(), memory.allocate()
        subscription, callback = memory.allocate(), memory.allocate()
        topic = description.topic
        self._create_reader(rmw_handle, f"rt{topic}")
        self._emit(
            "rcl_subscription_init", handle, node_handle, rmw_handle, topic, description.depth
        )
        self._emit("rclcpp_subscription_init", handle, subscription)
        self._emit("rclcpp_subscription_callback_added", subscription, callback)
        self._emit("rclcpp_callback_register", callback, symbol)
        created = SubscriptionObject(
            self._process, self.thread, description, node, handle, rmw_handle, callback,
            memory.allocate(), publishers, log, topic == _PARAMETER_EVENTS, not publishers,
            self._time, deque(),
        )  # fmt: skip
        self.thread.subscriptions.append(created)
        self._middleware.add_subscription(created)

    def _create_writer(self, rmw_handle: int, dds_topic: str) -> None:
        """A publisher of the middleware layer and its DDS writer."""
        gid = self._process.gid(3)
        self._announce_entity("create_writer", entity_of(rmw_handle), dds_topic, gid)
        self._emit("rmw_publisher_init", rmw_handle, gid)

    def _create_reader(self, rmw_handle: int, dds_topic: str) -> None:
        """A subscription of the middleware layer and its DDS reader."""
        gid = self._process.gid(4)
        self._announce_entity("create_reader", entity_of(rmw_handle), dds_topic, gid)
        self._emit("rmw_subscription_init", rmw_handle, gid)

    def _announce_entity(self, event: str, entity: int, dds_topic: str, gid: bytes) -> None:
        """DDS creates a writer or reader and says so with a writer that nobody has created."""
        stamp_ns = self._process.machine.stamp_ns(self._time + 250)
        writer = self._discovery_writers[1 if event == "create_writer" else 2]
        self._emit("dds_write", writer, 0, stamp_ns)
        if self._tracepoints.dds_write.pack is not None:
            self._add_write_to_truth(stamp_ns)
        self._emit(f"dds_{event}", entity, dds_topic, gid[:12], gid[12:16], gid[:16])

    def _add_write_to_truth(self, stamp_ns: int) -> None:
        """DDS has published for itself, of which nothing but its own event tells."""
        thread, truth = self.thread, self._world.truth
        place = (thread.machine.hostname, thread.process.pid, thread.tid)
        publication_id = next(self._world.publication_ids)
        truth.publication.add(
            publication_id, *place, None, None, None, None, None, None, None, stamp_ns, None, True
        )
        truth.dds_event.add(publication_id, *place, "dds:write", self._time + thread.machine.epoch)

    def _create_service(self, node_handle: int, name: str, symbol: str) -> None:
        self._work(250 * MICROSECOND)
        self._announce()
        memory = self._memory
        handle, callback = memory.allocate(), memory.allocate()
        for event, prefix, suffix in (
            ("create_reader", "rq", "Request"), ("create_writer", "rr", "Reply")
        ):  # fmt: skip
            dds_topic = f"{prefix}{name}{suffix}"
            kind = 3 if event == "create_writer" else 4
            self._announce_entity(event, memory.allocate(), dds_topic, self._process.gid(kind))
        self._emit("rcl_service_init", handle, node_handle, memory.allocate(), name)
        self._emit("rclcpp_service_callback_added", handle, callback)
        self._emit("rclcpp_callback_register", callback, symbol)

    def _create_timer(
        self,
        node: system.Node,
        node_handle: int,
        description: system.Timer,
        publishers: tuple[PublisherObject, ...],
        log: PublisherObject | None,
    ) -> None:
        self._work(20 * MICROSECOND)
        handle, callback = self._memory.allocate(), self._memory.allocate()
        period = description.period_ns
        self._emit("rcl_timer_init", handle, period)
        due = self._time + period
        self._emit("rclcpp_timer_callback_added", handle, callback)
        self._emit("rclcpp_callback_register", callback, symbols.timer_callback(node.name))
        self._emit("rclcpp_timer_link_node", handle, node_handle)
        self.thread.timers.append(
            TimerObject(
                node.full_name, handle, callback, period, description.work, publishers, log, due
            )
        )
