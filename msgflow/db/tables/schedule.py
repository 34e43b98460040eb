"""Tables of scheduling: what the kernel did with threads of ROS processes."""

from __future__ import annotations

from typing import Any

from sqlalchemy import INTEGER, VARCHAR, Column, Table

from msgflow.db.tables.column import (
    STORE,
    column,
    flag,
    key,
    moment,
    number,
    reference,
    run_id,
    text,
    thread_id,
)

_POLICY = column(
    "policy",
    VARCHAR,
    "How it is scheduled, as its priority tells: 'deadline', 'real_time' or 'normal'",
    sql="CASE WHEN self.priority < 0 THEN 'deadline' WHEN self.priority < 100 THEN 'real_time' "
    "WHEN self.priority IS NOT NULL THEN 'normal' END",
)


def _preemptor() -> tuple[Column[Any], ...]:
    return (
        thread_id("Thread that had the CPU", name="preemptor_thread_id", required=False),
        reference(
            "preemptor_other_thread_id",
            "Thread of another process that had the CPU",
            to="other_thread.other_thread_id",
        ),
        Column("preemptor_priority", INTEGER, comment="The priority of that thread"),
    )


Table(
    "other_thread",
    STORE,
    key("other_thread_id", "Identity of the thread"),
    run_id(),
    reference("host_id", "Host it ran on", to="host.host_id", required=True),
    Column("tid", INTEGER, nullable=False, comment="Thread, as the kernel numbers it; 0: idle"),
    text("name", "Its name"),
    comment="One row per host, tid and name",
    info={"view": "Threads of other processes that took the CPU from a ROS thread, or woke one."},
)

Table(
    "thread_state",
    STORE,
    run_id(),
    thread_id("The thread"),
    moment("start_ns", "Begin", required=True, clock="thread_id"),
    moment("end_ns", "End", required=True, clock="thread_id"),
    text(
        "state",
        "'running', 'preempted' (the CPU was taken away), 'runnable' (woken, waits for a CPU), "
        "'sleeping', 'uninterruptible' (waits for a page or a disk) or 'unknown'",
        required=True,
    ),
    Column(
        "cpu",
        INTEGER,
        comment="CPU it ran on; preempted: the one it waits for; else the one that it left",
    ),
    Column(
        "priority",
        INTEGER,
        comment="Its priority to the kernel: 0 to 99 real-time, 100 to 139 nice -20 to 19",
    ),
    thread_id("Thread that took the CPU", name="preempted_by_thread_id", required=False),
    reference(
        "preempted_by_other_thread_id",
        "Thread of another process that took the CPU",
        to="other_thread.other_thread_id",
    ),
    Column("preempted_by_priority", INTEGER, comment="The priority of what took the CPU"),
    text(
        "waker_kind",
        "What ended the sleep: 'thread', 'timer', 'interrupt' or 'softirq'; with an interrupt the "
        "waker is what it interrupted. NULL: not known",
    ),
    thread_id("Thread that woke it", name="waker_thread_id", required=False),
    reference(
        "waker_other_thread_id",
        "Thread of another process that woke it",
        to="other_thread.other_thread_id",
    ),
    flag("is_loss_affected", "Kernel events were lost meanwhile"),
    comment="One row per interval in which a thread had one state",
    info={
        "view": "States of threads of ROS processes, as the kernel recorded them.",
        "computed": (_POLICY,),
    },
)

Table(
    "preemptor",
    STORE,
    run_id(),
    thread_id("The thread that waited"),
    moment("start_ns", "Begin", required=True, clock="thread_id"),
    moment("end_ns", "End", required=True, clock="thread_id"),
    text("state", "Its state: 'preempted' or 'runnable'", required=True),
    Column("cpu", INTEGER, comment="The CPU"),
    *_preemptor(),
    Column("thread_priority", INTEGER, comment="The priority of the thread that waited"),
    comment="One row per wait of a thread for a CPU, and stretch in which another thread had it",
    info={"view": "What ran on the CPU for which a thread of a ROS process waited."},
)

Table(
    "callback_preemptor",
    STORE,
    run_id(),
    reference(
        "callback_instance_id",
        "The callback instance that waited",
        to="callback_instance.callback_instance_id",
        required=True,
    ),
    *_preemptor(),
    number("preempted_ns", "For so long, while it was preempted", unit="ns", required=True),
    number("runnable_ns", "For so long, while it was woken", unit="ns", required=True),
    comment="One row per callback instance that waited for a CPU, and thread that had it meanwhile",
    info={"view": "What ran on the CPU for which callback instances waited, and for how long."},
)

Table(
    "callback_schedule",
    STORE,
    run_id(),
    reference(
        "callback_instance_id",
        "The callback instance",
        to="callback_instance.callback_instance_id",
        required=True,
    ),
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
    info={
        "view": "How the time of callback instances divides into states of their threads: the "
        "parts add up to the duration."
    },
)

Table(
    "cpu_usage",
    STORE,
    run_id(),
    reference("host_id", "Host", to="host.host_id", required=True),
    Column("cpu", INTEGER, comment="CPU"),
    moment("start_ns", "Begin of the second", required=True, clock="host_id"),
    thread_id("The thread; NULL: of a process without ROS", required=False),
    Column("tid", INTEGER, nullable=False, comment="Its number to the kernel; 0: idle"),
    text("name", "Its name"),
    number("running_ns", "How long it ran", unit="ns", required=True),
    number(
        "frequency_hz",
        "Mean frequency of the CPU in the second, as far as it is known; NULL: not recorded",
        unit="Hz",
    ),
    comment="One row per CPU, second and thread that ran there",
    info={
        "view": "What ran on each CPU, second by second, threads of processes without ROS included."
    },
)
