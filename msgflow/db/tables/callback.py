"""Tables of callbacks, their groups and runs, and of the executors that run them."""

from __future__ import annotations

from sqlalchemy import BOOLEAN

from msgflow.db.tables.column import (
    column,
    event_order,
    flag,
    handle,
    identity,
    integer,
    key,
    moment,
    node_id,
    process_id,
    reference,
    table,
    text,
    thread_id,
    trace_id,
)

_IS_END_INFERRED = column(
    "is_end_inferred",
    "No callback_end: a service callback that answers later (before Kilted), which was over at "
    "the next executor event of its thread at the latest",
    BOOLEAN,
    sql="self.end_ns IS NOT NULL AND self.end_event_id IS NULL",
)

table(
    "callback",
    key("callback_id", "Identity of the callback"),
    process_id(),
    node_id(),
    text(
        "kind",
        "'subscription', 'timer', 'service', 'function' (of Python: a task, of an action or client)"
        " or 'unknown'",
        required=True,
    ),
    reference("subscription_id", "Its subscription"),
    reference("timer_id", "Its timer"),
    reference("service_id", "Its service"),
    handle("callback_handle", "Address of the callback object"),
    text("symbol", "Function registered for it; NULL: none or unresolvable"),
    moment("created_ns", "First initialisation event", clock="process_id"),
    comment="One row per callback object",
    view="Callback objects and what they belong to.",
)

table(
    "callback_group",
    key("callback_group_id", "Identity of the callback group"),
    process_id(),
    reference("executor_id", "Executor that it was added to"),
    text(
        "kind", "'mutually_exclusive', 'reentrant' or 'unknown', as CARET names it", required=True
    ),
    comment="One row per callback group of an executor",
    view=(
        "Callback groups, where the trace has them (CARET). Callbacks of a mutually exclusive "
        "group never run at the same time."
    ),
)

table(
    "callback_group_member",
    reference("callback_group_id", "The callback group", required=True),
    reference("callback_id", "The callback", required=True),
    comment="One row per callback in a callback group",
    view="Callbacks of the callback groups.",
)

table(
    "callback_instance",
    identity("callback_instance_id", "Identity of the callback instance"),
    trace_id(),
    reference("callback_id", "Callback that ran", required=True),
    process_id(),
    thread_id(),
    moment("start_ns", "callback_start", required=True, clock="process_id"),
    moment(
        "end_ns",
        "callback_end, else what is_end_inferred says; NULL: never seen to end",
        clock="process_id",
    ),
    reference("take_id", "Message it was called with"),
    reference("request_id", "Request it was called with"),
    reference("response_id", "Response that it follows from, in Python"),
    reference(
        "continues_id",
        "Callback instance that it is a later step of, in Python; NULL: it is the first",
        to="callback_instance",
    ),
    flag("is_intra_process", "Called with an intra-process message"),
    reference("parent_id", "Callback instance that it is nested in", to="callback_instance"),
    integer("depth", "Nesting depth on its thread, from 1", required=True),
    event_order("start_event_id", "callback_start"),
    event_order("end_event_id", "callback_end; NULL: never seen to end"),
    event_order(
        "effective_end_event_id", "callback_end, else the first event that cannot be inside"
    ),
    flag(
        "is_loss_affected",
        "A gap inside or beside it on its thread may hide its end or what it did",
    ),
    comment="One row per callback instance",
    view="Callback instances.",
    computed=(_IS_END_INFERRED,),
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
