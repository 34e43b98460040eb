"""What had the CPU for which threads waited, and interrupts, from a kernel trace."""

from __future__ import annotations

from typing import Any

import pytest
from support.analysis import Analyse, Analysis
from support.kernel_schedule import BLOCKED, HOG, KERNEL, MAIN, TIMER, Kernel, call, recorded
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import few

OTHER = 6


def waits(model: Analysis) -> list[tuple[Any, ...]]:
    return model.rows(
        "SELECT o.tid, p.state, p.cpu, p.start_ns, p.end_ns, p.preemptor_priority, "
        "p.thread_priority FROM preemptor AS p JOIN other_thread AS o "
        "ON p.preemptor_other_thread_id = o.other_thread_id ORDER BY p.start_ns"
    )


def of_callback(model: Analysis) -> list[tuple[Any, ...]]:
    return model.rows(
        "SELECT coalesce(o.tid, 0) AS tid, p.preempted_ns, p.runnable_ns "
        "FROM callback_preemptor AS p LEFT JOIN other_thread AS o "
        "ON p.preemptor_other_thread_id = o.other_thread_id ORDER BY tid"
    )


def test_all_that_had_the_cpu_have_their_time(system: RosSystem, analyse: Analyse) -> None:
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1100, 41, HOG)
    kernel.switch(1150, HOG, OTHER)
    kernel.switch(1300, OTHER, 41)
    kernel.switch(2100, 41, 0, BLOCKED)
    call(system, 1000, 2000)
    model = analyse(system)
    assert waits(model) == [
        (HOG, "preempted", 0, 1100, 1150, 119, 120),
        (OTHER, "preempted", 0, 1150, 1300, 119, 120),
    ]
    assert of_callback(model) == [(OTHER, 150, 0), (HOG, 50, 0)]
    assert model.rows("SELECT preemption_count, preempted_ns FROM callback_schedule") == [(1, 200)]


def test_what_the_next_switch_contradicts_did_not_have_the_cpu(
    system: RosSystem, analyse: Analyse
) -> None:
    """What got the CPU lost it unseen to what leaves it, at an unknown time."""
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1100, 41, HOG)
    kernel.switch(1150, OTHER, HOG)
    kernel.switch(1300, HOG, 41)
    kernel.switch(2100, 41, 0, BLOCKED)
    call(system, 1000, 2000)
    model = analyse(system)
    assert waits(model) == [(HOG, "preempted", 0, 1150, 1300, 119, 120)]
    assert model.rows("SELECT preemption_count, preempted_ns FROM callback_schedule") == [(1, 200)]


def test_an_idle_cpu_takes_nothing_where_a_switch_to_another_thread_is_missing(
    system: RosSystem, analyse: Analyse
) -> None:
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, 0, BLOCKED)
    kernel.wake(1300, 41)
    kernel.switch(1500, HOG, 41)
    kernel.switch(2100, 41, 0, BLOCKED)
    call(system, 1000, 2000)
    model = analyse(system)
    assert waits(model) == []
    assert model.rows("SELECT runnable_ns, sleeping_ns FROM callback_schedule") == [(200, 100)]


def test_a_cpu_that_the_kernel_lets_idle_was_taken_by_no_thread(
    system: RosSystem, analyse: Analyse
) -> None:
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1100, 41, HOG)
    kernel.switch(1150, HOG, 0, BLOCKED)
    kernel.switch(1300, 0, 41)
    kernel.switch(1400, 41, 0)
    kernel.switch(1450, 0, 41)
    kernel.switch(2100, 41, 0, BLOCKED)
    kernel.wake(2200, 41)
    kernel.switch(2210, 0, 41)
    call(system, 1000, 2000)
    model = analyse(system)
    # What was interrupted when the thread was woken is known, too.
    assert model.rows("SELECT tid FROM other_thread ORDER BY tid") == [(0,), (HOG,)]
    assert waits(model) == [(HOG, "preempted", 0, 1100, 1150, 119, 120)]
    assert model.rows(
        "SELECT start_ns, end_ns, preemptor_priority, is_cpu_idle FROM preemptor "
        "WHERE state = 'preempted' ORDER BY start_ns"
    ) == [(1100, 1150, 119, False), (1150, 1300, None, True), (1400, 1450, None, True)]
    # What got the CPU first.
    assert model.rows(
        "SELECT start_ns, is_cpu_idle FROM thread_state WHERE state = 'preempted' ORDER BY start_ns"
    ) == [(1100, False), (1400, True)]
    assert of_callback(model) == [(0, 200, 0), (HOG, 50, 0)]
    assert model.rows(
        "SELECT is_cpu_idle, preempted_ns FROM callback_preemptor ORDER BY is_cpu_idle"
    ) == [(False, 50), (True, 200)]


def test_an_idle_cpu_is_no_thread(system: RosSystem, analyse: Analyse) -> None:
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1100, 41, 0)
    kernel.switch(1300, 0, 41)
    kernel.switch(2100, 41, 0, BLOCKED)
    call(system, 1000, 2000)
    model = analyse(system)
    assert model.rows("SELECT start_ns, is_cpu_idle FROM preemptor") == [(1100, True)]
    assert model.rows("SELECT tid FROM other_thread") == []


PROGRAMS = "SELECT tid, pid, program, command, is_recorder FROM other_thread ORDER BY tid"
DUMP = "lttng_statedump_process_state"


def test_programs_of_other_threads(system: RosSystem, analyse: Analyse) -> None:
    """The last word counts: of the dump, of a thread that begins, or of another program."""
    kernel = Kernel(system)
    kernel.add(DUMP, 100, tid=HOG, pid=5)
    kernel.add(DUMP, 100, tid=OTHER, pid=OTHER)
    # What perf says of a thread that begins.
    kernel.add("sched_process_fork", 150, child_tid=None, child_pid=HOG)
    kernel.add("sched_process_fork", 200, child_tid=HOG, child_pid=OTHER)
    kernel.add("sched_process_exec", 300, tid=OTHER, filename="/bin/false")
    kernel.add("sched_process_exec", 310, tid=OTHER, filename="/bin/true")
    kernel.switch(900, 0, 41)
    kernel.switch(1100, 41, HOG)
    kernel.switch(1150, HOG, OTHER)
    kernel.switch(1200, OTHER, TIMER)
    kernel.switch(1300, TIMER, 41)
    kernel.switch(2100, 41, 0, BLOCKED)
    call(system, 1000, 2000)
    assert analyse(system).rows(PROGRAMS) == [
        (OTHER, OTHER, "thread 6", "/bin/true", False),
        (HOG, OTHER, "thread 6", "/bin/true", False),
        (TIMER, None, "thread 8", None, False),
    ]


def test_perf_says_the_process_of_what_leaves_a_cpu(system: RosSystem, analyse: Analyse) -> None:
    """A thread of a process of ROS that has no events of its own belongs to it all the same."""
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1100, 41, HOG, perf_pid=40)
    kernel.switch(1150, HOG, OTHER, perf_pid=40)
    kernel.switch(1300, OTHER, 41, perf_pid=5)
    kernel.switch(1900, 41, OTHER, perf_pid=40)
    kernel.switch(1950, OTHER, 41, BLOCKED, perf_pid=-1)
    kernel.switch(2100, 41, 0, BLOCKED, perf_pid=40)
    call(system, 1000, 2000)
    model = analyse(system)
    assert model.rows("SELECT tid, pid, process_id FROM other_thread ORDER BY tid") == [
        (OTHER, 5, None),
        (HOG, 40, 1),
    ]


@pytest.mark.thorough
def test_a_callback_counts_only_its_own_part(system: RosSystem, analyse: Analyse) -> None:
    """The thread was preempted before the callback began, and woken when it had not yet ended."""
    recorded(system)
    model = analyse(system)
    assert of_callback(model) == [(0, 0, 100), (HOG, 200, 0)]


@pytest.mark.parametrize("traces", few([1, 2], 2))
def test_a_thread_that_migrates_waits_for_another_cpu(
    system: RosSystem, analyse: Analyse, traces: int
) -> None:
    """Two kernel traces have the same migrations and switches."""
    for trace in range(traces):
        kernel = Kernel(system, KERNEL + trace)
        kernel.switch(800, 0, OTHER, cpu=1)
        kernel.switch(900, 0, 41)
        kernel.switch(1100, 41, HOG)
        kernel.add("sched_migrate_task", 1200, tid=41, dest_cpu=1)
        kernel.switch(1300, OTHER, 41, cpu=1)
        kernel.switch(1500, 41, 0, BLOCKED, cpu=1)
    system.add("ros2:callback_start", MAIN, ts=1000, callback=0xC1, is_intra_process=0)
    system.add("ros2:callback_end", Thread(100, cpu=1), ts=1400, callback=0xC1)
    model = analyse(system)
    assert waits(model) == [
        (HOG, "preempted", 0, 1100, 1200, 119, 120),
        (OTHER, "preempted", 1, 1200, 1300, 119, 120),
    ]
    assert model.rows("SELECT count(*) FROM thread_state WHERE state = 'preempted'") == [(2,)]
    # It lost the CPU once.
    assert model.rows("SELECT preemption_count, migration_count FROM callback_schedule") == [(1, 1)]


def test_a_woken_thread_waits_where_it_goes_on(system: RosSystem, analyse: Analyse) -> None:
    """Without events of migration, that is all there is to know."""
    kernel = Kernel(system)
    kernel.switch(800, 0, OTHER, cpu=1)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, 0, BLOCKED)
    kernel.wake(1300, 41)
    kernel.switch(1350, OTHER, 41, cpu=1)
    call(system, 1000, 1150)
    assert waits(analyse(system)) == [(OTHER, "runnable", 1, 1300, 1350, 119, 120)]


@pytest.mark.parametrize(
    ("target", "moved", "expected"),
    [
        (0, None, [(HOG, "runnable", 0, 1300, 1350, 119, 120)]),
        # Where it left its CPU, or was moved to before, is not asked: events may be lost since.
        (1, None, [(OTHER, "runnable", 1, 1300, 1350, 119, 120)]),
        (
            0,
            1320,
            [
                (HOG, "runnable", 0, 1300, 1320, 119, 120),
                (OTHER, "runnable", 1, 1320, 1350, 119, 120),
            ],
        ),
        (0, 1300, [(OTHER, "runnable", 1, 1300, 1350, 119, 120)]),
    ],
)
def test_a_woken_thread_waits_where_its_waking_says_until_it_is_moved(
    system: RosSystem,
    analyse: Analyse,
    target: int,
    moved: int | None,
    expected: list[tuple[Any, ...]],
) -> None:
    kernel = Kernel(system)
    kernel.switch(800, 0, OTHER, cpu=1)
    kernel.add("sched_migrate_task", 850, tid=41, dest_cpu=0)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, HOG, BLOCKED)
    kernel.wake(1300, 41, target_cpu=target)
    if moved is not None:
        kernel.add("sched_migrate_task", moved, tid=41, dest_cpu=1)
    kernel.switch(1350, OTHER, 41, cpu=1)
    call(system, 1000, 1150)
    assert waits(analyse(system)) == expected


def test_interrupts_are_part_of_the_time_on_a_cpu(system: RosSystem, analyse: Analyse) -> None:
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.add("irq_handler_entry", 990)
    kernel.add("irq_handler_exit", 1010)
    kernel.add("irq_softirq_entry", 1100)
    kernel.add("irq_softirq_exit", 1150)
    kernel.switch(1500, 41, 0, BLOCKED)
    kernel.add("irq_softirq_entry", 1600)
    kernel.add("irq_softirq_exit", 1650)
    kernel.switch(3000, 0, HOG)
    call(system, 1000, 1400)
    model = analyse(system)
    assert model.rows("SELECT running_ns, irq_ns, softirq_ns FROM callback_schedule") == [
        (400, 10, 50)
    ]


@pytest.mark.thorough
def test_interrupts_that_were_not_recorded_are_not_known(
    system: RosSystem, analyse: Analyse
) -> None:
    recorded(system)
    assert analyse(system).rows("SELECT irq_ns, softirq_ns FROM callback_schedule") == [
        (None, None)
    ]


def test_a_priority_tells_the_policy(system: RosSystem, analyse: Analyse) -> None:
    kernel = Kernel(system)
    for ts, prio in ((900, -80), (1100, -101), (1300, 20)):
        kernel.add(
            "sched_switch",
            ts,
            prev_tid=0,
            prev_prio=20,
            prev_state=0,
            next_tid=41,
            next_prio=prio,
            next_comm="main",
        )
        kernel.add(
            "sched_switch",
            ts + 100,
            prev_tid=41,
            prev_prio=prio,
            prev_state=1,
            next_tid=0,
            next_prio=20,
            next_comm="idle",
        )
    call(system, 910, 950, MAIN)
    states = analyse(system).rows(
        "SELECT priority, policy FROM thread_state WHERE state = 'running' ORDER BY start_ns"
    )
    assert states == [(20, "real_time"), (-1, "deadline"), (120, "normal")]


def test_cpu_time_of_all_threads_by_second(system: RosSystem, analyse: Analyse) -> None:
    """Time before the first switch of a CPU, and after its last one, is not known."""
    second = 1_000_000_000
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(2000, 41, HOG, BLOCKED)
    kernel.switch(2 * second + 50, HOG, 0, BLOCKED)
    kernel.switch(2 * second + 70, 0, 41)
    call(system, 1000, 1100)
    assert analyse(system).rows(
        "SELECT start_ns, tid, thread_id, name, running_ns FROM cpu_usage ORDER BY start_ns, tid"
    ) == [
        (0, HOG, None, "thread 7", second - 2000),
        (0, 41, 1, "thread 41", 1100),
        (second, HOG, None, "thread 7", second),
        (2 * second, 0, None, "thread 0", 20),
        (2 * second, HOG, None, "thread 7", 50),
    ]


def test_a_second_has_the_mean_frequency_of_its_cpu(system: RosSystem, analyse: Analyse) -> None:
    """CPU 0 has no frequency before its first event, CPU 1 has no such event."""
    second = 1_000_000_000
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(900, 0, HOG, cpu=1)
    for at, khz in ((second // 2, 1000), (second * 3 // 4, 3000), (second * 9 // 4, 4000)):
        kernel.add("power_cpu_frequency", at, 1, of_cpu=0, frequency_khz=khz)
    kernel.switch(2 * second + 500_000_000, 41, 0, BLOCKED)
    kernel.switch(2 * second + 500_000_000, HOG, 0, cpu=1)
    call(system, 1000, 1100)
    assert analyse(system).rows(
        "SELECT cpu, start_ns, frequency_hz FROM cpu_usage ORDER BY cpu, start_ns"
    ) == [
        (0, 0, 2_000_000),
        (0, second, 3_000_000),
        (0, 2 * second, 3_500_000),
        (1, 0, None),
        (1, second, None),
        (1, 2 * second, None),
    ]


def test_a_kernel_trace_that_is_not_joined_tells_no_frequency(
    system: RosSystem, analyse: Analyse
) -> None:
    """Nor does it tell until when the last frequency holds."""
    second = 1_000_000_000
    kernel = Kernel(system)
    foreign = Kernel(system, trace=2)
    kernel.switch(900, 0, 41)
    kernel.add("power_cpu_frequency", 1000, 1, of_cpu=0, frequency_khz=3000)
    kernel.add("power_cpu_frequency", second // 4, 1, of_cpu=0, frequency_khz=4000)
    kernel.switch(second // 2, 41, 0, BLOCKED)
    foreign.switch(900, 0, HOG)
    foreign.switch(1050, HOG, OTHER)
    foreign.add("power_cpu_frequency", second // 8, 1, of_cpu=0, frequency_khz=9000)
    foreign.switch(3 * second, OTHER, 0)
    call(system, 1000, 1100)
    assert analyse(system).rows("SELECT start_ns, frequency_hz FROM cpu_usage") == [(0, 3_500_001)]


def test_what_two_kernel_traces_show_counts_once(system: RosSystem, analyse: Analyse) -> None:
    """The second one has the end of the first, too. A second of both is one row."""
    kernel = Kernel(system)
    later = Kernel(system, trace=2)
    kernel.switch(900, 0, 41)
    kernel.switch(2000, 41, HOG)
    for trace in (kernel, later):
        trace.switch(3000, HOG, 41)
        trace.switch(3300, 41, HOG)
    later.switch(4000, HOG, 0)
    call(system, 3100, 3200)
    assert analyse(system).rows("SELECT tid, name, running_ns FROM cpu_usage ORDER BY tid") == [
        (HOG, "thread 7", 1000 + 700),
        (41, "thread 41", 1100 + 300),
    ]
