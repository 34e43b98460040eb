"""Tables of executors: their threads, and what these did."""

from __future__ import annotations

from msgflow.db.tables.column import (
    event_order,
    flag,
    key,
    moment,
    process_id,
    reference,
    table,
    text,
    thread_id,
)

table(
    "executor",
    key("executor_id", "Identity of the executor"),
    process_id(),
    text(
        "kind",
        "'single_threaded', 'multi_threaded', 'events' (without events of its own, but seen to "
        "serve what came first first), 'unknown', or as CARET names it",
        required=True,
    ),
    flag("is_inferred", "Deduced from the threads that run the same callbacks"),
    comment="One row per executor",
    view="Executors.",
)

table(
    "executor_thread",
    reference("executor_id", "The executor", required=True),
    thread_id("The thread"),
    comment="One row per thread of an executor",
    view="Threads of the executors.",
)

table(
    "executor_state",
    thread_id("The thread"),
    text("state", "'wait', 'process' or 'execute'", required=True),
    moment("start_ns", "Executor event that began it", required=True, clock="thread_id"),
    flag("is_behind_gap", "A gap may hide an executor event between the one before and this one"),
    reference("callback_instance_id", "First callback instance in it"),
    event_order("start_event_id", "Executor event that began it"),
    comment="One row per executor event of a thread: a state lasts until the next one",
)
