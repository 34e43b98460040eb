"""Tables of CPUs: what the kernel did with threads, and which functions samples of them saw."""

from __future__ import annotations

from typing import Any

from sqlalchemy import VARCHAR, Column

from msgflow.db.tables.column import (
    column,
    flag,
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

_POLICY = column(
    "policy",
    "How it is scheduled, as its priority tells: 'deadline', 'real_time' or 'normal'",
    VARCHAR,
    sql="CASE WHEN self.priority < 0 THEN 'deadline' WHEN self.priority < 100 THEN 'real_time' "
    "WHEN self.priority IS NOT NULL THEN 'normal' END",
)


def _preemptor() -> tuple[Column[Any], ...]:
    return (
        thread_id("Thread that had the CPU", name="preemptor_thread_id", required=False),
        reference(
            "preemptor_other_thread_id",
            "Thread of another process that had the CPU",
            to="other_thread",
        ),
        integer("preemptor_priority", "The priority of that thread"),
    )


table(
    "other_thread",
    key("other_thread_id", "Identity of the thread"),
    reference("host_id", "Host it ran on", required=True),
    integer("tid", "Thread, as the kernel numbers it; 0: idle", required=True),
    text("name", "Its name"),
    comment="One row per host, tid and name",
    view="Threads of other processes that took the CPU from a ROS thread, or woke one.",
)

table(
    "thread_state",
    thread_id("The thread"),
    moment("start_ns", "Begin", required=True, clock="thread_id"),
    moment("end_ns", "End", required=True, clock="thread_id"),
    text(
        "state",
        "'running', 'preempted' (the CPU was taken away), 'runnable' (woken, waits for a CPU), "
        "'sleeping', 'uninterruptible' (waits for a page or a disk) or 'unknown'",
        required=True,
    ),
    integer("cpu", "CPU it ran on; preempted: the one it waits for; else the one that it left"),
    integer("priority", "Its priority to the kernel: 0 to 99 real-time, 100 to 139 nice -20 to 19"),
    thread_id("Thread that took the CPU", name="preempted_by_thread_id", required=False),
    reference(
        "preempted_by_other_thread_id",
        "Thread of another process that took the CPU",
        to="other_thread",
    ),
    integer("preempted_by_priority", "The priority of what took the CPU"),
    text(
        "waker_kind",
        "What ended the sleep: 'thread', 'timer', 'interrupt' or 'softirq'; with an interrupt the "
        "waker is what it interrupted. NULL: not known",
    ),
    thread_id("Thread that woke it", name="waker_thread_id", required=False),
    reference("waker_other_thread_id", "Thread of another process that woke it", to="other_thread"),
    flag("is_loss_affected", "Kernel events were lost meanwhile"),
    comment="One row per interval in which a thread had one state",
    view="States of threads of ROS processes, as the kernel recorded them.",
    computed=(_POLICY,),
)

table(
    "preemptor",
    thread_id("The thread that waited"),
    moment("start_ns", "Begin", required=True, clock="thread_id"),
    moment("end_ns", "End", required=True, clock="thread_id"),
    text("state", "Its state: 'preempted' or 'runnable'", required=True),
    integer("cpu", "The CPU"),
    *_preemptor(),
    integer("thread_priority", "The priority of the thread that waited"),
    comment="One row per wait of a thread for a CPU, and stretch in which another thread had it",
    view="What ran on the CPU for which a thread of a ROS process waited.",
)

table(
    "callback_preemptor",
    reference("callback_instance_id", "The callback instance that waited", required=True),
    *_preemptor(),
    number("preempted_ns", "For so long, while it was preempted", unit="ns", required=True),
    number("runnable_ns", "For so long, while it was woken", unit="ns", required=True),
    comment="One row per callback instance that waited for a CPU, and thread that had it meanwhile",
    view="What ran on the CPU for which callback instances waited, and for how long.",
)

table(
    "callback_schedule",
    reference("callback_instance_id", "The callback instance", required=True),
    number("running_ns", "On a CPU", unit="ns", required=True),
    number("preempted_ns", "Ready, but another thread had the CPU", unit="ns", required=True),
    number("runnable_ns", "Woken, waiting for a CPU", unit="ns", required=True),
    number("sleeping_ns", "Waiting for something", unit="ns", required=True),
    number("uninterruptible_ns", "Waiting for a page or a disk", unit="ns", required=True),
    number("unknown_ns", "Not known", unit="ns", required=True),
    number("preemption_count", "How often the CPU was taken away", required=True),
    number("migration_count", "How often it went on on another CPU", required=True),
    flag("is_loss_affected", "Kernel events were lost meanwhile"),
    number("irq_ns", "Of the time on a CPU, interrupts; NULL: not recorded", unit="ns"),
    number(
        "softirq_ns",
        "Of the time on a CPU, what interrupts left for later; NULL: not recorded",
        unit="ns",
    ),
    comment="One row per callback instance that ended, on a thread whose states are known",
    view=(
        "How the time of callback instances divides into states of their threads: the "
        "parts add up to the duration."
    ),
)

table(
    "cpu_usage",
    reference("host_id", "Host", required=True),
    integer("cpu", "CPU"),
    moment("start_ns", "Begin of the second", required=True, clock="host_id"),
    thread_id("The thread; NULL: of a process without ROS", required=False),
    integer("tid", "Its number to the kernel; 0: idle", required=True),
    text("name", "Its name"),
    number("running_ns", "How long it ran", unit="ns", required=True),
    number(
        "frequency_hz",
        "Mean frequency of the CPU in the second, as far as it is known; NULL: not recorded",
        unit="Hz",
    ),
    comment="One row per CPU, second and thread that ran there",
    view="What ran on each CPU, second by second, threads of processes without ROS included.",
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
