"""Tables of hosts, processes, threads and nodes."""

from __future__ import annotations

from sqlalchemy import BOOLEAN

from msgflow.db.tables.column import (
    column,
    event_order,
    flag,
    handle,
    integer,
    key,
    moment,
    number,
    process_id,
    reference,
    table,
    text,
    thread_id,
)

table(
    "host",
    key("host_id", "Identity of the host"),
    reference("clock_id", "Clock of the host", required=True),
    text("hostname", "Name recorded in the trace, or given by the user", required=True),
    comment="One row per machine or container",
    view="Machines and containers.",
)

table(
    "process",
    key("process_id", "Identity of the process life"),
    reference("host_id", "Host it ran on", required=True),
    integer(
        "pid",
        "Process id; the one inside its PID namespace if the trace has no other",
        required=True,
    ),
    text("name", "Name of the process (its first thread)"),
    text("tracetools_version", "Version that rcl_init reported; for display only"),
    text(
        "python_version",
        "Version of Python, where callbacks of its nodes are traced (msgflow record)",
    ),
    moment("first_seen_ns", "First event", clock="process_id"),
    moment("last_seen_ns", "Last event", clock="process_id"),
    number(
        "pid_namespace",
        "PID namespace, where the trace has it; a negative number if msgflow gave it, since "
        "processes have equal ids",
    ),
    integer("life", "Number of this life among those of the pid, from 1", required=True),
    column(
        "is_ambiguous",
        "Several processes with equal ids are one here: nothing tells them apart",
        BOOLEAN,
    ),
    comment="One row per process life",
    view="Process lives: a pid that is used again is another process.",
)

table(
    "thread",
    key("thread_id", "Identity of the thread"),
    process_id(),
    integer(
        "tid",
        "Thread id; the one inside its PID namespace if the trace has no other",
        required=True,
    ),
    text("name", "Name of the thread"),
    event_order("first_event_id", "First event"),
    event_order("last_event_id", "Last event"),
    moment("first_seen_ns", "First event", clock="process_id"),
    moment("last_seen_ns", "Last event", clock="process_id"),
    comment="One row per thread",
    view="Threads, each with its last name.",
)

table(
    "node",
    key("node_id", "Identity of the node"),
    process_id(),
    text("name", "Name without namespace"),
    text("namespace", "Namespace, beginning with /"),
    text(
        "full_name",
        "Namespace and name; behind @ the host or process, where nodes of several processes have "
        "that name at a time",
    ),
    handle("node_handle", "rcl node handle"),
    moment("created_ns", "rcl_node_init", clock="process_id"),
    flag("is_inferred", "Its initialisation was not traced"),
    comment="One row per ROS node",
    view="ROS nodes.",
)

table(
    "lifecycle_transition",
    reference("node_id", "The node"),
    moment("at_ns", "Moment of the change", required=True, clock="node_id"),
    text("start_state", "State that was left"),
    text("goal_state", "State that was entered"),
    comment="One row per state change of a managed node",
    view="State changes of managed nodes.",
)

table(
    "simulated_time",
    process_id(),
    moment("at_ns", "When it was recorded", clock="process_id", required=True),
    number("simulated_ns", "Time of the simulation", unit="ns", required=True),
    comment="One row per moment at which the time of a simulation is known",
    view="What time it was in the simulation, as CARET's clock recorder tells about once a "
    "second. Between two moments it runs evenly: query --times sim writes times in it.",
)

table(
    "thread_break",
    thread_id("Thread whose events may be missing"),
    moment(
        "resumed_ns", "First event of the thread behind the gap", required=True, clock="thread_id"
    ),
    event_order("resumed_event_id", "First event of the thread behind the gap"),
    flag(
        "is_elsewhere",
        "Events were lost only on other CPUs, which the thread may have visited meanwhile: "
        "pairs may reach across",
    ),
    comment="One row per gap in the record of a thread",
    view=(
        "Where the record of a thread breaks: events of the thread may be missing before these "
        "moments. No executor state reaches across a break, and pairs of events that do are "
        "marked."
    ),
)
