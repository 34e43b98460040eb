"""Executors, which stock traces do not name, and the states of their threads."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
STATES = (
    "SELECT state, start_ns, end_ns, callback_instance_id FROM executor_state ORDER BY start_ns"
)


def run(system: RosSystem, thread: Thread, callback: int) -> None:
    system.execute(thread, 0x20)
    system.start(thread, callback)
    system.end(thread, callback)


def test_threads_that_share_callbacks_are_one_executor(system: RosSystem, analyse: Analyse) -> None:
    """Directly or through others; the second process has the same callback address."""
    first, second, third, alone = (Thread(100, tid) for tid in (101, 102, 103, 104))
    other = Thread(200, 101)
    for thread, callback in (
        (first, 0xC1),
        (second, 0xC1),
        (second, 0xC2),
        (third, 0xC2),
        (alone, 0xC3),
        (other, 0xC1),
    ):
        run(system, thread, callback)
    model = analyse(system)
    assert model.rows(
        "SELECT p.pid, e.kind, e.is_inferred, list(t.tid ORDER BY t.tid) FROM executor AS e "
        "JOIN executor_thread AS m USING (executor_id) JOIN thread AS t USING (thread_id) "
        "JOIN process AS p ON e.process_id = p.process_id GROUP BY ALL ORDER BY ALL"
    ) == [
        (100, "multi_threaded", True, [101, 102, 103]),
        (100, "single_threaded", True, [104]),
        (200, "single_threaded", True, [101]),
    ]
    assert model.value("SELECT count(*) FROM executor_state WHERE executor_id IS NULL") == 0


@pytest.mark.parametrize(("swapped", "threads", "kind"), [
    (0, 1, "events"),
    # One message that came first was served later.
    (1, 1, "unknown"),
    # The order of the subscriptions explains it, as in a wait set.
    (None, 1, "unknown"),
    # An EventsCBGExecutor: the order is that of each group of callbacks, not of a thread.
    (0, 2, "multi_threaded"),
])  # fmt: skip
def test_what_serves_in_order_of_arrival_is_an_events_executor(
    system: RosSystem, analyse: Analyse, swapped: int | None, threads: int, kind: str
) -> None:
    """Thirteen times two messages wait; the older one is taken first. Else pauses are not known."""
    talker = Thread(200)
    # That its process has executor events at all shows that they were enabled.
    system.ready(talker)
    for number in (1, 2):
        system.publisher(talker, number, f"/topic{number}")
        system.subscription(MAIN, 0x10 + number, f"/topic{number}")
        system.subscription_callback(MAIN, 0x10 + number, 0xC0 + number)
    for turn in range(13 * threads):
        topics = (1, 2) if turn % 2 or swapped is None else (2, 1)
        stamps = 10 + 10 * turn, 15 + 10 * turn
        for topic, stamp in zip(topics, stamps, strict=True):
            system.publish(talker, topic, stamp)
            system.wait(2_000_000)
        served = list(zip(topics, stamps, strict=True))
        if turn == 5 and swapped:
            served.reverse()
        thread = Thread(100, 100 + turn // 2 % threads)
        for topic, stamp in served:
            system.take(thread, 0x10 + topic, stamp)
            system.start(thread, 0xC0 + topic)
            system.end(thread, 0xC0 + topic)
    assert analyse(system).rows(
        "SELECT e.kind, bool_or(a.activity IN ('wait', 'select')) FROM executor AS e "
        "JOIN executor_activity AS a USING (executor_id) "
        "WHERE e.kind <> 'single_threaded' GROUP BY ALL"
    ) == [(kind, kind == "events")]


@pytest.mark.parametrize(("turns", "at_once", "kinds"), [
    (6, False, [("multi_threaded", 2)]),
    # Too few turns to say, or two threads that wait at once: executors of their own.
    (4, False, [("single_threaded", 1), ("single_threaded", 1)]),
    (6, True, [("single_threaded", 1), ("single_threaded", 1)]),
])  # fmt: skip
def test_threads_that_take_turns_in_waiting_are_one_executor(
    system: RosSystem,
    analyse: Analyse,
    turns: int,
    at_once: bool,
    kinds: list[tuple[str, int]],
) -> None:
    """As those of an action server, whose callbacks have no events: a lock keeps them apart."""
    threads = (Thread(100, 101), Thread(100, 102))
    for _ in range(turns):
        for thread in threads:
            system.ready(thread)
            system.idle(thread)
            system.ready(thread)
    if at_once:
        for thread in threads:
            system.idle(thread)
    assert (
        analyse(system).rows(
            "SELECT any_value(e.kind), count(*) FROM executor AS e "
            "JOIN executor_thread USING (executor_id) GROUP BY e.executor_id ORDER BY e.executor_id"
        )
        == kinds
    )


def test_threads_without_executor_events(system: RosSystem, analyse: Analyse) -> None:
    """One may run callbacks without any (static executors, Python); others are no executor."""
    system.start(Thread(100), 0xC1)
    system.publish(Thread(200), 0x10)
    system.take(Thread(300, 309), 0x66, 1)
    system.idle(Thread(400))
    assert analyse(system).rows(
        "SELECT p.pid, e.kind FROM executor AS e JOIN process AS p USING (process_id) ORDER BY 1"
    ) == [(100, "unknown"), (400, "single_threaded")]


def test_states_are_what_the_events_literally_say(system: RosSystem, analyse: Analyse) -> None:
    system.timer(MAIN, 0x20, 0xC1)
    times = [system.ready(MAIN), system.idle(MAIN), system.ready(MAIN), system.execute(MAIN, 0x20)]
    system.start(MAIN, 0xC1)
    system.end(MAIN, 0xC1)
    times += [system.ready(MAIN), system.ready(MAIN)]
    kinds = ["process", "wait", "process", "execute", "process", "process"]
    assert analyse(system).rows(STATES) == [
        (kind, start, end, 1 if kind == "execute" else None)
        for kind, start, end in zip(kinds, times, [*times[1:], None], strict=True)
    ]


def test_states_of_threads_are_apart(system: RosSystem, analyse: Analyse) -> None:
    other = Thread(100, 101)
    first, second = system.idle(MAIN), system.idle(other)
    third, fourth = system.ready(MAIN), system.ready(other)
    assert analyse(system).rows(
        "SELECT tid, start_ns, end_ns FROM executor_state JOIN thread USING (thread_id) "
        "WHERE state = 'wait' ORDER BY tid"
    ) == [(100, first, third), (101, second, fourth)]


def test_a_state_before_a_gap_has_no_end(system: RosSystem, analyse: Analyse) -> None:
    """Nor does a callback behind the gap belong to it."""
    before = system.execute(MAIN, 0x20)
    system.lose()
    system.start(MAIN, 0xC1)
    system.end(MAIN, 0xC1)
    after = system.ready(MAIN)
    assert analyse(system).rows(STATES) == [
        ("execute", before, None, None),
        ("process", after, None, None),
    ]


def test_a_recording_without_an_event_that_delimits_states_is_named(
    system: RosSystem, analyse: Analyse
) -> None:
    """As where a session leaves out an event against busy waiting."""
    for _ in range(2):
        system.ready(MAIN)
        run(system, MAIN, 0xC1)
    model = analyse(system)
    assert model.rows(
        "SELECT count, detail FROM store.finding WHERE name = 'executor_events_left_out'"
    ) == [(1, "nothing shows when its threads waited for work")]
    assert model.value("SELECT count(*) FROM executor_state WHERE end_ns IS NOT NULL") == 0
    assert model.rows("SELECT activity, count(*) FROM executor_activity GROUP BY ALL") == [
        ("callback", 2)
    ]


def test_a_thread_that_looked_in_vain_is_blocked(system: RosSystem, analyse: Analyse) -> None:
    """Another thread waits for work and holds the lock under which it would look again."""
    threads = (Thread(100, 101), Thread(100, 102))
    for thread in threads:
        run(system, thread, 0xC1)
    system.ready(threads[0])
    system.idle(threads[0])
    in_vain = system.ready(threads[0])
    system.ready(threads[1])
    system.idle(threads[1])
    system.ready(threads[1])
    again = system.ready(threads[0])
    assert analyse(system).rows(
        "SELECT start_ns, end_ns FROM executor_activity JOIN thread USING (thread_id) "
        f"WHERE tid = 101 AND start_ns >= {in_vain} AND activity = 'blocked'"
    ) == [(in_vain, again)]


def test_an_executor_inside_a_callback(system: RosSystem, analyse: Analyse) -> None:
    """A callback that spins: states follow each other all the same, each with its callback."""
    outer = system.execute(MAIN, 0x20)
    system.start(MAIN, 0xC1)
    nested = [system.ready(MAIN), system.execute(MAIN, 0x21)]
    system.start(MAIN, 0xC2)
    system.end(MAIN, 0xC2)
    system.end(MAIN, 0xC1)
    last = system.idle(MAIN)
    assert analyse(system).rows(STATES) == [
        ("execute", outer, nested[0], 1),
        ("process", nested[0], nested[1], None),
        ("execute", nested[1], last, 2),
        ("wait", last, None, None),
    ]


def test_the_first_of_several_callbacks_names_a_state(system: RosSystem, analyse: Analyse) -> None:
    """Services run while the executor looks for work: they emit no executor event."""
    system.ready(MAIN)
    for callback in (0xC1, 0xC2):
        system.start(MAIN, callback)
        system.end(MAIN, callback)
    system.idle(MAIN)
    assert [row[3] for row in analyse(system).rows(STATES)] == [1, None]


@pytest.mark.thorough
def test_an_executor_that_waits_only_afterwards_was_not_idle(
    system: RosSystem, analyse: Analyse
) -> None:
    """It says when it waits, so that it did not wait before; one that says nothing may have."""
    source = Thread(200)
    system.publisher(source, 0x10, "/topic")
    for thread in (MAIN, Thread(300)):
        system.subscription(thread, 0x30, "/topic", callback=0xC1)
    system.publish(source, 0x10, 1)
    for thread in (MAIN, Thread(300)):
        system.take(thread, 0x30, 1)
        system.start(thread, 0xC1)
        system.end(thread, 0xC1)
    system.idle(MAIN)
    system.ready(MAIN)
    assert analyse(system).rows(
        "SELECT p.pid, w.idle_ns FROM executor_wait AS w JOIN thread AS t USING (thread_id) "
        "JOIN process AS p USING (process_id) ORDER BY 1"
    ) == [(100, 0), (300, None)]


def test_a_message_may_lie_in_the_queue_while_its_thread_is_away(
    system: RosSystem, analyse: Analyse
) -> None:
    """A loop polls the executor, and sleeps in between: neither waiting nor a callback."""
    source, slept_ns = Thread(200), 50_000_000
    system.node(source, 0x1, "source")
    system.node(MAIN, 0x1, "sink")
    system.publisher(source, 0x10, "/topic")
    system.subscription(MAIN, 0x30, "/topic", callback=0xC1)
    for number in (1, 2):
        system.idle(MAIN)
        system.ready(MAIN)
        system.publish(source, 0x10, number)
        system.wait(slept_ns)
        system.idle(MAIN)
        system.ready(MAIN)
        system.execute(MAIN, 0x30)
        system.take(MAIN, 0x30, number)
        system.start(MAIN, 0xC1)
        system.end(MAIN, 0xC1)
    model = analyse(system)
    assert model.rows(
        "SELECT wait_ns - held_max_ns < 100, busy_max_ns FROM executor_wait ORDER BY start_ns"
    ) == [(True, 0), (True, 0)]
    assert model.rows(
        "SELECT activity, duration_ns >= 50000000 FROM critical_path([1]) "
        "WHERE duration_ns > 1000000"
    ) == [("undecided", True)]


def test_threads_that_poll(system: RosSystem, analyse: Analyse) -> None:
    """Most of their waits have a timeout of 0."""
    timeouts = {101: [0, 0, -1], 102: [0, -1], 103: [0], 104: [0, 0, -1, -1], 105: [5, 5]}
    for tid, each in timeouts.items():
        for timeout in each:
            system.add("ros2:rclcpp_executor_wait_for_work", Thread(100, tid), timeout=timeout)
    assert analyse(system).rows(
        "SELECT count, detail FROM finding WHERE name = 'polled_executor'"
    ) == [(2, "polled 2 times, of 3 waits in all")]
