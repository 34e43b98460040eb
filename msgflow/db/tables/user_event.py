"""Table of the events that the user's own programs recorded."""

from __future__ import annotations

from msgflow.db.tables.column import (
    flag,
    identity,
    integer,
    moment,
    process_id,
    reference,
    table,
    text,
    thread_id,
    trace_id,
)

table(
    "user_event",
    identity("user_event_id", "Identity of the event"),
    trace_id(),
    process_id(),
    thread_id(),
    integer("cpu", "CPU that it happened on"),
    moment("at_ns", "When it happened", required=True, clock="process_id"),
    text("name", "Provider and event, such as my_pkg:frame_done", required=True),
    reference(
        "callback_instance_id",
        "Innermost callback instance inside which it happened, on its thread; NULL: none",
    ),
    text("fields", "Its fields, a JSON object: fields->>'$.name' is one of them", required=True),
    flag("is_loss_affected", "A gap may hide that the callback instance was over"),
    comment="One row per event whose name a pattern of msgflow ingest --events matches",
    view="Events of the user's own tracepoints.",
)
