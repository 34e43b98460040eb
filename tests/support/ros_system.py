"""The event sequences of a ROS 2 system in words: what creating, publishing, taking ... record.

Handles are small numbers chosen by the test. Where a publisher has handle 0x10, its rmw handle is
0x1010 and its DDS writer 0x2010 unless the test says otherwise; likewise for subscriptions.
"""

from __future__ import annotations

from typing import Any

from support.staged_events import StagedEvents, Thread

RMW = 0x1000
WRITER = 0x2000


def gid_of(number: int, length: int = 16) -> list[int]:
    """Return a GID told from others by its first byte; what comes after 16 bytes is garbage."""
    return [number, *[1] * 15, *range(number, number + length - 16)]


class RosSystem(StagedEvents):
    """Staged events with words for the sequences that belong together.

    Every method adds its events one after the other on the given thread; see `StagedEvents.add`.
    Layouts differ in who stamps a message: rmw_publish (since Jazzy) or the DDS write.
    """

    def context(self, thread: Thread, handle: int = 0xC0) -> int:
        """rcl_init."""
        return self.add("ros2:rcl_init", thread, context_handle=handle, version="4.1.0")

    def node(self, thread: Thread, handle: int, name: str, namespace: str = "/") -> int:
        """rcl_node_init."""
        return self.add(
            "ros2:rcl_node_init", thread, node_handle=handle, node_name=name, namespace=namespace
        )

    def publisher(
        self,
        thread: Thread,
        handle: int,
        topic: str,
        *,
        node: int = 0x1,
        rmw: int | None = None,
        depth: int = 10,
        gid: list[int] | None = None,
    ) -> int:
        """rmw_publisher_init and rcl_publisher_init; returns the time of the latter."""
        rmw_handle = handle + RMW if rmw is None else rmw
        self.add("ros2:rmw_publisher_init", thread, rmw_publisher_handle=rmw_handle, gid=gid)
        return self.add(
            "ros2:rcl_publisher_init",
            thread,
            publisher_handle=handle,
            node_handle=node,
            rmw_publisher_handle=rmw_handle,
            topic_name=topic,
            queue_depth=depth,
        )

    def writer(self, thread: Thread, handle: int, topic: str) -> int:
        """dds:create_writer of a publisher; topic as ROS has it."""
        return self.add(
            "dds:create_writer", thread, writer=handle + WRITER, topic_name=f"rt{topic}"
        )

    def subscription(
        self,
        thread: Thread,
        handle: int,
        topic: str,
        *,
        node: int = 0x1,
        callback: int | None = None,
        rmw: int | None = None,
        depth: int = 10,
        gid: list[int] | None = None,
    ) -> int:
        """The rcl subscription and, with a callback, its rclcpp object."""
        rmw_handle = handle + RMW if rmw is None else rmw
        self.add("ros2:rmw_subscription_init", thread, rmw_subscription_handle=rmw_handle, gid=gid)
        created = self.add(
            "ros2:rcl_subscription_init",
            thread,
            subscription_handle=handle,
            node_handle=node,
            rmw_subscription_handle=rmw_handle,
            topic_name=topic,
            queue_depth=depth,
        )
        if callback is not None:
            self.add(
                "ros2:rclcpp_subscription_init",
                thread,
                subscription_handle=handle,
                subscription=handle + WRITER,
            )
            self.subscription_callback(thread, handle + WRITER, callback)
        return created

    def subscription_callback(self, thread: Thread, subscription: int, callback: int) -> None:
        """A callback is attached to an rclcpp subscription object and registered."""
        self.add(
            "ros2:rclcpp_subscription_callback_added",
            thread,
            subscription=subscription,
            callback=callback,
        )
        self.add(
            "ros2:rclcpp_callback_register", thread, callback=callback, symbol=f"f{callback:x}"
        )

    def buffer(self, thread: Thread, buffer: int, subscription: int) -> None:
        """The ring buffer of an rclcpp subscription object."""
        ipb = buffer + RMW
        self.add("ros2:rclcpp_construct_ring_buffer", thread, buffer=buffer, capacity=10)
        self.add("ros2:rclcpp_buffer_to_ipb", thread, buffer=buffer, ipb=ipb)
        self.add("ros2:rclcpp_ipb_to_subscription", thread, ipb=ipb, subscription=subscription)

    def timer(
        self,
        thread: Thread,
        handle: int,
        callback: int,
        *,
        node: int | None = 0x1,
        period: int = 5_000_000,
    ) -> int:
        """A timer with its callback, linked to a node."""
        created = self.add("ros2:rcl_timer_init", thread, timer_handle=handle, period=period)
        self.add("ros2:rclcpp_timer_callback_added", thread, timer_handle=handle, callback=callback)
        self.add(
            "ros2:rclcpp_callback_register", thread, callback=callback, symbol=f"f{callback:x}"
        )
        if node is not None:
            self.add("ros2:rclcpp_timer_link_node", thread, timer_handle=handle, node_handle=node)
        return created

    def publish(
        self,
        thread: Thread,
        handle: int,
        stamp: int | None = None,
        *,
        message: int = 0xA,
        rmw: int | None = None,
        layers: str = "rclcpp rcl rmw",
    ) -> int:
        """A publish() call whose rmw layer has the stamp; returns the time of its first layer."""
        rmw_handle = handle + RMW if rmw is None else rmw
        fields: dict[str, dict[str, Any]] = {
            "rclcpp": {},
            "rcl": {"publisher_handle": handle},
            "rmw": {"rmw_publisher_handle": rmw_handle, "timestamp": stamp},
        }
        return min(
            self.add(f"ros2:{layer}_publish", thread, message=message, **fields[layer])
            for layer in layers.split()
        )

    def publish_dds(
        self,
        thread: Thread,
        handle: int,
        stamp: int,
        *,
        message: int = 0xA,
        writer: int | None = None,
        layers: str = "rclcpp rcl rmw write_pre write",
    ) -> int:
        """A publish() call whose stamp only the DDS write has; rmw_publish has no handle."""
        fields: dict[str, tuple[str, dict[str, Any]]] = {
            "rclcpp": ("ros2:rclcpp_publish", {"message": message}),
            "rcl": ("ros2:rcl_publish", {"publisher_handle": handle, "message": message}),
            "rmw": ("ros2:rmw_publish", {"message": message}),
            "write_pre": ("dds:write_pre", {"writer": handle + WRITER, "data": message}),
            "write": ("dds:write", {"writer": handle + WRITER, "timestamp": stamp}),
        }
        if writer is not None:
            for layer in ("write_pre", "write"):
                fields[layer][1]["writer"] = writer
        return min(
            self.add(fields[layer][0], thread, **fields[layer][1]) for layer in layers.split()
        )

    def take(
        self,
        thread: Thread,
        handle: int,
        stamp: int,
        *,
        message: int = 0xB,
        taken: int = 1,
        rmw: int | None = None,
        layers: str = "rmw rcl rclcpp",
    ) -> int:
        """A take of the rcl subscription `handle`; returns the time of rmw_take."""
        rmw_handle = handle + RMW if rmw is None else rmw
        fields: dict[str, dict[str, Any]] = {
            "rmw": {
                "rmw_subscription_handle": rmw_handle,
                "source_timestamp": stamp,
                "taken": taken,
            },
            "rcl": {},
            "rclcpp": {},
        }
        return min(
            self.add(f"ros2:{layer}_take", thread, message=message, **fields[layer])
            for layer in layers.split()
        )

    def client(
        self,
        thread: Thread,
        handle: int,
        service: str,
        *,
        gid: int | None,
        node: int = 0x1,
        rmw: int | None = None,
        length: int = 16,
    ) -> int:
        """rmw_client_init and rcl_client_init; the former only with a GID (see `gid_of`)."""
        rmw_handle = handle + RMW if rmw is None else rmw
        if gid is not None:
            self.add(
                "ros2:rmw_client_init",
                thread,
                rmw_client_handle=rmw_handle,
                gid=gid_of(gid, length),
            )
        return self.add(
            "ros2:rcl_client_init",
            thread,
            client_handle=handle,
            node_handle=node,
            rmw_client_handle=rmw_handle,
            service_name=service,
        )

    def service(
        self, thread: Thread, handle: int, name: str, *, callback: int | None, node: int = 0x1
    ) -> int:
        """rcl_service_init and, with a callback, its attachment."""
        created = self.add(
            "ros2:rcl_service_init",
            thread,
            service_handle=handle,
            node_handle=node,
            rmw_service_handle=handle + RMW,
            service_name=name,
        )
        if callback is not None:
            self.add(
                "ros2:rclcpp_service_callback_added",
                thread,
                service_handle=handle,
                callback=callback,
            )
        return created

    def send_request(self, thread: Thread, handle: int, number: int) -> int:
        """rmw_send_request of the client `handle`."""
        return self.add(
            "ros2:rmw_send_request",
            thread,
            rmw_client_handle=handle + RMW,
            sequence_number=number,
        )

    def take_request(
        self,
        thread: Thread,
        handle: int,
        number: int,
        *,
        gid: int,
        taken: int = 1,
        length: int = 16,
    ) -> int:
        """rmw_take_request of the service `handle`."""
        return self.add(
            "ros2:rmw_take_request",
            thread,
            rmw_service_handle=handle + RMW,
            client_gid=gid_of(gid, length),
            sequence_number=number,
            taken=taken,
        )

    def send_response(
        self, thread: Thread, handle: int, number: int, *, gid: int, stamp: int = 0
    ) -> int:
        """rmw_send_response of the service `handle`."""
        return self.add(
            "ros2:rmw_send_response",
            thread,
            rmw_service_handle=handle + RMW,
            client_gid=gid_of(gid),
            sequence_number=number,
            timestamp=stamp,
        )

    def take_response(
        self, thread: Thread, handle: int, number: int, *, stamp: int = 0, taken: int = 1
    ) -> int:
        """rmw_take_response of the client `handle`."""
        return self.add(
            "ros2:rmw_take_response",
            thread,
            rmw_client_handle=handle + RMW,
            sequence_number=number,
            source_timestamp=stamp,
            taken=taken,
        )

    def start(self, thread: Thread, callback: int, *, intra: bool = False) -> int:
        """callback_start."""
        return self.add(
            "ros2:callback_start", thread, callback=callback, is_intra_process=int(intra)
        )

    def end(self, thread: Thread, callback: int) -> int:
        """callback_end."""
        return self.add("ros2:callback_end", thread, callback=callback)

    def ready(self, thread: Thread) -> int:
        """rclcpp_executor_get_next_ready."""
        return self.add("ros2:rclcpp_executor_get_next_ready", thread)

    def idle(self, thread: Thread) -> int:
        """rclcpp_executor_wait_for_work."""
        return self.add("ros2:rclcpp_executor_wait_for_work", thread, timeout=-1)

    def execute(self, thread: Thread, handle: int) -> int:
        """rclcpp_executor_execute."""
        return self.add("ros2:rclcpp_executor_execute", thread, handle=handle)

    def python(self, thread: Thread, number: int, text: str) -> int:
        """The tracer of Python nodes says something besides the events of rclcpp."""
        return self.add(
            "ros2:rclcpp_callback_register", thread, callback=number, symbol=f"#msgflow {text}"
        )

    def annotate(self, thread: Thread, kind: str, inputs: list[int], outputs: list[int]) -> int:
        """message_link_periodic_async or message_link_partial_sync."""
        return self.add(
            f"ros2:message_link_{kind}",
            thread,
            _subs_length=len(inputs),
            subs=inputs,
            _pubs_length=len(outputs),
            pubs=outputs,
        )
