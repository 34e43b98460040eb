"""Tables of a profile: which functions ran, as samples of stacks tell."""

from __future__ import annotations

from sqlalchemy import INTEGER, Column, Table

from msgflow.db.tables.column import (
    STORE,
    key,
    moment,
    number,
    process_id,
    reference,
    run_id,
    text,
    thread_id,
)


def _stack_id() -> Column[int]:
    return reference("stack_id", "The stack", to="stack.stack_id", required=True)


def _frame(comment: str) -> Column[int]:
    return reference("stack_frame_id", comment, to="stack_frame.stack_frame_id", required=True)


Table(
    "stack_frame",
    STORE,
    key("stack_frame_id", "Identity of the function"),
    run_id(),
    text("function", "Its name; '[unknown]': the file has no symbol for it", required=True),
    text("file", "Library or program that has it, of Python the source file", required=True),
    comment="One row per function and file",
    info={"view": "Functions that samples of stacks saw."},
)

Table(
    "stack",
    STORE,
    key("stack_id", "Identity of the stack"),
    run_id(),
    _frame("The function that ran: the innermost one"),
    Column("depth", INTEGER, nullable=False, comment="How many calls it has"),
    comment="One row per different stack",
    info={"view": "Stacks of calls that samples saw, each once, with the function that ran."},
)

Table(
    "stack_call",
    STORE,
    run_id(),
    _stack_id(),
    Column("position", INTEGER, nullable=False, comment="Place of the call, 1: the outermost"),
    _frame("The function that was called"),
    comment="One row per stack and call in it",
    info={"view": "The calls of each stack."},
)

Table(
    "stack_sample",
    STORE,
    run_id(),
    process_id(),
    thread_id("Thread that ran; NULL: one that recorded no event", required=False),
    Column("tid", INTEGER, nullable=False, comment="Thread that ran, as perf numbers it"),
    moment("at_ns", "When", required=True, clock="process_id"),
    Column("cpu", INTEGER, comment="CPU it ran on"),
    reference(
        "callback_instance_id",
        "Innermost callback instance that ran on its thread; NULL: outside of callbacks",
        to="callback_instance.callback_instance_id",
    ),
    _stack_id(),
    number("cpu_ns", "CPU time that it stands for; NULL: perf counted cycles", unit="ns"),
    comment="One row per sample of a process with ROS events",
    info={"view": "Samples of what threads of ROS processes ran, by perf."},
)
