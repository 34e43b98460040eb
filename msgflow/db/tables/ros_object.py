"""Tables of ROS objects: publishers, subscriptions, timers, services, clients."""

from __future__ import annotations

from sqlalchemy import BLOB, BOOLEAN

from msgflow.db.tables.column import (
    column,
    flag,
    handle,
    key,
    moment,
    node_id,
    number,
    process_id,
    table,
    text,
)

_IS_INFERRED = column(
    "is_inferred", "Its initialisation was not traced", BOOLEAN, sql="self.created_ns IS NULL"
)


def _topic_endpoint(kind: str, internal: str) -> None:
    """Define the table of publishers or subscriptions."""
    table(
        kind,
        key(f"{kind}_id", f"Identity of the {kind}"),
        process_id(),
        node_id(),
        text("topic_name", "Fully expanded topic name"),
        handle(f"{kind}_handle", f"rcl {kind} handle"),
        handle("rmw_handle", f"rmw {kind} handle"),
        column("gid", "Global identifier, 16 bytes; NULL: none", BLOB),
        number("queue_depth", "History depth asked for"),
        moment("created_ns", "First initialisation event", clock="process_id"),
        flag("is_internal", f"Infrastructure of ROS ({internal}, ...)"),
        flag("is_inferred", "Its initialisation was not traced"),
        flag("is_topic_learned", "Its topic was deduced from a link", is_hidden=True),
        flag("is_topic_declared", "Its topic was given by a file of links"),
        flag("is_agnocast", "Its messages pass through the shared memory of Agnocast"),
        comment=f"One row per {kind}",
        view=f"{kind.capitalize()}s, those of ROS itself marked as internal.",
    )


def _service_endpoint(kind: str, words: str, gid: str) -> None:
    """Define the table of services or clients."""
    table(
        kind,
        key(f"{kind}_id", f"Identity of the {kind}"),
        process_id(),
        node_id(),
        text("service_name", "Fully expanded service name"),
        handle(f"{kind}_handle", f"rcl {kind} handle"),
        handle("rmw_handle", f"rmw {kind} handle"),
        column("gid", f"{gid}, 16 bytes; NULL: none", BLOB),
        moment("created_ns", f"rcl_{kind}_init", clock="process_id"),
        flag("is_internal", "Infrastructure of ROS (parameter and lifecycle services)"),
        comment=f"One row per {words}",
        view=f"{words.capitalize()}s, those of ROS itself marked as internal.",
        computed=(_IS_INFERRED,),
    )


_topic_endpoint("publisher", "/rosout, /parameter_events")
_topic_endpoint("subscription", "/parameter_events, /clock")

table(
    "untraced_reader",
    process_id(),
    text("topic_name", "Topic of ROS that it reads", required=True),
    moment("created_ns", "dds:create_reader", clock="process_id", required=True),
    comment="One row per reader of DDS that belongs to no traced subscription",
    view="Who else subscribes: readers that an instrumented DDS created for topics of ROS, "
    "in processes without a traced subscription of the topic, such as programs without ROS.",
)

table(
    "timer",
    key("timer_id", "Identity of the timer"),
    process_id(),
    node_id(),
    number("period_ns", "Period; NULL: not known", unit="ns"),
    handle("timer_handle", "rcl timer handle"),
    moment("created_ns", "rcl_timer_init", clock="process_id"),
    comment="One row per timer",
    view="Timers. If the initialisation of a timer was not traced, its period is not known.",
    computed=(_IS_INFERRED,),
)

_service_endpoint("service", "service", "Global identifier")
_service_endpoint("client", "service client", "Identifier that servers see")
