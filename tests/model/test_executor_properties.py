"""What holds for every history of an executor, checked against slow and simple ways."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import pairwise

import pytest
from support.analysis import Analyse, Analysis
from support.random_executor import random_executor
from support.thorough import few

from msgflow.run.window import Window

KINDS = [(threads, with_events) for threads in (1, 2, 3) for with_events in (True, False)]
SEEDS = range(3)
ACTIVITIES = (
    "SELECT thread_id, activity, start_ns, end_ns, callback_instance_id FROM executor_activity "
    "ORDER BY thread_id, start_ns, end_ns NULLS LAST"
)
STATES = (
    "SELECT s.thread_id, s.start_ns, s.end_ns FROM executor_state AS s WHERE NOT EXISTS ("
    "FROM thread_break AS b WHERE b.thread_id = s.thread_id AND b.resumed_ns > s.start_ns "
    "AND b.resumed_ns <= s.end_ns) AND s.end_ns IS NOT NULL"
)
RUNS = (
    "SELECT callback_instance_id, callback_id, i.thread_id, start_ns, coalesce(end_ns, start_ns) "
    "FROM callback_instance AS i JOIN executor_thread AS x ON i.thread_id = x.thread_id "
    "WHERE depth = 1"
)
WAITS = (
    "SELECT callback_instance_id, callback_id, earliest_ns, latest_ns, start_ns, busy_min_ns, "
    "busy_max_ns, blocked_max_ns FROM executor_wait ORDER BY callback_instance_id"
)

# What a thread among several has picked does not wait for work that others wait for.
IDLE = (
    "SELECT w.earliest_ns, CASE WHEN s.thread_count = 1 THEN w.start_ns "
    "ELSE coalesce(max(e.start_ns), w.start_ns) END AS until_ns, w.idle_ns "
    "FROM executor_wait AS w JOIN derive.executor_size AS s USING (executor_id) "
    "LEFT JOIN executor_state AS e ON e.thread_id = w.thread_id AND e.state = 'process' "
    "AND e.start_ns <= w.start_ns "
    "GROUP BY w.callback_instance_id, w.earliest_ns, w.start_ns, w.idle_ns, s.thread_count "
    "ORDER BY w.callback_instance_id"
)
# What a callback that spins waits for is no business of its executor.
SLEEPS = (
    "SELECT s.start_ns, s.end_ns FROM executor_state AS s WHERE state = 'wait' "
    "AND end_ns IS NOT NULL AND NOT EXISTS ("
    f"FROM ({RUNS}) AS r (run, callback, thread_id, start_ns, end_ns) "
    "WHERE r.thread_id = s.thread_id AND r.start_ns <= s.start_ns AND s.start_ns < r.end_ns)"
)


@dataclass(frozen=True)
class Run:
    """A run of a callback that is not nested."""

    run: int
    callback: int
    thread: int
    start: int
    end: int

    def overlap(self, start: int, end: int) -> int:
        return max(min(self.end, end) - max(self.start, start), 0)


@pytest.mark.thorough
@pytest.mark.parametrize(("threads", "with_events"), few(KINDS, (3, True)))
@pytest.mark.parametrize("seed", few(SEEDS, 0))
def test_properties(analyse: Analyse, seed: int, threads: int, with_events: bool) -> None:
    model = analyse(random_executor(seed, threads=threads, with_events=with_events))
    activities_never_overlap_and_add_up_to_the_states(model)
    no_activity_reaches_across_a_gap(model)
    a_window_has_the_activities_that_reach_into_it(model)
    bounds_are_in_order(model)
    interference_is_that_of_all_pairs(model)
    busy_is_counted_instant_by_instant(model)
    idle_is_the_sum_of_what_threads_wait(model)


def activities_never_overlap_and_add_up_to_the_states(model: Analysis) -> None:
    by_thread = defaultdict(list)
    for thread, activity, start, end, _ in model.rows(ACTIVITIES):
        assert activity in {"wait", "select", "take", "callback", "service", "blocked"}
        by_thread[thread].append((start, end))
    for intervals in by_thread.values():
        for (_, end), (start, _) in pairwise(intervals):
            assert end is None or end <= start
    for thread, start, end in model.rows(STATES):
        inside = [(a, b) for a, b in by_thread[thread] if start <= a and b is not None and b <= end]
        assert sum(b - a for a, b in inside) == end - start


def no_activity_reaches_across_a_gap(model: Analysis) -> None:
    assert not model.rows(
        "SELECT a.start_ns FROM executor_activity AS a JOIN thread_break AS b "
        "ON a.thread_id = b.thread_id AND b.resumed_ns > a.start_ns AND b.resumed_ns < a.end_ns"
    )


def a_window_has_the_activities_that_reach_into_it(model: Analysis) -> None:
    activities = model.rows(ACTIVITIES)
    breaks = model.rows("SELECT thread_id, resumed_ns FROM thread_break")
    moments = sorted({start for _, _, start, _, _ in activities})
    without_limits = Window()
    windows = [
        *zip(moments[::9], moments[5::7], strict=False),
        (without_limits.start_ns, without_limits.end_ns),
    ]
    for since, until in windows:
        expected = set()
        for thread, activity, start, end, run in activities:
            # What began before, and ended in a gap before.
            is_over = end is None and any(
                thread == other and start < at < since for other, at in breaks
            )
            if start < until and (end is None or end > since) and not is_over:
                expected.add((thread, activity, start, end, run))
        found = model.rows(
            "SELECT thread_id, activity, start_ns, end_ns, callback_instance_id "
            f"FROM main.executor_activity_within(NULL, {since}, {until})"
        )
        assert len(found) == len(expected)
        assert set(found) == expected


def bounds_are_in_order(model: Analysis) -> None:
    for _, _, earliest, latest, start, busy_min, busy_max, blocked in model.rows(WAITS):
        assert latest <= start
        assert 0 <= busy_min <= start - latest
        if earliest is None:
            assert busy_max is None
            continue
        assert earliest <= latest
        assert busy_min <= busy_max
        assert 0 <= blocked <= busy_max


def interference_is_that_of_all_pairs(model: Analysis) -> None:
    runs = [Run(*row) for row in model.rows(RUNS)]
    expected = set()
    for wait, _, earliest, latest, start, *_ in model.rows(WAITS):
        since = latest if earliest is None else earliest
        for run in runs:
            if run.run != wait and run.overlap(since, start):
                expected.add((wait, run.run, run.overlap(since, start), run.overlap(latest, start)))
    found = model.rows(
        "SELECT callback_instance_id, meanwhile_id, overlap_ns, certain_ns "
        "FROM executor_interference"
    )
    assert len(found) == len(set(found))
    assert set(found) == expected


def busy_is_counted_instant_by_instant(model: Analysis) -> None:
    """All threads run a callback, or the callback itself runs, unless it was seen beside itself."""
    runs = [Run(*row) for row in model.rows(RUNS)]
    threads = model.value("SELECT count(*) FROM executor_thread")
    reentrant = {
        a.callback
        for a in runs
        for b in runs
        if a.run != b.run and a.callback == b.callback and a.start <= b.start < a.end
    }
    edges = sorted({edge for run in runs for edge in (run.start, run.end)})

    def busy(callback: int, since: int, until: int) -> int:
        moments = sorted({since, until, *(edge for edge in edges if since < edge < until)})
        total = 0
        for start, end in pairwise(moments):
            active = [run for run in runs if run.overlap(start, end)]
            is_excluded = (
                threads > 1
                and callback not in reentrant
                and any(run.callback == callback for run in active)
            )
            if len(active) >= threads or is_excluded:
                total += end - start
        return total

    for _, callback, earliest, latest, start, busy_min, busy_max, *_ in model.rows(WAITS):
        assert busy_min == busy(callback, latest, start)
        if earliest is not None:
            assert busy_max == busy(callback, earliest, start)


def idle_is_the_sum_of_what_threads_wait(model: Analysis) -> None:
    sleeps = model.rows(SLEEPS)
    waits = model.rows(IDLE)
    assert waits
    compared = 0
    for earliest, until, idle in waits:
        if earliest is None or not sleeps:
            assert idle is None
            continue
        inside = sorted((max(a, earliest), min(b, until)) for a, b in sleeps)
        inside = [(a, b) for a, b in inside if a < b]
        # One thread waits for all: two at once do not happen in rclcpp.
        if all(end <= begin for (_, end), (begin, _) in pairwise(inside)):
            assert idle == sum(b - a for a, b in inside)
            compared += 1
    assert compared or not sleeps
