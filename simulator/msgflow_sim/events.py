"""Events as the simulation emits them: every field that any version of an event has.

The simulation emits each event with all values of its signature, in that order, whatever the layout
of the trace: a layout has the event with these fields, with some of them, or not at all, in which
case nothing is written.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from types import MappingProxyType

_BYTE = "integer { size = 8; align = 8; signed = 0; encoding = none; base = 10; }"
_POINTER = "integer { size = 64; align = 8; signed = 0; encoding = none; base = 16; }"


class FieldKind(Enum):
    """Kinds of payload fields: `struct` code and the TSDL of one element.

    PADDED is an array of bytes: the first 16 are given, the others are zero. SEQUENCE
    holds as many pointers as it says, its length before it; NUMBERS likewise, of 32 bits.
    NAME is a text in a field of fixed length.
    """

    POINTER = ("Q", _POINTER)
    UNSIGNED = ("Q", "integer { size = 64; align = 8; signed = 0; encoding = none; base = 10; }")
    SIGNED = ("q", "integer { size = 64; align = 8; signed = 1; encoding = none; base = 10; }")
    DOUBLE = ("d", "floating_point { exp_dig = 11; mant_dig = 53; align = 8; }")
    UNSIGNED_32 = ("I", "integer { size = 32; align = 8; signed = 0; encoding = none; base = 10; }")
    SIGNED_32 = ("i", "integer { size = 32; align = 8; signed = 1; encoding = none; base = 10; }")
    BYTES = ("s", _BYTE)
    PADDED = ("16s8x", _BYTE)
    SEQUENCE = (None, _POINTER)
    NUMBERS = (None, "integer { size = 32; align = 8; signed = 1; encoding = none; base = 10; }")
    NAME = ("s", "integer { size = 8; align = 8; signed = 1; encoding = UTF8; base = 10; }")
    STRING = (None, "string")

    def __init__(self, code: str | None, tsdl: str) -> None:
        self.code = code
        self.tsdl = tsdl


@dataclass(frozen=True, slots=True)
class EventField:
    """A payload field; `length` is the number of elements of BYTES, PADDED and NAME."""

    name: str
    kind: FieldKind
    length: int = 0


def parse_fields(text: str) -> tuple[EventField, ...]:
    """Fields from text such as `message pointer, gid bytes 24`."""
    fields = []
    for part in filter(None, text.split(", ")):
        name, kind, *length = part.split()
        fields.append(EventField(name, FieldKind[kind.upper()], int(*length)))
    return tuple(fields)


SIGNATURES: Mapping[str, tuple[EventField, ...]] = MappingProxyType(
    {
        name: parse_fields(fields)
        for name, fields in {
            "ros2:rcl_init": "context_handle pointer, version string",
            "ros2:rcl_node_init": "node_handle pointer, rmw_handle pointer, node_name string, "
            "namespace string",
            "ros2:rmw_publisher_init": "rmw_publisher_handle pointer, gid bytes 24",
            "ros2:rcl_publisher_init": "publisher_handle pointer, node_handle pointer, "
            "rmw_publisher_handle pointer, topic_name string, queue_depth unsigned",
            "ros2:rclcpp_publish": "publisher_handle pointer, message pointer",
            "ros2:rclcpp_intra_publish": "publisher_handle pointer, message pointer",
            "ros2:rcl_publish": "publisher_handle pointer, message pointer",
            "ros2:rmw_publish": "rmw_publisher_handle pointer, message pointer, timestamp signed",
            "ros2:rmw_subscription_init": "rmw_subscription_handle pointer, gid bytes 24",
            "ros2:rcl_subscription_init": "subscription_handle pointer, node_handle pointer, "
            "rmw_subscription_handle pointer, topic_name string, queue_depth unsigned",
            "ros2:rclcpp_subscription_init": "subscription_handle pointer, subscription pointer",
            "ros2:rclcpp_subscription_callback_added": "subscription pointer, callback pointer",
            "ros2:rmw_take": "rmw_subscription_handle pointer, message pointer, "
            "source_timestamp signed, taken signed_32",
            "ros2:rcl_take": "message pointer",
            "ros2:rclcpp_take": "message pointer",
            "ros2:rcl_service_init": "service_handle pointer, node_handle pointer, "
            "rmw_service_handle pointer, service_name string",
            "ros2:rclcpp_service_callback_added": "service_handle pointer, callback pointer",
            "ros2:rcl_client_init": "client_handle pointer, node_handle pointer, "
            "rmw_client_handle pointer, service_name string",
            "ros2:rmw_client_init": "rmw_client_handle pointer, gid bytes 16",
            "ros2:rmw_send_request": "rmw_client_handle pointer, request pointer, "
            "sequence_number signed",
            "ros2:rmw_take_request": "rmw_service_handle pointer, request pointer, "
            "client_gid bytes 16, sequence_number signed, taken signed_32",
            "ros2:rmw_send_response": "rmw_service_handle pointer, response pointer, "
            "client_gid bytes 16, sequence_number signed, timestamp signed",
            "ros2:rmw_take_response": "rmw_client_handle pointer, response pointer, "
            "sequence_number signed, source_timestamp signed, taken signed_32",
            "ros2:rcl_timer_init": "timer_handle pointer, period signed",
            "ros2:rclcpp_timer_callback_added": "timer_handle pointer, callback pointer",
            "ros2:rclcpp_timer_link_node": "timer_handle pointer, node_handle pointer",
            "ros2:rclcpp_callback_register": "callback pointer, symbol string",
            "ros2:callback_start": "callback pointer, is_intra_process signed_32",
            "ros2:callback_end": "callback pointer",
            "ros2:rcl_lifecycle_state_machine_init": "node_handle pointer, state_machine pointer",
            "ros2:rcl_lifecycle_transition": "state_machine pointer, start_label string, "
            "goal_label string",
            "ros2:rclcpp_executor_get_next_ready": "",
            "ros2:rclcpp_executor_wait_for_work": "timeout signed",
            "ros2:rclcpp_executor_execute": "handle pointer",
            "ros2:rclcpp_construct_ring_buffer": "buffer pointer, capacity unsigned",
            "ros2:rclcpp_buffer_to_ipb": "buffer pointer, ipb pointer",
            "ros2:rclcpp_ipb_to_subscription": "ipb pointer, subscription pointer",
            "ros2:rclcpp_ring_buffer_enqueue": "buffer pointer, index unsigned, size unsigned, "
            "overwritten signed_32",
            "ros2:rclcpp_ring_buffer_dequeue": "buffer pointer, index unsigned, size unsigned",
            "ros2:rclcpp_ring_buffer_clear": "buffer pointer",
            "ros2:message_link_periodic_async": "subs sequence, pubs sequence",
            "ros2:message_link_partial_sync": "subs sequence, pubs sequence",
            "ros2:message_link_approximate_sync": "subs sequence, pubs sequence",
            "agnocast:agnocast_init": "context_handle pointer",
            "agnocast:agnocast_node_init": "node_handle pointer, node_name string, "
            "namespace string",
            "agnocast:agnocast_publisher_init": "publisher_handle pointer, node_handle pointer, "
            "topic_name string, queue_depth unsigned",
            "agnocast:agnocast_subscription_init": "subscription_handle pointer, "
            "node_handle pointer, callback pointer, callback_group pointer, symbol string, "
            "topic_name string, queue_depth unsigned, pid_callback_info_id unsigned, "
            "pid_ciid unsigned",
            "agnocast:agnocast_timer_init": "timer_handle pointer, node_handle pointer, "
            "callback pointer, callback_group pointer, symbol string, period signed",
            "agnocast:agnocast_construct_executor": "executor_addr pointer, "
            "executor_type_name string",
            "agnocast:agnocast_add_callback_group": "executor_addr pointer, node_handle pointer, "
            "callback_group_addr pointer, group_type_name string",
            "agnocast:agnocast_publish": "publisher_handle pointer, message pointer, "
            "entry_id signed",
            "agnocast:agnocast_create_callable": "callable pointer, message pointer, "
            "entry_id signed, pid_callback_info_id unsigned, pid_ciid unsigned",
            "agnocast:agnocast_create_timer_callable": "callable pointer, timer_handle pointer",
            "agnocast:agnocast_callable_start": "callable pointer",
            "agnocast:agnocast_callable_end": "callable pointer",
            "agnocast:agnocast_take": "subscription_handle pointer, message pointer, "
            "entry_id signed",
            "ros2_caret:dds_write": "message pointer",
            "ros2_caret:dds_bind_addr_to_stamp": "addr pointer, source_stamp signed",
            "ros2_caret:on_data_available": "source_stamp signed",
            "ros2_caret:sim_time": "stamp signed",
            "ros2_caret:construct_executor": "executor_addr pointer, executor_type_name string",
            "ros2_caret:add_callback_group": "executor_addr pointer, "
            "callback_group_addr pointer, group_type_name string",
            "ros2_caret:callback_group_add_timer": "callback_group_addr pointer, "
            "timer_handle pointer",
            "ros2_caret:callback_group_add_subscription": "callback_group_addr pointer, "
            "subscription_handle pointer",
            "dds:create_writer": "writer pointer, topic_name string, gid_prefix bytes 12, "
            "gid_entity bytes 4, gid bytes 16",
            "dds:create_reader": "reader pointer, topic_name string, gid_prefix bytes 12, "
            "gid_entity bytes 4, gid bytes 16",
            "dds:write_pre": "writer pointer, data pointer",
            "dds:write": "writer pointer, data pointer, timestamp signed",
            "dds:read": "reader pointer, buffer pointer",
        }.items()
    }
)

OWN_SIGNATURES: Mapping[str, tuple[EventField, ...]] = MappingProxyType(
    {"my_pkg:frame_done": parse_fields("frame unsigned, score double, label string")}
)
"""Events of tracepoints of the user's own, which no release of ROS 2 has."""

KERNEL_SIGNATURES: Mapping[str, tuple[EventField, ...]] = MappingProxyType(
    {
        name: parse_fields(fields)
        for name, fields in {
            "sched_switch": "prev_comm name 16, prev_tid signed_32, prev_prio signed_32, "
            "prev_state signed, next_comm name 16, next_tid signed_32, next_prio signed_32",
            "sched_waking": "comm name 16, tid signed_32, prio signed_32, target_cpu signed_32",
            "sched_migrate_task": "comm name 16, tid signed_32, prio signed_32, "
            "orig_cpu signed_32, dest_cpu signed_32",
            "sched_process_fork": "parent_comm name 16, parent_tid signed_32, "
            "parent_pid signed_32, child_comm name 16, child_tid signed_32, vtids numbers, "
            "child_pid signed_32, child_ns_inum unsigned",
            "irq_handler_entry": "irq signed_32, name string",
            "irq_handler_exit": "irq signed_32, ret signed_32",
            "irq_softirq_entry": "vec unsigned_32",
            "irq_softirq_exit": "vec unsigned_32",
            "timer_hrtimer_expire_entry": "hrtimer pointer, now signed, function pointer",
            "timer_hrtimer_expire_exit": "hrtimer pointer",
        }.items()
    }
)
"""Events of the kernel, as lttng-modules has them."""

PERF_NAMES: Mapping[str, str] = MappingProxyType(
    {
        name: f"sched:{name}" if name.startswith("sched") else name.replace("_", ":", 1)
        for name in KERNEL_SIGNATURES
    }
    | {
        "irq_handler_entry": "irq:irq_handler_entry",
        "irq_handler_exit": "irq:irq_handler_exit",
    }
)
"""What perf calls these."""

_OF_NAMESPACES = {"parent_pid", "child_pid", "vtids", "child_ns_inum"}


@cache
def perf_fields(event: str) -> tuple[EventField, ...]:
    """Fields of an event of the kernel that perf has, with their names in `KERNEL_SIGNATURES`."""
    return tuple(
        replace(field, kind=FieldKind.STRING, length=0) if field.kind is FieldKind.NAME else field
        for field in KERNEL_SIGNATURES[event]
        if field.name not in _OF_NAMESPACES
    )
