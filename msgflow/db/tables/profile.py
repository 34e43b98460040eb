"""Tables of a profile: which functions ran, as samples of stacks tell."""

from __future__ import annotations

from msgflow.db.tables.column import (
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
    "stack_frame",
    key("stack_frame_id", "Identity of the function"),
    text("function", "Its name; '[unknown]': the file has no symbol for it", required=True),
    text("file", "Library or program that has it, of Python the source file", required=True),
    comment="One row per function and file",
    view="Functions that samples of stacks saw.",
)

table(
    "stack",
    key("stack_id", "Identity of the stack"),
    reference(
        "stack_frame_id",
        "The function that ran: the innermost one, or the function of Python that the interpreter"
        " ran",
        required=True,
    ),
    integer("depth", "How many calls it has", required=True),
    comment="One row per different stack",
    view="Stacks of calls that samples saw, each once, with the function that ran.",
)

table(
    "stack_call",
    reference("stack_id", "The stack", required=True),
    integer("position", "Place of the call, 1: the outermost", required=True),
    reference("stack_frame_id", "The function that was called", required=True),
    comment="One row per stack and call in it",
    view="The calls of each stack.",
)

table(
    "stack_sample",
    process_id(),
    thread_id("Thread that ran; NULL: one that recorded no event", required=False),
    integer("tid", "Thread that ran, as perf numbers it", required=True),
    moment("at_ns", "When", required=True, clock="process_id"),
    integer("cpu", "CPU it ran on"),
    reference(
        "callback_instance_id",
        "Innermost callback instance that ran on its thread; NULL: outside of callbacks",
    ),
    reference("stack_id", "The stack", required=True),
    number("cpu_ns", "CPU time that it stands for; NULL: perf counted cycles", unit="ns"),
    comment="One row per sample of a process with ROS events",
    view="Samples of what threads of ROS processes ran, by perf.",
)
