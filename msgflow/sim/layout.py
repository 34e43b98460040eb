"""Trace layouts as data: which events a tracetools version declares, with which fields.

A further version is one more `Layout` in `layouts()`; nothing else knows about versions but the
modules that emit (`startup`, `publish`, `executor`, `discovery`).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


class FieldKind(Enum):
    """Kinds of payload fields: `struct` code and the TSDL of one element."""

    POINTER = ("Q", "integer { size = 64; align = 8; signed = 0; encoding = none; base = 16; }")
    UNSIGNED = ("Q", "integer { size = 64; align = 8; signed = 0; encoding = none; base = 10; }")
    SIGNED = ("q", "integer { size = 64; align = 8; signed = 1; encoding = none; base = 10; }")
    SIGNED_32 = ("i", "integer { size = 32; align = 8; signed = 1; encoding = none; base = 10; }")
    BYTES = ("s", "integer { size = 8; align = 8; signed = 0; encoding = none; base = 10; }")
    STRING = ("", "string")

    def __init__(self, code: str, tsdl: str) -> None:
        self.code = code
        self.tsdl = tsdl


@dataclass(frozen=True, slots=True)
class EventField:
    """A payload field; `length` is the number of elements of BYTES."""

    name: str
    kind: FieldKind
    length: int = 0


@dataclass(frozen=True, slots=True)
class EventType:
    """An event class: full name (`ros2:rcl_init`) and fields in the order of the trace."""

    name: str
    fields: tuple[EventField, ...]


@dataclass(frozen=True, slots=True)
class Layout:
    """What one tracetools version writes.

    Attributes:
        name: name of the layout, as in `Scenario.layout`.
        version: what `rcl_init.version` says.
        events: event classes, numbered from 0 in this order.
    """

    name: str
    version: str
    events: tuple[EventType, ...]


_KINDS = {
    "pointer": FieldKind.POINTER,
    "unsigned": FieldKind.UNSIGNED,
    "signed": FieldKind.SIGNED,
    "signed_32": FieldKind.SIGNED_32,
    "string": FieldKind.STRING,
}


def _event(name: str, declaration: str = "") -> EventType:
    """Read fields from text such as `context_handle pointer, gid bytes 24`."""
    fields = []
    for part in filter(None, declaration.split(", ")):
        field_name, kind, *length = part.split()
        if kind == "bytes":
            fields.append(EventField(field_name, FieldKind.BYTES, int(length[0])))
        else:
            fields.append(EventField(field_name, _KINDS[kind]))
    return EventType(f"ros2:{name}", tuple(fields))


JAZZY = Layout(
    name="jazzy",
    version="8.2.3",
    events=(
        _event("rcl_init", "context_handle pointer, version string"),
        _event(
            "rcl_node_init",
            "node_handle pointer, rmw_handle pointer, node_name string, namespace string",
        ),
        _event("rmw_publisher_init", "rmw_publisher_handle pointer, gid bytes 24"),
        _event(
            "rcl_publisher_init",
            "publisher_handle pointer, node_handle pointer, rmw_publisher_handle pointer, "
            "topic_name string, queue_depth unsigned",
        ),
        _event("rclcpp_publish", "message pointer"),
        _event("rclcpp_intra_publish", "publisher_handle pointer, message pointer"),
        _event("rcl_publish", "publisher_handle pointer, message pointer"),
        _event("rmw_publish", "rmw_publisher_handle pointer, message pointer, timestamp signed"),
        _event("rmw_subscription_init", "rmw_subscription_handle pointer, gid bytes 24"),
        _event(
            "rcl_subscription_init",
            "subscription_handle pointer, node_handle pointer, rmw_subscription_handle pointer, "
            "topic_name string, queue_depth unsigned",
        ),
        _event("rclcpp_subscription_init", "subscription_handle pointer, subscription pointer"),
        _event("rclcpp_subscription_callback_added", "subscription pointer, callback pointer"),
        _event(
            "rmw_take",
            "rmw_subscription_handle pointer, message pointer, source_timestamp signed, "
            "taken signed_32",
        ),
        _event("rcl_take", "message pointer"),
        _event("rclcpp_take", "message pointer"),
        _event(
            "rcl_service_init",
            "service_handle pointer, node_handle pointer, rmw_service_handle pointer, "
            "service_name string",
        ),
        _event("rclcpp_service_callback_added", "service_handle pointer, callback pointer"),
        _event(
            "rcl_client_init",
            "client_handle pointer, node_handle pointer, rmw_client_handle pointer, "
            "service_name string",
        ),
        _event("rcl_timer_init", "timer_handle pointer, period signed"),
        _event("rclcpp_timer_callback_added", "timer_handle pointer, callback pointer"),
        _event("rclcpp_timer_link_node", "timer_handle pointer, node_handle pointer"),
        _event("rclcpp_callback_register", "callback pointer, symbol string"),
        _event("callback_start", "callback pointer, is_intra_process signed_32"),
        _event("callback_end", "callback pointer"),
        _event("rcl_lifecycle_state_machine_init", "node_handle pointer, state_machine pointer"),
        _event(
            "rcl_lifecycle_transition",
            "state_machine pointer, start_label string, goal_label string",
        ),
        _event("rclcpp_executor_get_next_ready"),
        _event("rclcpp_executor_wait_for_work", "timeout signed"),
        _event("rclcpp_executor_execute", "handle pointer"),
        _event("rclcpp_construct_ring_buffer", "buffer pointer, capacity unsigned"),
        _event("rclcpp_buffer_to_ipb", "buffer pointer, ipb pointer"),
        _event("rclcpp_ipb_to_subscription", "ipb pointer, subscription pointer"),
        _event(
            "rclcpp_ring_buffer_enqueue",
            "buffer pointer, index unsigned, size unsigned, overwritten signed_32",
        ),
        _event("rclcpp_ring_buffer_dequeue", "buffer pointer, index unsigned, size unsigned"),
        _event("rclcpp_ring_buffer_clear", "buffer pointer"),
    ),
)


def layouts() -> Mapping[str, Layout]:
    """Every layout by name."""
    return {JAZZY.name: JAZZY}
