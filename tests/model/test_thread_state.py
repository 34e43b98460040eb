"""States of threads from a kernel trace: its clock, its threads, switches and wakings."""

from __future__ import annotations

from typing import Any

import pytest
from support.analysis import Analyse, Analysis
from support.kernel_schedule import BLOCKED, HOG, KERNEL, MAIN, TIMER, Kernel, call, recorded
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import few

STATES = "SELECT start_ns, end_ns, state, cpu FROM thread_state ORDER BY thread_id, start_ns"


def schedules(model: Analysis) -> list[tuple[Any, ...]]:
    return model.rows(
        "SELECT running_ns, preempted_ns, runnable_ns, sleeping_ns, uninterruptible_ns, unknown_ns "
        "FROM callback_schedule ORDER BY callback_instance_id"
    )


def test_states_follow_from_switches_and_wakings(system: RosSystem, analyse: Analyse) -> None:
    recorded(system)
    model = analyse(system)
    assert model.rows(STATES) == [
        (900, 1100, "running", 0),
        (1100, 1300, "preempted", 0),
        (1300, 1500, "running", 0),
        (1500, 1700, "sleeping", 0),
        (1700, 1800, "runnable", 0),
        (1800, 2100, "running", 0),
        (2100, 3000, "sleeping", 0),
    ]
    assert schedules(model) == [(500, 200, 100, 200, 0, 0)]
    assert model.rows("SELECT preemption_count, migration_count FROM callback_schedule") == [(1, 0)]


def divided(model: Analysis, from_ns: int, to_ns: int) -> dict[str, int]:
    return dict(
        model.rows(
            f"WITH part AS (SELECT 1 AS interval_id, 1 AS thread_id, {from_ns} AS from_ns, "
            f"{to_ns} AS to_ns) SELECT state, sum(to_ns - from_ns) "
            "FROM schedule_piece('part', [1], max_wakers := 0) GROUP BY state"
        )
    )


@pytest.mark.thorough
def test_any_interval_of_a_thread_divides_as_callbacks_do(
    system: RosSystem, analyse: Analyse
) -> None:
    recorded(system)
    model = analyse(system)
    assert divided(model, 1000, 2000) == {
        "running": 500,
        "preempted": 200,
        "runnable": 100,
        "sleeping": 200,
    }
    assert schedules(model) == [(500, 200, 100, 200, 0, 0)]
    assert divided(model, 0, 950) == {"running": 50, "unknown": 900}
    assert divided(model, 0, 800) == {"unknown": 800}


def test_who_took_the_cpu_and_who_woke(system: RosSystem, analyse: Analyse) -> None:
    """A timer's interrupt woke the thread, not what it interrupted."""
    recorded(system)
    model = analyse(system)
    assert model.rows(
        "SELECT s.state, o.tid, o.name, s.preempted_by_priority, s.waker_kind "
        "FROM thread_state AS s LEFT JOIN other_thread AS o ON o.other_thread_id = "
        "coalesce(s.preempted_by_other_thread_id, s.waker_other_thread_id) "
        "WHERE s.state IN ('preempted', 'runnable') ORDER BY s.start_ns"
    ) == [
        ("preempted", HOG, "thread 7", 119, None),
        ("runnable", 0, "thread 0", None, "timer"),
    ]


def test_a_switch_ends_an_interrupt(system: RosSystem, analyse: Analyse) -> None:
    """Its end is not always recorded: then the thread that runs now is the waker."""
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, 0, BLOCKED)
    kernel.add("irq_handler_entry", 1250)
    kernel.switch(1300, 0, HOG)
    kernel.wake(1400, 41)
    kernel.switch(1500, HOG, 41, BLOCKED)
    kernel.switch(2000, 41, 0, BLOCKED)
    call(system, 1000, 1600)
    model = analyse(system)
    assert model.rows(
        "SELECT waker_kind, o.tid FROM thread_state AS s JOIN other_thread AS o "
        "ON s.waker_other_thread_id = o.other_thread_id WHERE state = 'runnable'"
    ) == [("thread", HOG)]


def wake_from_the_cpu_of_the_hog(kernel: Kernel, left: int) -> None:
    """Thread 41 is woken there; `left` leaves that CPU next."""
    kernel.switch(900, 0, 41)
    kernel.switch(900, 0, HOG, cpu=1)
    kernel.switch(1200, 41, 0, BLOCKED)
    kernel.wake(1400, 41, cpu=1)
    kernel.switch(1500, 0, 41)
    kernel.switch(1600, left, 0, BLOCKED, cpu=1)
    kernel.switch(2000, 41, 0, BLOCKED)


@pytest.mark.parametrize(("left", "waker"), [(HOG, HOG), (TIMER, None)])
def test_a_waker_that_the_next_switch_contradicts_is_not_known(
    system: RosSystem, analyse: Analyse, left: int, waker: int | None
) -> None:
    """Another thread than the one that got the CPU leaves it: either woke the thread."""
    wake_from_the_cpu_of_the_hog(Kernel(system), left)
    call(system, 1000, 1800)
    kind = None if waker is None else "thread"
    assert analyse(system).rows(
        "SELECT waker_kind, o.tid FROM thread_state AS s LEFT JOIN other_thread AS o "
        "ON s.waker_other_thread_id = o.other_thread_id WHERE state = 'runnable'"
    ) == [(kind, waker)]


@pytest.mark.thorough
def test_of_two_kernel_traces_of_a_schedule_the_one_that_knows_the_waker_counts(
    system: RosSystem, analyse: Analyse
) -> None:
    """The first one contradicts itself on the CPU of the waker."""
    for trace, left in ((KERNEL, TIMER), (KERNEL + 1, HOG)):
        wake_from_the_cpu_of_the_hog(Kernel(system, trace), left)
    call(system, 1000, 1800)
    assert analyse(system).rows(
        "SELECT start_ns, end_ns, state, waker_kind, o.tid FROM thread_state AS s "
        "LEFT JOIN other_thread AS o ON s.waker_other_thread_id = o.other_thread_id "
        "WHERE state IN ('sleeping', 'runnable') ORDER BY start_ns"
    ) == [
        (1200, 1400, "sleeping", "thread", HOG),
        (1400, 1500, "runnable", "thread", HOG),
    ]


@pytest.mark.parametrize("traces", few([1, 2], 2))
def test_a_waking_may_come_before_the_switch_that_it_undoes(
    system: RosSystem, analyse: Analyse, traces: int
) -> None:
    """Two kernel traces have the same wakings and switches."""
    for trace in range(traces):
        kernel = Kernel(system, KERNEL + trace)
        kernel.switch(900, 0, 41)
        kernel.wake(1190, 41, cpu=1)
        kernel.switch(1200, 41, 0, BLOCKED)
        kernel.switch(1300, 0, 41)
        kernel.switch(2000, 41, 0, BLOCKED)
    call(system, 1000, 1600)
    assert schedules(analyse(system)) == [(500, 0, 100, 0, 0, 0)]


@pytest.mark.thorough
def test_a_thread_that_is_woken_twice_waits_from_the_first_time(
    system: RosSystem, analyse: Analyse
) -> None:
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, 0, BLOCKED)
    kernel.wake(1220, 41)
    kernel.wake(1250, 41)
    kernel.switch(1300, 0, 41)
    kernel.switch(2000, 41, 0, BLOCKED)
    call(system, 1000, 1600)
    assert schedules(analyse(system)) == [(500, 0, 80, 20, 0, 0)]


def test_each_thread_has_its_own_wakings(system: RosSystem, analyse: Analyse) -> None:
    """What is seen first of the second one is that it is woken."""
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1100, 41, 0, BLOCKED)
    kernel.wake(1150, 42, cpu=1)
    kernel.switch(1200, 0, 42, cpu=1)
    kernel.switch(1300, 0, 41)
    kernel.switch(1400, 42, 0, BLOCKED, cpu=1)
    kernel.switch(2000, 41, 0, BLOCKED)
    call(system, 1000, 1600)
    call(system, 1210, 1350, Thread(100, 101, cpu=1))
    rows = analyse(system).rows(
        "SELECT t.tid, s.start_ns, s.end_ns, s.state FROM thread_state AS s "
        "JOIN thread AS t USING (thread_id) WHERE s.state IN ('runnable', 'sleeping') "
        "AND s.end_ns < 2000 ORDER BY t.tid, s.start_ns"
    )
    assert rows == [(100, 1100, 1300, "sleeping"), (101, 1150, 1200, "runnable")]


@pytest.mark.thorough
def test_without_wakings_a_sleep_lasts_until_the_thread_runs(
    system: RosSystem, analyse: Analyse
) -> None:
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, 0, 2)
    kernel.switch(1300, 0, 41)
    kernel.switch(2000, 41, 0, BLOCKED)
    call(system, 1000, 1600)
    assert schedules(analyse(system)) == [(500, 0, 0, 0, 100, 0)]


def test_what_the_next_switch_contradicts_is_not_known(system: RosSystem, analyse: Analyse) -> None:
    """The thread left its CPU unseen, and comes back on another one."""
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(900, 0, HOG, cpu=1)
    kernel.switch(1300, HOG, 41, cpu=1)
    kernel.switch(2000, 41, 0, BLOCKED, cpu=1)
    call(system, 1000, 1600)
    call(system, 1700, 1800, Thread(100, cpu=1))
    assert schedules(analyse(system)) == [(300, 0, 0, 0, 0, 300), (100, 0, 0, 0, 0, 0)]


@pytest.mark.thorough
def test_a_callback_beyond_the_kernel_trace_is_not_known(
    system: RosSystem, analyse: Analyse
) -> None:
    recorded(system)
    call(system, 5000, 5500)
    assert schedules(analyse(system))[1] == (0, 0, 0, 0, 0, 500)


def test_lost_kernel_events_are_marked(system: RosSystem, analyse: Analyse) -> None:
    recorded(system)
    system.add_packet(900, 1200, last_event=1100, discarded=3, trace=KERNEL)
    system.add_packet(1250, 3000, trace=KERNEL)
    model = analyse(system)
    assert model.rows("SELECT start_ns FROM thread_state WHERE is_loss_affected") == [(1100,)]
    assert model.rows("SELECT is_loss_affected FROM callback_schedule") == [(True,)]


def test_times_of_perf_count_from_the_origin_of_the_clock(
    system: RosSystem, analyse: Analyse
) -> None:
    """It names no clock: its host and its times follow from the schedule."""
    system.add_source(0, "alpha", "boot", origin_ns=10_000)
    kernel = Kernel(system, hostname="unknown", clock="perf", tracer="perf")
    kernel.shift_ns = -10_000
    kernel.switch(10_900, 0, 41)
    kernel.switch(12_100, 41, 0, BLOCKED)
    call(system, 11_000, 12_000)
    model = analyse(system)
    assert schedules(model) == [(1000, 0, 0, 0, 0, 0)]
    assert model.rows("SELECT hostname FROM host") == [("alpha",)]
    assert model.rows("SELECT count(*) FROM clock") == [(1,)]
    assert model.rows("SELECT priority FROM thread_state WHERE state = 'running'") == [(19,)]
    assert model.rows("SELECT start_ns FROM trace WHERE domain = 'kernel'") == [(10_900,)]


def test_a_kernel_trace_that_contradicts_the_events_is_not_joined(
    system: RosSystem, analyse: Analyse
) -> None:
    kernel = Kernel(system, clock="perf", tracer="perf")
    for number in range(20):
        kernel.switch(1000 + 100 * number, number, number + 1)
    kernel.switch(9000, 20, 21)
    for number in range(20):
        call(system, 1010 + 100 * number, 1020 + 100 * number)
    model = analyse(system)
    assert model.rows(STATES) == []
    assert model.rows(
        "SELECT trace_id, detail FROM store.finding WHERE name = 'kernel_trace_not_joined'"
    ) == [
        (
            KERNEL + 1,
            "the kernel trace agrees with 5.0 % of the events of ROS processes about which thread "
            "ran, with its times shifted by +0.000000 s: not joined",
        )
    ]


def test_a_kernel_trace_without_cpus_says_so(system: RosSystem, analyse: Analyse) -> None:
    """Of an old perf, which wrote all CPUs into one stream."""
    kernel = Kernel(system, clock="perf", tracer="perf")
    kernel.switch(900, 0, 41, cpu=None)
    kernel.switch(2100, 41, 0, BLOCKED, cpu=None)
    call(system, 1000, 2000)
    model = analyse(system)
    assert model.rows(STATES) == []
    assert model.rows(
        "SELECT detail FROM store.finding WHERE name = 'kernel_trace_not_joined'"
    ) == [("the kernel trace does not say on which CPUs its events happened: not joined",)]


def test_a_process_that_was_started_again_has_other_numbers(
    system: RosSystem, analyse: Analyse
) -> None:
    """With the same ids in its container, its threads are others to the kernel."""
    kernel = Kernel(system)
    for begin, tid in ((1000, 41), (3000, 52)):
        kernel.switch(begin - 100, 0, tid)
        system.add("ros2:rcl_init", MAIN, ts=begin - 50, context_handle=begin, version="8.4.0")
        call(system, begin, begin + 100)
        kernel.switch(begin + 200, tid, 0, 0x10)
    kernel.switch(9000, 0, HOG)
    assert schedules(analyse(system)) == [(100, 0, 0, 0, 0, 0), (100, 0, 0, 0, 0, 0)]


def test_it_is_woken_before_its_first_switch(system: RosSystem, analyse: Analyse) -> None:
    """Its number was another one before."""
    kernel = Kernel(system)
    for begin, tid in ((1000, 41), (3000, 52)):
        kernel.wake(begin - 130, tid)
        kernel.switch(begin - 100, 0, tid)
        system.add("ros2:rcl_init", MAIN, ts=begin - 50, context_handle=begin, version="8.4.0")
        call(system, begin, begin + 100)
        kernel.switch(begin + 200, tid, 0, 0x10)
    kernel.switch(9000, 0, HOG)
    assert analyse(system).rows(
        "SELECT start_ns, end_ns, state FROM thread_state ORDER BY start_ns"
    ) == [
        (870, 900, "runnable"),
        (900, 1200, "running"),
        (2870, 2900, "runnable"),
        (2900, 3200, "running"),
    ]


@pytest.mark.parametrize("other", [Thread(200, cpu=1), Thread(100, cpu=1, trace=3)])
def test_another_process_that_begins_changes_no_numbers(
    system: RosSystem, analyse: Analyse, other: Thread
) -> None:
    """So a kernel trace that says so is of another clock. One of another host has the same ids."""
    system.add_source(3, hostname="beta", clock="other")
    kernel = Kernel(system)
    kernel.switch(1900, 0, 61, cpu=1)
    system.add("ros2:rcl_init", other, ts=2000, context_handle=1, version="8.4.0")
    kernel.switch(2100, 61, 0, BLOCKED, cpu=1)
    for begin, tid in ((1000, 41), (3000, 52)):
        kernel.switch(begin - 100, 0, tid)
        call(system, begin, begin + 100)
        kernel.switch(begin + 200, tid, 0, BLOCKED)
    assert analyse(system).rows("SELECT is_joined FROM staging.schedule") == [(False,)]


@pytest.mark.thorough
def test_a_thread_that_nothing_tells_is_said(system: RosSystem, analyse: Analyse) -> None:
    recorded(system)
    call(system, 800, 810, Thread(100, 101))
    model = analyse(system)
    assert model.rows(
        "SELECT process_id, count, detail FROM store.finding WHERE name = 'kernel_thread_unknown'"
    ) == [
        (
            1,
            1,
            "1 threads of main (pid 100) are not known to the kernel trace: no states of them",
        )
    ]


def test_without_a_kernel_trace_there_is_nothing(system: RosSystem, analyse: Analyse) -> None:
    call(system, 1000, 2000)
    model = analyse(system)
    assert model.rows(STATES) == schedules(model) == []
    assert model.rows("FROM other_thread") == []


@pytest.mark.thorough
@pytest.mark.parametrize("state", [16, 32])
def test_a_thread_that_ended_does_not_sleep(
    system: RosSystem, analyse: Analyse, state: int
) -> None:
    """Its number goes to another thread, which has no event of ROS yet."""
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, 0, state)
    kernel.add("sched_wakeup_new", 2000, tid=41)
    kernel.switch(2100, 0, 41)
    kernel.switch(2200, 41, 0, state)
    kernel.switch(3000, 0, HOG)
    call(system, 1000, 1100)
    model = analyse(system)
    assert model.rows("SELECT state FROM thread_state WHERE start_ns BETWEEN 1200 AND 2050") == []


def without_switches_from_idle(system: RosSystem, kernel: Kernel, count: int) -> None:
    """Let a thread run on two CPUs in turn; from one of them no switch away from idle is seen.

    The thread is woken at the middle of its sleep, and sleeps again in its callback.
    """
    kernel.switch(0, HOG, 0)
    kernel.switch(0, HOG, 0, cpu=1)
    for begin in range(1000, 1000 * (count + 1), 1000):
        cpu = begin // 1000 % 2
        for on, off in ((begin - 100, begin + 100), (begin + 200, begin + 400)):
            kernel.wake(on - 50, 41, cpu=cpu)
            if cpu == 0:
                kernel.switch(on, 0, 41)
            kernel.switch(off, 41, 0, BLOCKED, cpu=cpu)
        call(system, begin, begin + 300, Thread(100, cpu=cpu))


def test_only_where_the_schedule_is_known_an_event_can_contradict_it(
    system: RosSystem, analyse: Analyse
) -> None:
    """perf on virtual machines has no switches away from idle, on some CPUs.

    The thread is seen on the CPU at the begin of the callback, and not again until its end.
    """
    without_switches_from_idle(system, Kernel(system, clock="perf", tracer="perf"), 4)
    model = analyse(system)
    assert model.rows(
        "SELECT name, count, detail FROM store.finding WHERE name LIKE 'kernel%'"
    ) == [
        (
            "kernel_switches_missing",
            4,
            "what ran is not known for 100.0 % of the time of CPU 1, at 4 of 8 events of ROS "
            "processes",
        )
    ]
    assert schedules(model) == [
        (100, 0, 0, 50, 0, 150),
        (200, 0, 50, 50, 0, 0),
        (100, 0, 0, 50, 0, 150),
        (200, 0, 50, 50, 0, 0),
    ]
    assert model.rows(STATES)[:9] == [
        (850, 1000, "unknown", 1),
        (1000, 1100, "running", 1),
        (1100, 1150, "sleeping", 1),
        (1150, 1300, "unknown", 1),
        (1300, 1400, "running", 1),
        (1400, 1850, "sleeping", 1),
        (1850, 1900, "runnable", 1),
        (1900, 2100, "running", 0),
        (2100, 2150, "sleeping", 0),
    ]


def test_a_thread_that_is_not_seen_before_it_leaves_a_cpu_is_not_known_to_run(
    system: RosSystem, analyse: Analyse
) -> None:
    """Its switch onto the CPU is missing, and it has no event there."""
    kernel = Kernel(system)
    kernel.switch(0, HOG, 0)
    kernel.switch(0, HOG, 0, cpu=1)
    kernel.switch(500, 41, 0, BLOCKED, cpu=1)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, 0, BLOCKED)
    kernel.wake(1300, 41)
    kernel.switch(1400, 41, 0, BLOCKED, cpu=1)
    kernel.switch(1500, 0, HOG)
    call(system, 1000, 1100)
    assert analyse(system).rows(STATES) == [
        (0, 500, "unknown", 1),
        (500, 900, "sleeping", 1),
        (900, 1200, "running", 0),
        (1200, 1300, "sleeping", 0),
        (1300, 1400, "unknown", 0),
        (1400, 1500, "sleeping", 1),
    ]


def test_a_waking_on_an_idle_cpu_may_be_missing_too(system: RosSystem, analyse: Analyse) -> None:
    """The thread slept at least until the CPU on which it is seen then became idle."""
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, HOG, BLOCKED)
    kernel.switch(1500, HOG, 0, BLOCKED)
    kernel.switch(2000, 41, 0, BLOCKED)
    kernel.switch(3000, 0, HOG)
    call(system, 1000, 1800)
    model = analyse(system)
    assert model.rows(STATES) == [
        (900, 1200, "running", 0),
        (1200, 1500, "sleeping", 0),
        (1500, 1800, "unknown", 0),
        (1800, 2000, "running", 0),
        (2000, 3000, "sleeping", 0),
    ]


def test_the_number_of_a_thread_is_known_on_a_cpu_without_switches_from_idle(
    system: RosSystem, analyse: Analyse
) -> None:
    """What leaves the CPU next is the thread, also if its switch to the CPU is missing."""
    kernel = Kernel(system)
    kernel.switch(0, HOG, 0, cpu=1)
    kernel.switch(500, 42, 0, BLOCKED, cpu=1)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, 0, BLOCKED)
    call(system, 300, 400, Thread(100, 101, cpu=1))
    call(system, 1000, 1100)
    assert schedules(analyse(system)) == [(100, 0, 0, 0, 0, 0), (100, 0, 0, 0, 0, 0)]


@pytest.mark.thorough
def test_what_wakes_is_known_where_it_is_seen(system: RosSystem, analyse: Analyse) -> None:
    """From a CPU that went idle, and on which a thread is seen only afterwards."""
    other = Thread(100, 101, cpu=1)
    kernel = Kernel(system)
    kernel.switch(0, HOG, 0, cpu=1)
    kernel.switch(0, HOG, 42)
    call(system, 10, 20, Thread(100, 101))
    kernel.switch(30, 42, 41, BLOCKED)
    for begin in (1000, 2000, 3000):
        kernel.switch(begin, 41, 0, BLOCKED)
        kernel.wake(begin + (300 if begin == 2000 else 100), 41, cpu=1)
        call(system, begin + 200, begin + 250, other)
        kernel.switch(begin + 400, 0, 41)
        kernel.switch(begin + 500, 42, 0, BLOCKED, cpu=1)
        call(system, begin + 600, begin + 700)
    kernel.switch(4000, 41, HOG)
    model = analyse(system)
    assert model.rows(
        "SELECT s.end_ns, s.waker_kind, t.tid, s.waker_other_thread_id FROM thread_state AS s "
        "LEFT JOIN thread AS t ON s.waker_thread_id = t.thread_id WHERE state = 'sleeping' "
        "AND s.thread_id = (SELECT thread_id FROM thread WHERE tid = 100) ORDER BY s.start_ns"
    ) == [(1100, None, None, None), (2300, "thread", 101, None), (3100, None, None, None)]


@pytest.mark.thorough
def test_a_wrong_clock_is_found_where_most_of_the_schedule_is_unknown(
    system: RosSystem, analyse: Analyse
) -> None:
    kernel = Kernel(system, clock="perf", tracer="perf")
    kernel.shift_ns = 250
    without_switches_from_idle(system, kernel, 100)
    model = analyse(system)
    assert model.rows(STATES) == []
    assert model.rows(
        "SELECT count, detail FROM store.finding WHERE name = 'kernel_trace_not_joined'"
    ) == [
        (
            50,
            "the kernel trace agrees with 50.0 % of the events of ROS processes about which thread "
            "ran, with its times shifted by +0.000000 s: not joined",
        )
    ]


@pytest.mark.thorough
def test_two_threads_are_not_one_to_the_kernel(system: RosSystem, analyse: Analyse) -> None:
    """A trace of another boot, in which one thread had the CPU all the time."""
    kernel = Kernel(system, clock="perf", tracer="perf")
    kernel.switch(0, 0, HOG)
    kernel.switch(9000, HOG, 0)
    for begin in range(1000, 5000, 100):
        call(system, begin, begin + 10, Thread(100, 100 + begin // 100 % 4))
    model = analyse(system)
    assert model.rows(STATES) == []
    assert model.rows("SELECT count FROM store.finding WHERE name = 'kernel_trace_not_joined'") == [
        (60,)
    ]


NOT_JOINED = "SELECT detail FROM store.finding WHERE name = 'kernel_trace_not_joined'"
IS_JOINED = "SELECT is_joined, event_count, agreeing_count FROM staging.schedule"


def test_a_few_agreeing_events_among_contradictions_do_not_join(
    system: RosSystem, analyse: Analyse
) -> None:
    kernel = Kernel(system, clock="perf", tracer="perf")
    kernel.switch(0, 0, 0)
    for begin in range(1000, 21_000, 1000):
        call(system, begin, begin + 100)
        kernel.switch(begin + 500, HOG + begin // 1000 % 2, 0, BLOCKED)
    kernel.switch(30_000, 0, HOG)
    system.add("ros2:callback_start", MAIN, ts=30_100, callback=0xC1, is_intra_process=0)
    kernel.switch(30_200, HOG, 0, BLOCKED)
    model = analyse(system)
    assert model.rows(STATES) == []
    assert model.rows(NOT_JOINED) == [
        ("the kernel trace contradicts itself at 40 of 41 events of ROS processes: not joined",)
    ]


@pytest.mark.thorough
def test_a_kernel_trace_that_contradicts_itself_at_all_events_is_not_joined(
    system: RosSystem, analyse: Analyse
) -> None:
    kernel = Kernel(system)
    kernel.switch(900, HOG, 0)
    kernel.switch(2100, 41, 0, BLOCKED)
    call(system, 1000, 2000)
    model = analyse(system)
    assert model.rows(IS_JOINED) == [(False, 0, 0)]
    assert model.rows(NOT_JOINED) == [
        ("the kernel trace contradicts itself at 2 of 2 events of ROS processes: not joined",)
    ]


def test_a_thread_is_not_the_idle_one(system: RosSystem, analyse: Analyse) -> None:
    kernel = Kernel(system)
    kernel.switch(900, HOG, 0)
    kernel.switch(2100, 0, HOG)
    call(system, 1000, 2000)
    assert analyse(system).rows(IS_JOINED) == [(False, 2, 0)]


@pytest.mark.parametrize("pids", [(100, 200), (200, 100)])
def test_the_kernel_gives_a_number_again(
    system: RosSystem, analyse: Analyse, pids: tuple[int, int]
) -> None:
    """The thread that had it before has ended then."""
    kernel = Kernel(system)
    for begin, pid in zip((1000, 5000), pids, strict=True):
        kernel.switch(begin - 100, 0, 41)
        call(system, begin, begin + 200, Thread(pid))
        kernel.switch(begin + 400, 41, 0, 0x10)
    assert analyse(system).rows(IS_JOINED) == [(True, 4, 4)]


def test_two_threads_do_not_have_a_number_at_once(system: RosSystem, analyse: Analyse) -> None:
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    for begin in (1000, 2000):
        call(system, begin, begin + 100, Thread(100))
        call(system, begin + 200, begin + 300, Thread(200))
    kernel.switch(3000, 41, 0, BLOCKED)
    assert analyse(system).rows(IS_JOINED) == [(False, 8, 4)]


def test_containers_have_the_same_ids_and_not_the_same_number(
    system: RosSystem, analyse: Analyse
) -> None:
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    for begin in (1000, 2000):
        for pid_ns in (1, 2, 3, 4):
            call(system, begin + pid_ns, begin + 10, Thread(100, pid_ns=pid_ns))
    kernel.switch(3000, 41, 0, BLOCKED)
    assert analyse(system).rows(IS_JOINED) == [(False, 16, 4)]


def test_a_thread_does_not_contradict_itself(system: RosSystem, analyse: Analyse) -> None:
    """Its process initialises ROS again at the very time of its last event."""
    kernel = Kernel(system)
    kernel.switch(900, 0, 41)
    call(system, 1000, 1100)
    system.add("ros2:rcl_init", MAIN, ts=1100, context_handle=1, version="8.4.0")
    call(system, 1200, 1300)
    kernel.switch(3000, 41, 0, BLOCKED)
    assert analyse(system).rows(IS_JOINED) == [(True, 5, 5)]


def test_a_clock_that_events_contradict_does_not_count(system: RosSystem, analyse: Analyse) -> None:
    """More of its events agree, but not nearly all."""
    system.add_source(2, "beta", "another")
    kernel = Kernel(system, clock="perf", tracer="perf")
    kernel.switch(900, 0, 41)
    kernel.switch(900, 0, 51, cpu=1)
    call(system, 1000, 1100)
    for begin in range(1000, 9000, 1000):
        call(system, begin, begin + 100, Thread(300, cpu=1, trace=2))
        kernel.switch(begin + 900, 50 + begin // 5000, 50 + (begin + 1000) // 5000, cpu=1)
    kernel.switch(9500, 41, 0, BLOCKED)
    assert analyse(system).rows(
        "SELECT is_joined, event_count, agreeing_count FROM staging.schedule"
    ) == [(True, 2, 2)]


def test_the_clock_of_most_events_counts(system: RosSystem, analyse: Analyse) -> None:
    """Two events of another host agree by chance, and all of them."""
    system.add_source(2, "beta", "another")
    kernel = Kernel(system, clock="perf", tracer="perf")
    kernel.switch(900, 0, 41)
    kernel.switch(900, 0, HOG, cpu=1)
    for begin in range(1000, 21_000, 1000):
        call(system, begin, begin + 100)
    system.add("ros2:callback_start", Thread(100, cpu=1), ts=22_000, callback=0xC1)
    call(system, 10_050, 10_070, Thread(300, cpu=1, trace=2))
    for cpu, tid in enumerate((41, HOG)):
        kernel.switch(30_000, tid, 0, BLOCKED, cpu=cpu)
    assert analyse(system).rows(
        "SELECT k.is_joined, k.event_count, k.agreeing_count, s.hostname "
        "FROM staging.schedule AS k JOIN staging.source AS s ON k.clock_key = s.clock_key "
        "AND s.domain = 'ust'"
    ) == [(True, 41, 40, "alpha")]


@pytest.mark.thorough
def test_after_a_preemption_it_is_not_known_when_the_thread_goes_on_unseen(
    system: RosSystem, analyse: Analyse
) -> None:
    """It may have slept before it is seen on another CPU."""
    kernel = Kernel(system)
    kernel.switch(0, HOG, 0, cpu=1)
    kernel.switch(900, 0, 41)
    kernel.switch(1200, 41, HOG)
    kernel.switch(1800, 41, 0, BLOCKED, cpu=1)
    kernel.switch(2000, HOG, 0, BLOCKED)
    call(system, 1000, 1100)
    call(system, 1500, 1600, Thread(100, cpu=1))
    assert analyse(system).rows(STATES) == [
        (900, 1200, "running", 0),
        (1200, 1500, "unknown", 0),
        (1500, 1800, "running", 1),
        (1800, 2000, "sleeping", 1),
    ]


def test_an_event_of_another_thread_does_not_tell_that_a_thread_has_the_cpu(
    system: RosSystem, analyse: Analyse
) -> None:
    """Both ran on CPU 1, one after the other, and only the second one is seen to leave it."""
    other = Thread(100, 101)
    kernel = Kernel(system)
    kernel.switch(0, HOG, 0, cpu=1)
    kernel.switch(400, 0, 42)
    call(system, 500, 600, other)
    kernel.switch(700, 42, 0, BLOCKED)
    call(system, 1000, 1050, Thread(100, 101, cpu=1))
    call(system, 1200, 1250, Thread(100, cpu=1))
    kernel.switch(1400, 41, 0, BLOCKED, cpu=1)
    kernel.switch(1900, 0, 42)
    call(system, 2000, 2100, other)
    kernel.switch(2200, 42, 41, BLOCKED)
    call(system, 2300, 2400)
    kernel.switch(2500, 41, 0, BLOCKED)
    assert analyse(system).rows(
        "SELECT start_ns, end_ns FROM thread_state WHERE state = 'running' "
        "AND thread_id = (SELECT thread_id FROM thread WHERE tid = 100) ORDER BY start_ns"
    ) == [(1200, 1400), (2200, 2500)]
