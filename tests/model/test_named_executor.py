"""Executors that name themselves, as CARET has them do, and their callback groups."""

from __future__ import annotations

from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN, FIRST, SECOND = Thread(100), Thread(100, 101), Thread(100, 102)
EXECUTORS = (
    "SELECT e.kind, e.is_inferred, list(t.tid ORDER BY t.tid) FILTER (WHERE t.tid IS NOT NULL) "
    "FROM executor AS e LEFT JOIN executor_thread AS m USING (executor_id) "
    "LEFT JOIN thread AS t USING (thread_id) "
    "GROUP BY e.executor_id, e.kind, e.is_inferred ORDER BY 1, 2"
)
GROUPS = (
    "SELECT g.kind, e.kind, list(c.callback_handle ORDER BY 1) FROM callback_group AS g "
    "LEFT JOIN executor AS e USING (executor_id) "
    "LEFT JOIN callback_group_member AS m USING (callback_group_id) "
    "LEFT JOIN callback AS c USING (callback_id) GROUP BY g.callback_group_id, g.kind, e.kind "
    "ORDER BY g.callback_group_id"
)


def construct(system: RosSystem, address: int, kind: str) -> None:
    system.add(
        "ros2_caret:construct_executor", MAIN, executor_addr=address, executor_type_name=kind
    )


def add_group(system: RosSystem, executor: int, group: int, kind: str) -> None:
    system.add(
        "ros2_caret:add_callback_group",
        MAIN,
        executor_addr=executor,
        callback_group_addr=group,
        group_type_name=kind,
    )


def add_timer(system: RosSystem, group: int, handle: int) -> None:
    system.add(
        "ros2_caret:callback_group_add_timer",
        MAIN,
        callback_group_addr=group,
        timer_handle=handle,
    )


def run(system: RosSystem, thread: Thread, callback: int) -> None:
    system.start(thread, callback)
    system.end(thread, callback)


def timers(system: RosSystem, *handles: int) -> None:
    """Timers, whose callbacks have the address of the timer plus 0xC0."""
    for handle in handles:
        system.timer(MAIN, handle, handle + 0xC0)


def test_threads_of_a_named_executor_need_no_callback_in_common(
    system: RosSystem, analyse: Analyse
) -> None:
    """Nor do executors become one because a thread helped out in the other once."""
    timers(system, 0x1, 0x2, 0x3)
    for handle, group in ((0x1, 0xA1), (0x2, 0xA2), (0x3, 0xA3)):
        add_timer(system, group, handle)
    construct(system, 0xE1, "multi_threaded_executor")
    construct(system, 0xE2, "single_threaded_executor")
    add_group(system, 0xE1, 0xA1, "mutually_exclusive")
    add_group(system, 0xE1, 0xA2, "reentrant")
    add_group(system, 0xE2, 0xA3, "mutually_exclusive")
    for thread, callback in ((FIRST, 0xC1), (FIRST, 0xC1), (FIRST, 0xC3), (SECOND, 0xC2)):
        run(system, thread, callback)
    run(system, MAIN, 0xC3)
    model = analyse(system)
    assert model.rows(EXECUTORS) == [
        ("multi_threaded_executor", False, [101, 102]),
        ("single_threaded_executor", False, [100]),
    ]
    assert model.rows(GROUPS) == [
        ("mutually_exclusive", "multi_threaded_executor", [0xC1]),
        ("reentrant", "multi_threaded_executor", [0xC2]),
        ("mutually_exclusive", "single_threaded_executor", [0xC3]),
    ]


def test_named_executors_beside_those_that_are_not(system: RosSystem, analyse: Analyse) -> None:
    """One never ran; the construction of one was not traced."""
    timers(system, 0x1, 0x2)
    construct(system, 0xE1, "single_threaded_executor")
    add_timer(system, 0xA2, 0x2)
    add_group(system, 0xE2, 0xA2, "mutually_exclusive")
    run(system, FIRST, 0xC1)
    run(system, SECOND, 0xC2)
    assert analyse(system).rows(EXECUTORS) == [
        ("single_threaded_executor", False, None),
        ("unknown", False, [102]),
        ("unknown", True, [101]),
    ]


def test_an_address_is_used_again(system: RosSystem, analyse: Analyse) -> None:
    """What was there last; and a group first, then what is put in later."""
    timers(system, 0x1, 0x2)
    construct(system, 0xE1, "single_threaded_executor")
    add_timer(system, 0xA1, 0x1)
    add_group(system, 0xE1, 0xA1, "mutually_exclusive")
    construct(system, 0xE1, "multi_threaded_executor")
    add_group(system, 0xE1, 0xA2, "reentrant")
    add_timer(system, 0xA2, 0x2)
    run(system, FIRST, 0xC1)
    run(system, SECOND, 0xC2)
    assert analyse(system).rows(EXECUTORS) == [
        ("multi_threaded_executor", False, [102]),
        ("single_threaded_executor", False, [101]),
    ]


def collected(system: RosSystem, analyse: Analyse) -> Analysis:
    timers(system, 0x1)
    add_timer(system, 0xA1, 0x1)
    run(system, FIRST, 0xC1)
    return analyse(system)


def test_by_way_of_a_collector(system: RosSystem, analyse: Analyse) -> None:
    """Reported in any order, as late recordings do."""
    system.add(
        "ros2_caret:callback_group_to_executor_entity_collector",
        MAIN,
        entities_collector_addr=0xD1,
        callback_group_addr=0xA1,
        group_type_name="mutually_exclusive",
    )
    system.add(
        "ros2_caret:executor_entity_collector_to_executor",
        MAIN,
        executor_addr=0xE1,
        entities_collector_addr=0xD1,
    )
    construct(system, 0xE1, "single_threaded_executor")
    model = collected(system, analyse)
    assert model.rows(EXECUTORS) == [("single_threaded_executor", False, [101])]


def test_static_executors(system: RosSystem, analyse: Analyse) -> None:
    system.add(
        "ros2_caret:construct_static_executor",
        MAIN,
        executor_addr=0xE1,
        entities_collector_addr=0xD1,
        executor_type_name="static_single_threaded_executor",
    )
    system.add(
        "ros2_caret:add_callback_group_static_executor",
        MAIN,
        entities_collector_addr=0xD1,
        callback_group_addr=0xA1,
        group_type_name="mutually_exclusive",
    )
    model = collected(system, analyse)
    assert model.rows(EXECUTORS) == [("static_single_threaded_executor", False, [101])]
    assert model.rows(GROUPS) == [("mutually_exclusive", "static_single_threaded_executor", [0xC1])]
