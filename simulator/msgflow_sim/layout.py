"""Trace layouts as data: which events a release of ROS 2 declares, with which fields.

Each release is described by its differences from the one before. Layouts named after a DDS
implementation have its `dds:*` events as well, which only forks of Fast DDS and Cyclone DDS have.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType

from msgflow_sim.events import OWN_SIGNATURES, SIGNATURES, EventField, parse_fields

_LARGE_PACKET = 32 * 1024
_SMALL_PACKET = 8 * 1024


@dataclass(frozen=True, slots=True)
class EventType:
    """An event class: full name (`ros2:rcl_init`) and fields in the order of the trace.

    The names of the fields are names of the event's signature.
    """

    name: str
    fields: tuple[EventField, ...]


@dataclass(frozen=True, slots=True)
class Layout:
    """What the traces of one tracetools version look like, and what ROS 2 did at that time.

    Attributes:
        name: name by which scenarios choose it.
        version: version string that rcl_init carries.
        events: event classes in the order of declaration, which numbers them.
        is_stamped_by_rmw: the rmw layer makes the source stamp and emits rmw_publish then; else
            DDS makes it, after rmw_publish.
        is_rosout_first: a node's publisher of /rosout is created before rcl_node_init.
        is_stamped_early: DDS makes the stamp when write is entered (Cyclone DDS); else once the
            message is serialised (Fast DDS).
        has_end_of_deferred: callback_end is recorded for a service that answers later.
        is_ready_hashed: executors look for what is ready in the order of a hash map of objects, and
            forget a message of a group that is busy until the next wait; else in the order of a map
            of groups, and by creation in each.
        has_channels: the middleware layer (rmw_zenoh) writes a message with buffers to one channel
            after the other, each time with a stamp of its own, and emits no rmw_publish.
        dds_write: the `dds:*` events of a publication, in order.
        is_callable_queued: Agnocast makes callables when it fetches messages (before 2.2).
        timer_unit_ns: unit of the periods of Agnocast's timers.
        packet_bytes: size of a sub-buffer, hence of a packet.
        tracer_minor: of LTTng 2.x.
    """

    name: str
    version: str
    events: tuple[EventType, ...]
    is_stamped_by_rmw: bool = False
    is_rosout_first: bool = True
    is_stamped_early: bool = False
    has_end_of_deferred: bool = False
    is_ready_hashed: bool = False
    has_channels: bool = False
    dds_write: tuple[str, ...] = ()
    is_callable_queued: bool = False
    timer_unit_ns: int = 1
    packet_bytes: int = _LARGE_PACKET
    tracer_minor: int = 13

    def declares(self, event: str, field: str | None = None) -> bool:
        """Whether traces of this layout have this event (and field)."""
        return any(
            declared.name == event
            and (field is None or any(field == one.name for one in declared.fields))
            for declared in self.events
        )

    def having(
        self, *whole: str, provider: str = "ros2", **fields: str
    ) -> Mapping[str, tuple[EventField, ...]]:
        """The events with others added, `whole` ones as their signatures, or changed."""
        named = {f"{provider}:{name}": parse_fields(text) for name, text in fields.items()}
        complete = {f"{provider}:{name}": SIGNATURES[f"{provider}:{name}"] for name in whole}
        return {event.name: event.fields for event in self.events} | complete | named

    def with_own_events(self) -> Layout:
        """The layout with the tracepoints of the user's own, after all others."""
        own = tuple(EventType(name, fields) for name, fields in OWN_SIGNATURES.items())
        return replace(self, events=(*self.events, *own))


def _events(fields: Mapping[str, tuple[EventField, ...]]) -> tuple[EventType, ...]:
    return tuple(EventType(name, fields[name]) for name in SIGNATURES if name in fields)


_NOTHING = Layout("", "", ())

_FOXY = Layout(
    name="foxy",
    version="1.0.5",
    events=_events(
        _NOTHING.having(
            "rcl_init",
            "rcl_node_init",
            "rcl_publisher_init",
            "rcl_subscription_init",
            "rclcpp_subscription_init",
            "rclcpp_subscription_callback_added",
            "rcl_service_init",
            "rclcpp_service_callback_added",
            "rcl_client_init",
            "rcl_timer_init",
            "rclcpp_timer_callback_added",
            "rclcpp_callback_register",
            "callback_start",
            "callback_end",
        )
    ),
    packet_bytes=_SMALL_PACKET,
    tracer_minor=11,
)

_GALACTIC = replace(
    _FOXY,
    name="galactic",
    version="2.3.0",
    events=_events(
        _FOXY.having(
            "rclcpp_publish",
            "rcl_publish",
            "rclcpp_timer_link_node",
            "rcl_lifecycle_state_machine_init",
            "rcl_lifecycle_transition",
        )
    ),
)

_HUMBLE = replace(
    _GALACTIC,
    name="humble",
    version="4.1.1",
    events=_events(
        _GALACTIC.having(
            "rmw_take",
            "rcl_take",
            "rclcpp_take",
            "rclcpp_executor_get_next_ready",
            "rclcpp_executor_wait_for_work",
            "rclcpp_executor_execute",
            rclcpp_publish="message pointer",
            rmw_publish="message pointer",
            rmw_publisher_init="rmw_publisher_handle pointer, gid padded 24",
            rmw_subscription_init="rmw_subscription_handle pointer, gid padded 24",
        )
    ),
    packet_bytes=_LARGE_PACKET,
    tracer_minor=13,
)

# What follows the 16 bytes of an identifier is what tracetools read beyond its end.
_IRON = replace(
    _HUMBLE,
    name="iron",
    version="6.3.1",
    events=_events(
        _HUMBLE.having(
            "rmw_publisher_init",
            "rmw_subscription_init",
            "rclcpp_intra_publish",
            "rclcpp_construct_ring_buffer",
            "rclcpp_buffer_to_ipb",
            "rclcpp_ipb_to_subscription",
            "rclcpp_ring_buffer_enqueue",
            "rclcpp_ring_buffer_dequeue",
            "rclcpp_ring_buffer_clear",
        )
    ),
)

_JAZZY = replace(
    _IRON,
    name="jazzy",
    version="8.2.3",
    events=_events(_IRON.having("rmw_publish")),
    is_stamped_by_rmw=True,
    is_rosout_first=False,
    is_ready_hashed=True,
)

_KILTED = replace(
    _JAZZY,
    name="kilted",
    version="8.6.0",
    events=_events(
        _JAZZY.having(
            "rmw_client_init",
            "rmw_send_request",
            "rmw_take_request",
            "rmw_send_response",
            "rmw_take_response",
            rmw_publisher_init="rmw_publisher_handle pointer, gid bytes 16",
            rmw_subscription_init="rmw_subscription_handle pointer, gid bytes 16",
        )
    ),
    has_end_of_deferred=True,
)

# The last one is no tracepoint of ROS 2: applications that use message_filters declare it so.
_MESSAGE_LINKS = (
    "message_link_periodic_async",
    "message_link_partial_sync",
    "message_link_approximate_sync",
)

_ROLLING = replace(
    _KILTED,
    name="rolling",
    version="8.10.1",
    events=_events(_KILTED.having(*_MESSAGE_LINKS)),
    has_channels=True,
)


def _with_fast_dds(layout: Layout, *, suffix: str = "fastdds", is_write_first: bool) -> Layout:
    """The instrumented Fast DDS; the first branch of the fork emits `dds:write_pre` first."""
    order = ("write", "write_pre") if is_write_first else ("write_pre", "write")
    return replace(
        layout,
        name=f"{layout.name}-{suffix}",
        events=_events(
            layout.having(
                "write_pre",
                "read",
                provider="dds",
                create_writer="writer pointer, topic_name string, gid_prefix bytes 12, "
                "gid_entity bytes 4",
                create_reader="reader pointer, topic_name string, gid_prefix bytes 12, "
                "gid_entity bytes 4",
                write="writer pointer, timestamp signed",
            )
        ),
        dds_write=tuple(f"dds:{name}" for name in order),
    )


def _with_cyclone_dds(layout: Layout) -> Layout:
    """The instrumented Cyclone DDS, as offered to its developers."""
    return replace(
        layout,
        name=f"{layout.name}-cyclonedds",
        events=_events(
            layout.having(
                "write",
                "read",
                provider="dds",
                create_writer="writer pointer, topic_name string, gid bytes 16",
                create_reader="reader pointer, topic_name string, gid bytes 16",
            )
        ),
        is_stamped_early=True,
        dds_write=("dds:write",),
    )


def _with_early_cyclone_dds(layout: Layout) -> Layout:
    """The first instrumentation of Cyclone DDS, which has no stamps."""
    return replace(
        layout,
        name=f"{layout.name}-cyclonedds",
        events=_events(
            layout.having(
                provider="dds",
                create_writer="writer pointer, topic_name string",
                create_reader="reader pointer, topic_name string",
                write="writer pointer, data pointer",
                read="reader pointer",
            )
        ),
        is_stamped_early=True,
        dds_write=("dds:write",),
    )


_OF_CARET = (
    "dds_write",
    "dds_bind_addr_to_stamp",
    "on_data_available",
    "sim_time",
    "construct_executor",
    "add_callback_group",
    "callback_group_add_timer",
    "callback_group_add_subscription",
)
_NOT_OF_CARET = re.compile(r"ros2:(rcl_take|rclcpp_take|rmw_publish|rmw_.*_init|.*_executor_.*)")


def _with_caret(layout: Layout) -> Layout:
    """CARET's fork of ros2_tracing, which leaves out events, and the library that it preloads."""
    events = layout.having(*_OF_CARET, provider="ros2_caret")
    return replace(
        layout,
        name=f"{layout.name}-caret",
        events=_events({n: e for n, e in events.items() if not _NOT_OF_CARET.fullmatch(n)}),
    )


_OF_AGNOCAST = (
    "init",
    "node_init",
    "construct_executor",
    "create_timer_callable",
    "callable_start",
    "callable_end",
    "take",
)


def _with_agnocast(layout: Layout) -> Layout:
    """Agnocast 2.3 beside ROS 2."""
    subscription = (
        "subscription_handle pointer, node_handle pointer, callback pointer, "
        "callback_group pointer, symbol string, topic_name string, queue_depth unsigned, "
        "pid_callback_info_id unsigned"
    )
    return replace(
        layout,
        name=f"{layout.name}-agnocast",
        events=_events(
            layout.having(
                *(f"agnocast_{name}" for name in (*_OF_AGNOCAST, "publisher_init", "timer_init")),
                "agnocast_add_callback_group",
                provider="agnocast",
                agnocast_subscription_init=subscription,
                agnocast_publish="publisher_handle pointer, entry_id signed",
                agnocast_create_callable="callable pointer, entry_id signed, "
                "pid_callback_info_id unsigned",
            )
        ),
    )


def _with_early_agnocast(layout: Layout) -> Layout:
    """Agnocast 2.1."""
    return replace(
        layout,
        name=f"{layout.name}-agnocast",
        events=_events(
            layout.having(
                *(f"agnocast_{name}" for name in (*_OF_AGNOCAST, "publisher_init", "timer_init")),
                "agnocast_publish",
                provider="agnocast",
                agnocast_subscription_init="subscription_handle pointer, node_handle pointer, "
                "callback pointer, callback_group pointer, symbol string, topic_name string, "
                "queue_depth unsigned, pid_ciid unsigned",
                agnocast_create_callable="callable pointer, message pointer, entry_id signed, "
                "pid_ciid unsigned",
            )
        ),
        is_callable_queued=True,
        timer_unit_ns=1_000_000,
    )


def _with_message_links(layout: Layout) -> Layout:
    """The branch for annotations, which users of the instrumented DDS also use."""
    return replace(layout, events=_events(layout.having(*_MESSAGE_LINKS)))


@cache
def layouts() -> Mapping[str, Layout]:
    """Every layout by name."""
    annotated = _with_message_links(_HUMBLE)
    known = (
        _FOXY,
        _with_early_cyclone_dds(_FOXY),
        _with_fast_dds(_FOXY, is_write_first=False),
        _GALACTIC,
        _with_early_cyclone_dds(_GALACTIC),
        _with_fast_dds(_GALACTIC, is_write_first=False),
        _HUMBLE,
        _with_cyclone_dds(annotated),
        _with_fast_dds(annotated, is_write_first=False),
        _with_fast_dds(annotated, suffix="fastdds-write-first", is_write_first=True),
        _with_early_agnocast(_HUMBLE),
        _with_caret(_HUMBLE),
        _IRON,
        _JAZZY,
        _with_agnocast(_JAZZY),
        _KILTED,
        _ROLLING,
    )
    return MappingProxyType({layout.name: layout for layout in known})
