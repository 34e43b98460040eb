"""CPU time of callback instances: whose a reading is, and which source holds."""

from __future__ import annotations

from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
OTHER = Thread(100, 101)
CPU_TIME = "SELECT start_ns, cpu_ns, cpu_source FROM callback_instance ORDER BY start_ns"
_EVENTS = {True: "ros2:callback_start", False: "ros2:callback_end"}


def call(
    system: RosSystem, begin: int, end: int, *, callback: int = 0xC1, thread: Thread = MAIN
) -> None:
    system.add("ros2:callback_start", thread, ts=begin, callback=callback, is_intra_process=0)
    system.add("ros2:callback_end", thread, ts=end, callback=callback)


def read(
    system: RosSystem,
    ts: int,
    value: int,
    *,
    is_begin: bool,
    callback: int = 0xC1,
    thread: Thread = MAIN,
    counter: str = "task_clock",
) -> None:
    system.add(
        "reading",
        thread,
        ts=ts,
        event=_EVENTS[is_begin],
        callback=callback,
        counter=f"perf_thread_{counter}",
        value=value,
    )


def test_a_reading_is_of_the_nearest_event(system: RosSystem, analyse: Analyse) -> None:
    """Right after the event, or before it; of another callback and another thread it is not."""
    call(system, 1_000, 2_000)
    call(system, 2_100, 3_000)
    call(system, 5_000, 6_000, callback=0xC2)
    call(system, 5_000, 6_000, thread=OTHER)
    read(system, 1_001, 70, is_begin=True)
    read(system, 2_040, 570, is_begin=False)
    read(system, 2_099, 580, is_begin=True)
    read(system, 2_999, 680, is_begin=False)
    read(system, 5_001, 10, is_begin=True, thread=OTHER)
    read(system, 6_001, 31, is_begin=False, thread=OTHER)
    analysis = analyse(system)
    assert analysis.rows(
        "SELECT thread_id, start_ns, cpu_ns, cpu_source FROM callback_instance ORDER BY ALL"
    ) == [
        (1, 1_000, 500, "clock"),
        (1, 2_100, 100, "clock"),
        (1, 5_000, None, None),
        (2, 5_000, 21, "clock"),
    ]


def test_the_nearest_of_several_readings_holds(system: RosSystem, analyse: Analyse) -> None:
    """The events of the other readings were lost."""
    call(system, 1_000, 2_000)
    read(system, 700, 9, is_begin=True)
    read(system, 1_001, 70, is_begin=True)
    read(system, 1_500, 80, is_begin=True)
    read(system, 2_001, 90, is_begin=False)
    assert analyse(system).rows(CPU_TIME) == [(1_000, 20, "clock")]


def test_what_was_read_once_or_falls_is_not_known(system: RosSystem, analyse: Analyse) -> None:
    call(system, 1_000, 2_000)
    call(system, 3_000, 4_000)
    read(system, 1_001, 70, is_begin=True)
    read(system, 3_001, 70, is_begin=True)
    read(system, 4_001, 69, is_begin=False)
    assert analyse(system).rows(CPU_TIME) == [(1_000, None, None), (3_000, None, None)]


def test_other_counters_are_kept_by_name(system: RosSystem, analyse: Analyse) -> None:
    call(system, 1_000, 2_000)
    for counter, begin, end in (("instructions", 10, 95), ("page_fault", 3, 3)):
        read(system, 1_000, begin, is_begin=True, counter=counter)
        read(system, 2_000, end, is_begin=False, counter=counter)
    analysis = analyse(system)
    assert analysis.rows("SELECT name, value FROM callback_counter ORDER BY name") == [
        ("instructions", 85),
        ("page_fault", 0),
    ]
    assert analysis.rows(CPU_TIME) == [(1_000, None, None)]


def test_python_says_the_time_after_the_end(system: RosSystem, analyse: Analyse) -> None:
    """Of a callback inside another one, too; what is said elsewhere is of none."""
    system.add("ros2:callback_start", MAIN, ts=1_000, callback=0xC1, is_intra_process=0)
    call(system, 1_100, 1_300, callback=0xC2)
    system.add("ros2:rclcpp_callback_register", MAIN, callback=150, symbol="#msgflow cpu")
    system.add("ros2:callback_end", MAIN, ts=2_000, callback=0xC1)
    system.add("ros2:rclcpp_callback_register", MAIN, callback=400, symbol="#msgflow cpu")
    call(system, 3_000, 4_000)
    system.add("ros2:rclcpp_callback_register", OTHER, callback=40, symbol="#msgflow cpu")
    assert analyse(system).rows(CPU_TIME) == [
        (1_000, 400, "clock"),
        (1_100, 150, "clock"),
        (3_000, None, None),
    ]


def test_no_cpu_time_is_longer_than_the_callback(system: RosSystem, analyse: Analyse) -> None:
    call(system, 1_000, 2_000)
    read(system, 1_000, 10, is_begin=True)
    read(system, 2_004, 1_014, is_begin=False)
    assert analyse(system).rows(CPU_TIME) == [(1_000, 1_000, "clock")]


def test_a_collection_of_garbage_interrupts_the_innermost_callback(
    system: RosSystem, analyse: Analyse
) -> None:
    """What seems longer than its process is left out."""
    system.node(MAIN, 0x1, "python")
    system.add("ros2:callback_start", MAIN, ts=2_000, callback=0xC1, is_intra_process=0)
    call(system, 2_100, 2_200, callback=0xC2)
    system.add(
        "ros2:rclcpp_callback_register", MAIN, ts=2_900, callback=500, symbol="#msgflow collect 2"
    )
    system.add("ros2:callback_end", MAIN, ts=3_000, callback=0xC1)
    system.add("ros2:rclcpp_callback_register", MAIN, callback=7, symbol="#msgflow collect 0")
    for number in (1 << 40, (1 << 64) - 1):
        system.add(
            "ros2:rclcpp_callback_register", MAIN, callback=number, symbol="#msgflow collect 1"
        )
    assert analyse(system).rows(
        "SELECT g.start_ns, g.end_ns, g.generation, i.start_ns FROM garbage_collection AS g "
        "LEFT JOIN callback_instance AS i USING (callback_instance_id) ORDER BY g.start_ns"
    ) == [(2_400, 2_900, 2, 2_000), (3_003, 3_010, 0, None)]


def test_a_process_whose_clocks_are_not_read_is_found(system: RosSystem, analyse: Analyse) -> None:
    """One of whose callbacks one has CPU time is not."""
    system.add_source(1, "alpha", "boot", "clocks")
    system.readers.add(1)
    call(system, 1_000, 2_000)
    call(system, 3_000, 4_000)
    call(system, 1_000, 2_000, thread=Thread(200))
    call(system, 3_000, 4_000, thread=Thread(200))
    system.add("ros2:callback_start", Thread(300), ts=5_000, callback=1, is_intra_process=0)
    clock = Thread(200, trace=1)
    read(system, 1_001, 70, is_begin=True, thread=clock)
    read(system, 2_001, 570, is_begin=False, thread=clock)
    analysis = analyse(system)
    assert analysis.rows(
        "SELECT pid, f.count FROM finding AS f JOIN process AS p USING (process_id) "
        "WHERE f.name = 'cpu_time_not_read'"
    ) == [(100, 2)]
    # It is no trace of its own.
    assert analysis.rows("SELECT trace_id FROM trace ORDER BY trace_id") == [(1,)]
