"""Events of a thread on both sides of a gap: of its CPUs, or of others that it may have visited."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import thorough

HERE, THERE = Thread(100, cpu=0), Thread(100, cpu=1)
RUNS = "SELECT start_ns, end_ns, is_loss_affected FROM callback_instance ORDER BY start_ns"
STATES = "SELECT state, start_ns, end_ns FROM executor_state ORDER BY start_ns"
BREAKS = "SELECT resumed_ns, is_elsewhere FROM thread_break ORDER BY resumed_ns"


def packets(system: RosSystem, loss: tuple[int, int], *, cpu: int) -> None:
    """One packet for each of three CPUs until 10,000; events of one of them are lost."""
    begin, end = loss
    for one in range(3):
        if one == cpu:
            system.add_packet(0, end, last_event=begin, discarded=3, cpu=one)
            system.add_packet(end, 10_000, cpu=one)
        else:
            system.add_packet(0, 10_000, cpu=one)


def test_a_thread_that_moved_to_a_cpu_that_was_losing(system: RosSystem, analyse: Analyse) -> None:
    """The loss had begun before the thread's last event on its former CPU."""
    start = system.start(HERE, 0xC1)
    end = system.add("ros2:callback_end", THERE, ts=start + 100, callback=0xC1)
    packets(system, (start - 5, end - 5), cpu=1)
    model = analyse(system)
    assert model.rows(RUNS) == [(start, None, True)]
    assert model.rows(BREAKS) == [(end, False)]


def test_a_loss_that_was_over_when_the_thread_left(system: RosSystem, analyse: Analyse) -> None:
    start = system.start(HERE, 0xC1)
    end = system.add("ros2:callback_end", THERE, ts=start + 100, callback=0xC1)
    packets(system, (start - 50, start), cpu=1)
    model = analyse(system)
    assert model.rows(RUNS) == [(start, end, False)]
    assert model.rows(BREAKS) == []


def test_a_loss_of_the_cpu_that_was_left(system: RosSystem, analyse: Analyse) -> None:
    start = system.start(HERE, 0xC1)
    system.add("ros2:callback_end", THERE, ts=start + 100, callback=0xC1)
    packets(system, (start + 50, start + 60), cpu=0)
    assert analyse(system).rows(RUNS) == [(start, None, True)]


@pytest.mark.parametrize(
    ("before", "loss", "after"),
    [
        (9, (100, 101), 209),
        thorough(19, (25, 26), 41),
        thorough(9, (11, 12), 29),
        thorough(9, (25, 26), 29),
        (9, (11, 75), 89),
        (101, (110, 70), 119),
    ],
    ids=["far from both", "next to both", "near the first", "near the second", "long", "damaged"],
)
def test_a_gap_is_found_wherever_it_lies_between_two_events(
    system: RosSystem, analyse: Analyse, before: int, loss: tuple[int, int], after: int
) -> None:
    """In milliseconds: gaps are looked for in stretches of 20."""
    ms = 1_000_000
    start = system.add("ros2:callback_start", HERE, ts=before * ms, callback=0xC1)
    system.add("ros2:callback_end", HERE, ts=after * ms, callback=0xC1)
    system.add_packet(0, loss[1] * ms, last_event=loss[0] * ms, discarded=3)
    system.add_packet(loss[1] * ms, 300 * ms)
    assert analyse(system).rows(RUNS) == [(start, None, True)]


def test_a_thread_may_have_visited_a_cpu_that_was_losing(
    system: RosSystem, analyse: Analyse
) -> None:
    """A state has no end then; a run that began and ended is most likely one, and marked."""
    before = system.ready(HERE)
    execute = system.execute(HERE, 0x20)
    start = system.start(HERE, 0xC1)
    end = system.add("ros2:callback_end", HERE, ts=start + 100, callback=0xC1)
    after = system.ready(HERE)
    last = system.idle(HERE)
    packets(system, (start + 20, start + 30), cpu=2)
    model = analyse(system)
    assert model.rows(RUNS) == [(start, end, True)]
    assert model.rows(STATES) == [
        ("process", before, execute),
        ("execute", execute, None),
        ("process", after, last),
        ("wait", last, None),
    ]
    assert model.rows(BREAKS) == [(end, True)]
    assert model.rows("SELECT activity, start_ns, end_ns FROM executor_activity ORDER BY 2") == [
        ("select", before, execute),
        ("take", execute, start),
        ("callback", start, None),
        ("select", after, last),
        ("wait", last, None),
    ]


def test_layers_around_a_loss_elsewhere_are_marked(system: RosSystem, analyse: Analyse) -> None:
    """Those of a publication; a take and its callback. What happened before and after is not."""
    system.publisher(HERE, 0x10, "/a")
    system.subscription(HERE, 0x30, "/a", callback=0xC1)
    moments = []
    for stamp in (1, 2, 3):
        system.add("ros2:rclcpp_publish", HERE, publisher_handle=0x10, message=0xA)
        moments.append(system.add("ros2:rcl_publish", HERE, publisher_handle=0x10, message=0xA))
        system.add("ros2:rmw_publish", HERE, message=0xA, timestamp=stamp)
        moments.append(system.take(HERE, 0x30, stamp))
        system.start(HERE, 0xC1)
        system.end(HERE, 0xC1)
    for cpu in (0, 1):
        system.add_packet(0, 10_000, cpu=cpu)
    begin = 0
    for moment in (moments[0], moments[3]):
        system.add_packet(begin, moment + 4, last_event=moment + 2, discarded=3, cpu=2)
        begin = moment + 4
    system.add_packet(begin, 10_000, cpu=2)
    model = analyse(system)
    assert model.column("SELECT is_loss_affected FROM publication ORDER BY start_ns") == [
        True,
        False,
        False,
    ]
    assert model.column("SELECT is_loss_affected FROM take ORDER BY taken_ns") == [
        False,
        True,
        False,
    ]


@pytest.mark.thorough
def test_several_events_behind_a_gap_look_back_to_one(system: RosSystem, analyse: Analyse) -> None:
    """Into each of several ring buffers, after a loss within the call: still one publication."""
    system.publisher(HERE, 0x10, "/a")
    system.add("ros2:rclcpp_intra_publish", HERE, publisher_handle=0x10, message=0xA)
    system.lose()
    for buffer in (0xB1, 0xB2, 0xB3):
        system.add(
            "ros2:rclcpp_ring_buffer_enqueue", HERE, buffer=buffer, index=0, size=1, overwritten=0
        )
    model = analyse(system)
    assert model.rows("SELECT publication_id, is_loss_affected FROM publication") == [(1, True)]
