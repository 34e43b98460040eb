"""Begins of callbacks with their ends, and how they are nested."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
RUNS = "SELECT start_ns, end_ns, depth, parent_id FROM callback_instance ORDER BY 1"


def test_callbacks_one_after_the_other(system: RosSystem, analyse: Analyse) -> None:
    runs = [(system.start(MAIN, 0xC1), system.end(MAIN, 0xC1)) for _ in range(3)]
    assert analyse(system).rows(RUNS) == [(start, end, 1, None) for start, end in runs]


def test_nested_callbacks(system: RosSystem, analyse: Analyse) -> None:
    """A callback that spins: two others run inside it, one of them spins too."""
    outer = system.start(MAIN, 0xC1)
    first = system.start(MAIN, 0xC2)
    first_end = system.end(MAIN, 0xC2)
    second = system.start(MAIN, 0xC3)
    inner = system.start(MAIN, 0xC2)
    inner_end = system.end(MAIN, 0xC2)
    second_end = system.end(MAIN, 0xC3)
    outer_end = system.end(MAIN, 0xC1)
    assert analyse(system).rows(RUNS) == [
        (outer, outer_end, 1, None),
        (first, first_end, 2, 1),
        (second, second_end, 2, 1),
        (inner, inner_end, 3, 3),
    ]


@pytest.mark.thorough
def test_recursion_of_one_callback(system: RosSystem, analyse: Analyse) -> None:
    """Six levels deep, with a second call on the way out."""
    starts = [system.start(MAIN, 0xC1) for _ in range(6)]
    ends = [system.end(MAIN, 0xC1) for _ in range(3)]
    again = system.start(MAIN, 0xC1)
    again_end = system.end(MAIN, 0xC1)
    ends += [system.end(MAIN, 0xC1) for _ in range(3)]
    expected = [(starts[n], ends[5 - n], n + 1, n or None) for n in range(6)]
    assert analyse(system).rows(RUNS) == [*expected, (again, again_end, 4, 3)]


@pytest.mark.thorough
def test_recursion_through_another_callback(system: RosSystem, analyse: Analyse) -> None:
    starts = [system.start(MAIN, callback) for callback in (0xC1, 0xC2, 0xC1, 0xC2)]
    ends = [system.end(MAIN, callback) for callback in (0xC2, 0xC1, 0xC2, 0xC1)]
    assert analyse(system).rows(RUNS) == [
        (starts[n], ends[3 - n], n + 1, n or None) for n in range(4)
    ]


def test_a_reentrant_callback_on_two_threads(system: RosSystem, analyse: Analyse) -> None:
    other = Thread(100, 101)
    first = system.start(MAIN, 0xC1)
    second = system.start(other, 0xC1)
    first_end = system.end(MAIN, 0xC1)
    second_end = system.end(other, 0xC1)
    model = analyse(system)
    assert model.rows(RUNS) == [(first, first_end, 1, None), (second, second_end, 1, None)]
    assert model.column(
        "SELECT tid FROM callback_instance JOIN thread USING (thread_id) ORDER BY start_ns"
    ) == [100, 101]


def test_a_lost_end(system: RosSystem, analyse: Analyse) -> None:
    """The run stays open, the next one of the same callback is not touched."""
    lost = system.start(MAIN, 0xC1)
    system.ready(MAIN)
    start = system.start(MAIN, 0xC1)
    end = system.end(MAIN, 0xC1)
    model = analyse(system)
    assert model.rows(RUNS) == [(lost, None, 1, None), (start, end, 1, None)]
    assert model.rows("SELECT count FROM store.finding WHERE name = 'open_callback'") == [(1,)]


def test_a_lost_start(system: RosSystem, analyse: Analyse) -> None:
    system.end(MAIN, 0xC1)
    start = system.start(MAIN, 0xC1)
    end = system.end(MAIN, 0xC1)
    system.end(MAIN, 0xC2)
    model = analyse(system)
    assert model.rows(RUNS) == [(start, end, 1, None)]
    assert model.value("SELECT count FROM store.finding WHERE name = 'unmatched_callback_end'") == 2


def test_open_at_the_end_of_the_trace(system: RosSystem, analyse: Analyse) -> None:
    start = system.start(MAIN, 0xC1)
    inner = system.start(MAIN, 0xC2)
    inner_end = system.end(MAIN, 0xC2)
    assert analyse(system).rows("SELECT start_ns, end_ns FROM callback_instance ORDER BY 1") == [
        (start, None),
        (inner, inner_end),
    ]


def test_a_gap_between_start_and_end(system: RosSystem, analyse: Analyse) -> None:
    """The end behind it may be that of a later run."""
    before = system.start(MAIN, 0xC1)
    system.lose()
    system.end(MAIN, 0xC1)
    start = system.start(MAIN, 0xC1)
    end = system.end(MAIN, 0xC1)
    assert analyse(system).rows(RUNS) == [(before, None, 1, None), (start, end, 1, None)]


def test_a_gap_on_another_cpu(system: RosSystem, analyse: Analyse) -> None:
    """Counts for a thread that was on that CPU before or after it."""
    comes, goes, stays = Thread(100), Thread(200, cpu=1), Thread(300)
    first, second, third = (system.start(thread, 0xC1) for thread in (comes, goes, stays))
    system.lose(cpu=1)
    system.end(Thread(100, cpu=1), 0xC1)
    system.end(Thread(200, cpu=0), 0xC1)
    end = system.end(stays, 0xC1)
    system.add_packet(1_000, 2_000, count=4)
    assert analyse(system).rows("SELECT start_ns, end_ns FROM callback_instance ORDER BY 1") == [
        (first, None),
        (second, None),
        (third, end),
    ]


def test_recursion_does_not_pair_across_a_gap(system: RosSystem, analyse: Analyse) -> None:
    first = system.start(MAIN, 0xC1)
    second = system.start(MAIN, 0xC1)
    system.end(MAIN, 0xC1)
    system.lose()
    system.end(MAIN, 0xC1)
    model = analyse(system)
    assert model.rows("SELECT start_ns, end_ns IS NULL FROM callback_instance ORDER BY 1") == [
        (first, True),
        (second, False),
    ]


def test_an_open_run_ends_with_what_cannot_be_inside(system: RosSystem, analyse: Analyse) -> None:
    """The next start, executor event, or the end of the thread; no run is nested in it."""
    system.start(MAIN, 0xC1)
    system.start(MAIN, 0xC2)
    system.end(MAIN, 0xC2)
    system.start(MAIN, 0xC3)
    system.ready(MAIN)
    system.start(MAIN, 0xC4)
    system.idle(MAIN)
    system.start(MAIN, 0xC5)
    system.publish(MAIN, 0x10)
    assert analyse(system).rows(
        "SELECT effective_end_event_id - start_event_id, depth "
        "FROM store.callback_instance ORDER BY start_event_id"
    ) == [(1, 1), (1, 1), (1, 1), (1, 1), (4, 1)]


def test_deep_recursion_ends_at_the_gap_of_its_thread_only(
    system: RosSystem, analyse: Analyse
) -> None:
    """The other thread, on another CPU, goes on."""
    other = Thread(100, 101, cpu=1)
    outer = system.start(other, 0xC1)
    inner = system.start(other, 0xC1)
    system.start(MAIN, 0xC1)
    system.lose(cpu=0)
    system.add_packet(1_000, 2_000, cpu=1, count=4)
    system.end(MAIN, 0xC1)
    inner_end = system.end(other, 0xC1)
    outer_end = system.end(other, 0xC1)
    assert analyse(system).rows(
        "SELECT start_ns, end_ns FROM callback_instance WHERE end_ns IS NOT NULL ORDER BY 1"
    ) == [(outer, outer_end), (inner, inner_end)]
