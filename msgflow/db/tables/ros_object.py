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

table(
    "publisher",
    key("publisher_id", "Identity of the publisher"),
    process_id(),
    node_id(),
    text("topic_name", "Fully expanded topic name"),
    handle("publisher_handle", "rcl publisher handle"),
    handle("rmw_handle", "rmw publisher handle"),
    column("gid", "Global identifier, 16 bytes; NULL: none", BLOB),
    number("queue_depth", "History depth asked for"),
    moment("created_ns", "First initialisation event", clock="process_id"),
    flag("is_internal", "Infrastructure of ROS (/rosout, /parameter_events, ...)"),
    flag("is_inferred", "Its initialisation was not traced"),
    flag("is_topic_learned", "Its topic was deduced from a link", is_hidden=True),
    flag("is_topic_declared", "Its topic was given by a file of links"),
    flag("is_agnocast", "Its messages pass through the shared memory of Agnocast"),
    comment="One row per publisher",
    view="Publishers, those of ROS itself marked as internal.",
)

table(
    "subscription",
    key("subscription_id", "Identity of the subscription"),
    process_id(),
    node_id(),
    text("topic_name", "Fully expanded topic name"),
    handle("subscription_handle", "rcl subscription handle"),
    handle("rmw_handle", "rmw subscription handle"),
    column("gid", "Global identifier, 16 bytes; NULL: none", BLOB),
    number("queue_depth", "History depth asked for"),
    moment("created_ns", "First initialisation event", clock="process_id"),
    flag("is_internal", "Infrastructure of ROS (/parameter_events, /clock, ...)"),
    flag("is_inferred", "Its initialisation was not traced"),
    flag("is_topic_learned", "Its topic was deduced from a link", is_hidden=True),
    flag("is_topic_declared", "Its topic was given by a file of links"),
    flag("is_agnocast", "Its messages pass through the shared memory of Agnocast"),
    comment="One row per subscription",
    view="Subscriptions, those of ROS itself marked as internal.",
)

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

table(
    "service",
    key("service_id", "Identity of the service"),
    process_id(),
    node_id(),
    text("service_name", "Fully expanded service name"),
    handle("service_handle", "rcl service handle"),
    handle("rmw_handle", "rmw service handle"),
    column("gid", "Global identifier, 16 bytes; NULL: none", BLOB),
    moment("created_ns", "rcl_service_init", clock="process_id"),
    flag("is_internal", "Infrastructure of ROS (parameter and lifecycle services)"),
    comment="One row per service",
    view="Services, those of ROS itself marked as internal.",
    computed=(_IS_INFERRED,),
)

table(
    "client",
    key("client_id", "Identity of the client"),
    process_id(),
    node_id(),
    text("service_name", "Fully expanded service name"),
    handle("client_handle", "rcl client handle"),
    handle("rmw_handle", "rmw client handle"),
    column("gid", "Identifier that servers see, 16 bytes; NULL: none", BLOB),
    moment("created_ns", "rcl_client_init", clock="process_id"),
    flag("is_internal", "Infrastructure of ROS (parameter and lifecycle services)"),
    comment="One row per service client",
    view="Service clients, those of ROS itself marked as internal.",
    computed=(_IS_INFERRED,),
)
