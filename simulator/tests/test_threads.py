"""Executors with several threads, several executors in a process, and callbacks that spin."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from types import SimpleNamespace

import pytest

from msgflow_sim.kernel import Kernel
from msgflow_sim.system import KernelTrace


def _overlaps(intervals):
    ordered = sorted(intervals)
    return sum(before[1] > after[0] for before, after in pairwise(ordered))


@pytest.mark.thorough
def test_a_reentrant_callback_runs_on_several_threads_at_once(recordings):
    rows = recordings["multi_threaded"].truth(
        "SELECT callback_handle, start_ns, end_ns, c.tid FROM callback_instance c "
        "JOIN take USING (take_id) WHERE topic_name = '/fast' AND end_ns IS NOT NULL"
    )
    assert len({callback for callback, *_ in rows}) == 1
    assert len({tid for *_, tid in rows}) >= 3
    assert _overlaps((start, end) for _, start, end, _ in rows) > 10


def test_callbacks_of_a_mutually_exclusive_group_never_overlap(recordings):
    recording = recordings["multi_threaded"]
    rows = recording.truth(
        "SELECT start_ns, end_ns, kind, c.tid FROM callback_instance c LEFT JOIN take t "
        "USING (take_id) WHERE c.node = '/worker' AND (c.kind = 'timer' OR topic_name = '/slow') "
        "AND end_ns IS NOT NULL"
    )
    assert {kind for _, _, kind, _ in rows} == {"timer", "subscription"}
    assert len({tid for *_, tid in rows}) > 1
    assert _overlaps((start, end) for start, end, *_ in rows) == 0
    # Each thread does one thing at a time.
    threads = defaultdict(list)
    for host, tid, start, end in recording.truth(
        "SELECT host, tid, start_ns, end_ns FROM callback_instance WHERE end_ns IS NOT NULL"
    ):
        threads[host, tid].append((start, end))
    assert all(_overlaps(intervals) == 0 for intervals in threads.values())


def test_one_thread_of_an_executor_waits_at_a_time(recordings):
    waits = recordings["multi_threaded"].truth(
        "SELECT start_ns, end_ns, tid FROM executor_state "
        "WHERE pid = 1201 AND state = 'wait' AND end_ns IS NOT NULL"
    )
    assert len({tid for *_, tid in waits}) == 4
    assert _overlaps((start, end) for start, end, _ in waits) == 0


@pytest.mark.thorough
def test_executors_of_a_process_have_threads_of_their_own(recordings):
    recording = recordings["executors"]
    threads = defaultdict(set)
    for node, tid in recording.truth(
        "SELECT DISTINCT node, tid FROM callback_instance WHERE pid = 1201"
    ):
        threads[node].add(tid)
    assert threads["/planner"] == {1201}
    assert threads["/checker"] == {1202}
    # One group of the node is spun by another executor than the node.
    assert threads["/monitor"] >= {1201, 1203}
    # A static executor has no events, its callbacks have.
    with_events = {
        event.tid
        for event in recording.events
        if event.pid == 1201 and event.name.startswith("ros2:rclcpp_executor")
    }
    assert with_events == {1201, 1203, 1204}


@pytest.mark.thorough
def test_callbacks_run_nested_also_in_themselves(recordings):
    recording = recordings["nested"]
    rows = recording.truth(
        "SELECT c.callback_handle = o.callback_handle, count(*), "
        "count(*) FILTER (WHERE c.start_ns > o.start_ns AND c.end_ns < o.end_ns "
        "AND c.tid = o.tid) FROM callback_instance c JOIN callback_instance o "
        "ON c.parent_id = o.callback_instance_id "
        "WHERE c.end_ns IS NOT NULL AND o.end_ns IS NOT NULL GROUP BY ALL ORDER BY ALL"
    )
    assert [is_same for is_same, *_ in rows] == [False, True]
    assert all(count == inside > 10 for _, count, inside in rows)
    # The parent is the innermost callback that goes on.
    missed = recording.truth(
        "SELECT count(*) FROM callback_instance c JOIN callback_instance o ON c.host = o.host "
        "AND c.tid = o.tid AND c.start_ns > o.start_ns AND c.end_ns < o.end_ns "
        "LEFT JOIN callback_instance p ON c.parent_id = p.callback_instance_id "
        "WHERE p.start_ns IS NULL OR p.start_ns < o.start_ns"
    )
    assert missed == [(0,)]


def test_a_callback_waits_for_the_response_that_it_has_asked_for(recordings):
    rows = recordings["nested"].truth(
        "SELECT c.start_ns, q.sent_ns, r.taken_ns, c.end_ns FROM request q "
        "JOIN response r USING (request_id) JOIN callback_instance c "
        "ON q.sender_callback_instance_id = c.callback_instance_id WHERE c.end_ns IS NOT NULL"
    )
    assert len(rows) > 3
    assert all(list(row) == sorted(row) for row in rows)


class _Scheduled:
    """A thread of a process that may have any CPU."""

    def __init__(self, tid):
        self.tid, self.cpu, self.priority, self.computing = tid, 1, 120, (0, 0)
        self.description = SimpleNamespace(cpus=(), pid=1)

    def move(self, cpu):
        self.cpu = cpu


def test_a_thread_whose_cpu_is_taken_leaves_it_before_it_has_another():
    kernel, first, second = Kernel(KernelTrace(), 2), _Scheduled(1), _Scheduled(2)
    assert kernel.take(first, 0) == 0
    kernel.keep(first, 1_000)
    # The other one was first to ask for the CPU at that moment.
    assert kernel.take(second, 1_000) == 0
    kernel.keep(second, 9_000)
    second.computing = (1_000, 9_000)
    assert (kernel.take(first, 1_000), first.cpu) == (5_000, 1)
    assert (kernel.take(first, 5_000), first.cpu) == (0, 0)
