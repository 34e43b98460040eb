"""Two sessions that record one host at once: every event counts once."""

from __future__ import annotations

from typing import Any

import pytest
from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import few

from msgflow.db.finding import broken_rules

MILLISECOND = 1_000_000
PERIOD = 2 * MILLISECOND
FOUND = (
    "SELECT trace_id, count, detail FROM store.finding "
    "WHERE name = 'overlapping_traces' "
    "ORDER BY trace_id"
)


def session(trace: int, pid: int = 100, **more: Any) -> Thread:
    return Thread(pid, trace=trace, **more)


def create(system: RosSystem, *threads: Thread) -> None:
    """A publisher and a subscription, in the record of every given session."""
    for thread in threads:
        system.context(thread)
        system.node(thread, 0x1, "talker")
        system.publisher(thread, 0x10, "/topic")
        system.subscription(thread, 0x20, "/topic", callback=0x30)


def cycle(system: RosSystem, number: int, *threads: Thread) -> None:
    """One message is published, taken and handled; each event is recorded session by session."""
    stamp = 1_000 + number
    events = [
        ("ros2:rclcpp_publish", {"message": 0xA}),
        ("ros2:rcl_publish", {"publisher_handle": 0x10, "message": 0xA}),
        ("ros2:rmw_publish", {"rmw_publisher_handle": 0x1010, "message": 0xA, "timestamp": stamp}),
        (
            "ros2:rmw_take",
            {
                "rmw_subscription_handle": 0x1020,
                "message": 0xB,
                "source_timestamp": stamp,
                "taken": 1,
            },
        ),
        ("ros2:rcl_take", {"message": 0xB}),
        ("ros2:rclcpp_take", {"message": 0xB}),
        ("ros2:callback_start", {"callback": 0x30, "is_intra_process": 0}),
        ("ros2:callback_end", {"callback": 0x30}),
    ]
    for name, fields in events:
        for thread in threads:
            system.add(name, thread, **fields)
    system.wait(PERIOD)


def sessions(system: RosSystem, *hosts: str) -> None:
    for trace, host in enumerate(hosts):
        system.add_source(trace, host, "boot")


def counts(model: Analysis) -> tuple[int, int, int, int]:
    """Publications, takes, callback instances, and links with an instance behind the take."""
    tables = (
        "publication",
        "take",
        "callback_instance",
        "link_transport JOIN callback_instance USING (run_id, take_id)",
    )
    # At once, so that what they need is built once.
    found = ", ".join(f"(SELECT count(*) FROM {table})" for table in tables)
    ((publications, takes, instances, links),) = model.rows(f"SELECT {found}")
    return publications, takes, instances, links


def failed_checks(model: Analysis) -> list[str]:
    return [finding.name for finding in broken_rules(model.connection, 1)]


def test_a_second_session_counts_nothing_twice(system: RosSystem, analyse: Analyse) -> None:
    threads = session(0), session(1)
    sessions(system, "alpha", "alpha")
    create(system, *threads)
    for number in range(5):
        cycle(system, number, *threads)
    model = analyse(system)
    assert counts(model) == (5, 5, 5, 5)
    for table in ("node", "publisher", "subscription", "callback"):
        assert model.value(f"SELECT count(*) FROM {table}") == 1, table
    ((trace, count, detail),) = model.rows(FOUND)
    assert (trace, count) == (2, 9 + 5 * 8)
    assert detail.endswith("left out because the trace trace-0 has them too")
    assert failed_checks(model) == []


@pytest.mark.parametrize("longer", few([0, 1], 1))
def test_the_usable_rest_of_both_is_kept(system: RosSystem, analyse: Analyse, longer: int) -> None:
    """One session begins and ends before the other; in between that with more events is used."""
    threads = session(0), session(1)
    sessions(system, "alpha", "alpha")
    create(system, threads[0])
    only = [6, 2] if longer == 0 else [2, 6]
    for number in range(only[0]):
        cycle(system, number, threads[0])
    for number in range(10, 13):
        cycle(system, number, *threads)
    for number in range(20, 20 + only[1]):
        cycle(system, number, threads[1])
    model = analyse(system)
    assert counts(model) == (11, 11, 11, 11)
    ((trace, count, _),) = model.rows(FOUND)
    assert (trace, count) == (2 - longer, 3 * 8)
    assert failed_checks(model) == []


def test_sessions_of_different_events_are_one_record(system: RosSystem, analyse: Analyse) -> None:
    """Initialisation in one, the rest in the other; a layer of its own in a third."""
    sessions(system, "alpha", "alpha", "alpha")
    create(system, session(0))
    system.writer(session(0), 0x10, "/topic")
    for number in range(3):
        system.add("ros2:rclcpp_publish", session(1), message=0xA)
        system.add("ros2:rcl_publish", session(1), publisher_handle=0x10, message=0xA)
        system.add("ros2:rmw_publish", session(1), message=0xA)
        system.add("dds:write", session(2), writer=0x2010, timestamp=number, data=0xA)
        system.wait(PERIOD)
    system.add("ros2:rcl_node_init", session(0), node_handle=0x2, node_name="b", namespace="/")
    model = analyse(system)
    assert model.rows(FOUND) == []
    assert (
        model.rows(
            "SELECT topic_name, dds_ns IS NOT NULL FROM publication JOIN publisher USING "
            "(publisher_id)"
        )
        == [("/topic", True)] * 3
    )


def test_sessions_one_after_the_other_are_no_copies(system: RosSystem, analyse: Analyse) -> None:
    sessions(system, "alpha", "alpha")
    create(system, session(0))
    for trace in (0, 1):
        for number in range(3):
            cycle(system, 10 * trace + number, session(trace))
    model = analyse(system)
    assert counts(model) == (6, 6, 6, 6)
    assert model.rows(FOUND) == []


@pytest.mark.thorough
def test_a_trace_per_process_holds_no_copies(system: RosSystem, analyse: Analyse) -> None:
    sessions(system, "alpha", "alpha")
    threads = session(0, 100), session(1, 200)
    create(system, *threads)
    for number in range(3):
        for thread in threads:
            cycle(system, 10 * thread.pid + number, thread)
    model = analyse(system)
    assert counts(model)[:3] == (6, 6, 6)
    assert model.rows(FOUND) == []


@pytest.mark.thorough
def test_other_hosts_hold_no_copies(system: RosSystem, analyse: Analyse) -> None:
    sessions(system, "alpha", "beta")
    threads = session(0), session(1)
    create(system, *threads)
    for number in range(3):
        cycle(system, number, *threads)
    model = analyse(system)
    assert counts(model)[:3] == (6, 6, 6)
    assert model.rows(FOUND) == []


@pytest.mark.thorough
def test_three_sessions(system: RosSystem, analyse: Analyse) -> None:
    sessions(system, "alpha", "alpha", "alpha")
    threads = session(0), session(1), session(2)
    create(system, *threads)
    for number in range(4):
        cycle(system, number, *threads)
    model = analyse(system)
    assert counts(model) == (4, 4, 4, 4)
    assert [row[0] for row in model.rows(FOUND)] == [2, 3]


def test_the_other_session_stands_in_for_a_cpu(system: RosSystem, analyse: Analyse) -> None:
    """A session without the buffer of a CPU has no record of what happened there."""
    sessions(system, "alpha", "alpha")
    create(system, session(0), session(1))
    for number in range(4):
        cycle(system, number, session(0), session(1))
    for number in range(4, 7):
        cycle(system, number, session(1, cpu=1))
    for number in range(7, 16):
        cycle(system, number, session(0), session(1))
    for number in range(16, 26):
        cycle(system, number, session(0))
    model = analyse(system)
    assert counts(model) == (26, 26, 26, 26)


def test_namespaces_of_process_ids_that_one_session_lacks(
    system: RosSystem, analyse: Analyse
) -> None:
    """The initialisation tells the namespace, the rest does not: it is one process."""
    sessions(system, "alpha", "alpha")
    create(system, session(0, pid_ns=7))
    for number in range(3):
        cycle(system, number, session(1))
    system.node(session(0, 200, pid_ns=7), 0x1, "other")
    model = analyse(system)
    assert counts(model) == (3, 3, 3, 3)
    assert model.rows("SELECT pid, pid_namespace FROM store.process ORDER BY ALL") == [
        (100, 7),
        (200, 7),
    ]
    assert model.value("SELECT count(*) FROM thread") == 2
    assert model.column("SELECT DISTINCT is_inferred FROM publisher") == [False]


@pytest.mark.thorough
def test_copies_are_found_where_only_one_session_has_namespaces(
    system: RosSystem, analyse: Analyse
) -> None:
    sessions(system, "alpha", "alpha")
    threads = session(0), session(1, pid_ns=7)
    create(system, *threads)
    for number in range(3):
        cycle(system, number, *threads)
    model = analyse(system)
    assert counts(model) == (3, 3, 3, 3)
    assert model.column("SELECT pid_namespace FROM store.process") == [7]


def test_a_pid_in_several_namespaces_is_left_apart(system: RosSystem, analyse: Analyse) -> None:
    sessions(system, "alpha", "alpha")
    for namespace in (1, 2):
        system.publisher(session(0, pid_ns=namespace), 0x10, f"/{namespace}")
    system.publish(session(1), 0x10, 1)
    model = analyse(system)
    assert model.column("SELECT pid_namespace FROM store.process ORDER BY ALL") == [1, 2, None]


def containers(system: RosSystem, *threads: Thread, rounds: int = 4) -> None:
    """Equal ids in several sessions, one thread each; they take turns."""
    sessions(system, *["alpha"] * len(threads))
    for thread in threads:
        create(system, thread)
    for number in range(rounds):
        for place, thread in enumerate(threads):
            cycle(system, 10 * number + place, thread)


def namespaces(model: Analysis) -> list[int | None]:
    return model.column("SELECT pid_namespace FROM store.process ORDER BY process_id")


def test_containers_with_one_hostname_are_no_copies(system: RosSystem, analyse: Analyse) -> None:
    containers(system, session(0), session(1))
    model = analyse(system)
    assert counts(model) == (8, 8, 8, 8)
    assert model.rows(FOUND) == []
    assert namespaces(model) == [None, -2]
    assert model.rows(
        "SELECT count, detail FROM store.finding WHERE name = 'equal_process_ids'"
    ) == [(1, "processes with ids that others had as well: main 100 on alpha")]
    assert failed_checks(model) == []


@pytest.mark.thorough
def test_most_events_have_a_twin_where_sessions_record_one_thread(
    system: RosSystem, analyse: Analyse
) -> None:
    """The second session lost a third of the first one's events, and has some alone."""
    threads = session(0), session(1)
    sessions(system, "alpha", "alpha")
    create(system, *threads)
    for number in range(12):
        cycle(system, number, *(threads if number % 3 else threads[number % 2 :][:1]))
    model = analyse(system)
    assert namespaces(model) == [None]
    assert counts(model)[2] >= 10


@pytest.mark.thorough
def test_what_only_one_session_recorded_has_no_twin(system: RosSystem, analyse: Analyse) -> None:
    """One goes on for a moment when the next one has started."""
    threads = session(0), session(1)
    sessions(system, "alpha", "alpha")
    create(system, threads[0])
    for number in range(20):
        cycle(system, number, *(threads[:1], threads, threads[1:])[(number > 8) + (number > 10)])
    model = analyse(system)
    assert namespaces(model) == [None]
    assert counts(model) == (20, 20, 20, 20)


@pytest.mark.thorough
def test_few_events_have_one_by_chance(system: RosSystem, analyse: Analyse) -> None:
    threads = session(0), session(1)
    sessions(system, "alpha", "alpha")
    for thread in threads:
        create(system, thread)
        system.wait(PERIOD)
    for number in range(4):
        for thread in threads:
            cycle(system, 10 * number + thread.trace, thread)
    cycle(system, 50, *threads)
    cycle(system, 51, *threads)
    cycle(system, 52, threads[0])
    cycle(system, 53, threads[1])
    model = analyse(system)
    assert namespaces(model) == [None, -2]
    assert counts(model)[:3] == (14, 14, 14)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("late_ns", "is_same"), [(10_000, True), (10_001, False), (-10_000, True), (-10_001, False)]
)
def test_a_twin_follows_at_once(
    system: RosSystem, analyse: Analyse, late_ns: int, is_same: bool
) -> None:
    sessions(system, "alpha", "alpha")
    threads = session(0), session(1)
    create(system, threads[0])
    system.wait(PERIOD)
    create(system, threads[1])
    for number in range(6):
        begin = system.now
        for place, thread in enumerate(threads):
            at = begin + PERIOD + place * late_ns
            system.add("ros2:rcl_publish", thread, ts=at, publisher_handle=0x10, message=number)
    model = analyse(system)
    assert namespaces(model) == ([None] if is_same else [None, -2])


@pytest.mark.thorough
def test_a_twin_is_on_the_same_cpu(system: RosSystem, analyse: Analyse) -> None:
    """Two processes do the same on two CPUs, at one moment."""
    threads = session(0), session(1, cpu=1)
    sessions(system, "alpha", "alpha")
    create(system, *threads)
    system.node(session(0, 200, cpu=1), 0x1, "other")
    for number in range(4):
        cycle(system, number, *threads)
    model = analyse(system)
    assert namespaces(model) == [None, -2, None]
    assert counts(model)[:3] == (8, 8, 8)


@pytest.mark.thorough
def test_two_sessions_of_the_second_container(system: RosSystem, analyse: Analyse) -> None:
    """They are copies of each other, and both are of one container."""
    first, *others = session(0), session(1), session(2)
    sessions(system, "alpha", "alpha", "alpha")
    create(system, first)
    create(system, *others)
    for number in range(4):
        cycle(system, 10 * number, first)
        cycle(system, 10 * number + 1, *others)
    model = analyse(system)
    assert counts(model) == (8, 8, 8, 8)
    assert [row[0] for row in model.rows(FOUND)] == [3]
    assert namespaces(model) == [None, -2]


@pytest.mark.thorough
def test_two_sessions_of_the_first_container(system: RosSystem, analyse: Analyse) -> None:
    """That the second one differs from one of them does not make a container of the other."""
    one, other, twin = session(0), session(1), session(2)
    sessions(system, "alpha", "alpha", "alpha")
    create(system, one, twin)
    create(system, other)
    for number in range(4):
        cycle(system, 10 * number, one, twin)
        cycle(system, 10 * number + 1, other)
    model = analyse(system)
    assert counts(model) == (8, 8, 8, 8)
    assert [row[0] for row in model.rows(FOUND)] == [3]
    assert namespaces(model) == [None, -2]


@pytest.mark.thorough
def test_a_namespace_is_not_that_of_another_container(system: RosSystem, analyse: Analyse) -> None:
    containers(system, session(0, pid_ns=7), session(1))
    model = analyse(system)
    assert namespaces(model) == [7, -2]
    assert counts(model) == (8, 8, 8, 8)


@pytest.mark.thorough
def test_nor_is_one_of_the_second_container_that_of_the_first(
    system: RosSystem, analyse: Analyse
) -> None:
    containers(system, session(0), session(1, pid_ns=9))
    model = analyse(system)
    assert namespaces(model) == [None, 9]
    assert counts(model) == (8, 8, 8, 8)


@pytest.mark.thorough
def test_a_thread_with_a_namespace_that_renames_itself_is_one(
    system: RosSystem, analyse: Analyse
) -> None:
    """Also where another session lacks the namespace."""
    sessions(system, "alpha", "alpha")
    create(system, session(0, name="front"))
    for number in range(2):
        cycle(system, 2 * number, session(1, name="front", pid_ns=7))
        cycle(system, 2 * number + 1, session(1, name="rear", pid_ns=7))
    model = analyse(system)
    assert namespaces(model) == [7]
    assert counts(model) == (4, 4, 4, 4)
