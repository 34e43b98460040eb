"""Hosts, processes and their lives, threads."""

from __future__ import annotations

from dataclasses import replace

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import STEP_NS, Thread
from support.thorough import thorough

MAIN = Thread(100)
LIVES = "SELECT pid, life, name, first_seen_ns, last_seen_ns FROM store.process ORDER BY process_id"
RESTARTS = "SELECT count FROM store.finding WHERE name = 'process_restart'"


def test_a_process_is_named_after_its_main_thread(system: RosSystem, analyse: Analyse) -> None:
    """Another may be seen first."""
    system.publish(Thread(100, 105, "dds.udp"), 0x10)
    system.context(Thread(100, name="talker"))
    system.publish(Thread(200, 205, "worker"), 0x10)
    model = analyse(system)
    assert model.rows("SELECT pid, name, tracetools_version FROM process ORDER BY pid") == [
        (100, "talker", "4.1.0"),
        (200, "worker", None),
    ]
    assert model.rows("SELECT tid, name FROM thread ORDER BY tid") == [
        (100, "talker"),
        (105, "dds.udp"),
        (205, "worker"),
    ]


def test_hosts_may_use_the_same_process_ids(system: RosSystem, analyse: Analyse) -> None:
    """Containers of one machine share its clock, traces of one host share its processes."""
    system.add_source(0, "alpha", "boot-a")
    system.add_source(1, "beta", "boot-b")
    system.add_source(2, "container", "boot-a")
    system.add_source(3, "alpha", "boot-a")
    for trace in range(4):
        system.publisher(Thread(100, trace=trace), 0x10, f"/{trace}")
    system.publish(Thread(100, trace=3), 0x10, 1)
    model = analyse(system)
    assert model.rows(
        "SELECT h.hostname, c.uuid, p.pid FROM process AS p JOIN host AS h USING (host_id) "
        "JOIN clock AS c USING (clock_id) ORDER BY p.process_id"
    ) == [("alpha", "boot-a", 100), ("beta", "boot-b", 100), ("container", "boot-a", 100)]
    assert model.value("SELECT count(*) FROM clock") == 2
    assert model.column(
        "SELECT topic_name FROM publication JOIN publisher USING (publisher_id)"
    ) == ["/3"]


def test_namespaces_of_process_ids_keep_processes_apart(
    system: RosSystem, analyse: Analyse
) -> None:
    for namespace in (1, 2):
        system.publisher(Thread(1, pid_ns=namespace), 0x10, f"/{namespace}")
    system.publish(Thread(1, pid_ns=1), 0x10, 1)
    model = analyse(system)
    assert model.rows("SELECT pid, pid_namespace FROM store.process ORDER BY ALL") == [
        (1, 1),
        (1, 2),
    ]
    assert model.column(
        "SELECT topic_name FROM publication JOIN publisher USING (publisher_id)"
    ) == ["/1"]


MILLISECOND = 1_000_000
NAMESPACES = "SELECT name, pid_namespace FROM store.process ORDER BY process_id"


def called(system: RosSystem, *threads: Thread) -> None:
    """A callback on each thread; each has its publisher and publishes."""
    for thread in threads:
        handle = sum(str(thread.name).encode())
        system.publisher(thread, handle, f"/{thread.name}")
    for number in range(3):
        for thread in threads:
            handle = sum(str(thread.name).encode())
            system.add("ros2:callback_start", thread, callback=handle, is_intra_process=0)
            system.publish(thread, handle, number + handle)
            system.add("ros2:callback_end", thread, callback=handle)
            system.wait(MILLISECOND)


@pytest.mark.thorough
def test_a_name_that_comes_back_is_of_another_process(system: RosSystem, analyse: Analyse) -> None:
    """Two containers share a session daemon. One thread has the name of its process."""
    called(system, Thread(7, name="front"), Thread(7, name="rear"))
    system.publish(Thread(7, 8, name="rear"), sum(b"rear"), 1)
    model = analyse(system)
    assert model.rows(NAMESPACES) == [("front", -1), ("rear", -2)]
    assert model.rows(
        "SELECT topic_name, count(*) FROM publication JOIN publisher USING (publisher_id) "
        "GROUP BY ALL ORDER BY ALL"
    ) == [("/front", 3), ("/rear", 4)]
    assert model.value("SELECT count(*) FROM store.finding WHERE name = 'mixed_processes'") == 0


def test_a_recorded_namespace_counts_more_than_a_name(system: RosSystem, analyse: Analyse) -> None:
    called(system, Thread(7, name="front", pid_ns=1), Thread(7, name="rear", pid_ns=1))
    model = analyse(system)
    assert model.rows(NAMESPACES) == [("rear", 1)]


def test_a_name_that_does_not_come_back_is_a_new_name(system: RosSystem, analyse: Analyse) -> None:
    called(system, Thread(7, name="python3"))
    called(system, Thread(7, name="listener"))
    assert analyse(system).rows(NAMESPACES) == [("listener", None)]


def test_a_name_that_comes_back_in_another_life_is_a_new_name(
    system: RosSystem, analyse: Analyse
) -> None:
    """Each of two lives renames its thread once."""
    for _ in range(2):
        system.context(Thread(7, name="python3"))
        called(system, Thread(7, name="python3"))
        called(system, Thread(7, name="listener"))
    assert analyse(system).rows("SELECT DISTINCT pid_namespace FROM store.process") == [(None,)]


def test_another_thread_begins_no_life(system: RosSystem, analyse: Analyse) -> None:
    for number in range(2):
        system.publish(Thread(7, name="front"), 0x10, number)
        system.publish(Thread(7, name="rear"), 0x11, number)
        if number == 0:
            system.context(Thread(8))
    assert analyse(system).rows(NAMESPACES) == [("front", -1), ("rear", -2), ("main", None)]


def test_a_name_that_some_events_lack_is_no_other_one(system: RosSystem, analyse: Analyse) -> None:
    """Where a channel has no context for it. Threads take turns."""
    front, rear = Thread(7, name="front"), Thread(8, name="rear")
    called(system, front, rear, Thread(7, name=None), Thread(8, name=None))
    assert analyse(system).rows("SELECT DISTINCT pid_namespace FROM store.process") == [(None,)]


def renaming(system: RosSystem, pid: int, trace: int = 0) -> None:
    """A thread has one name while it waits, and another while its callback runs."""
    idle, busy = Thread(pid, name="idle", trace=trace), Thread(pid, name="busy", trace=trace)
    for number in range(3):
        system.add("ros2:callback_start", idle, callback=0x1)
        system.publish(busy, 0x10, number)
        system.add("ros2:callback_end", busy, callback=0x1)
        system.add("ros2:rclcpp_executor_wait_for_work", idle, timeout=-1)


def test_a_thread_that_renames_itself_in_callbacks_is_one(
    system: RosSystem, analyse: Analyse
) -> None:
    renaming(system, 7)
    assert analyse(system).rows(NAMESPACES) == [("idle", None)]


@pytest.mark.parametrize(("pid", "trace"), [(8, 0), (7, 1)])
def test_a_thread_that_renames_itself_says_nothing_of_others(
    system: RosSystem, analyse: Analyse, pid: int, trace: int
) -> None:
    """Another one of this host, or one with this id on another host."""
    system.add_source(1, "beta", "boot")
    called(system, Thread(7, name="front"), Thread(7, name="rear"))
    renaming(system, pid, trace)
    assert analyse(system).rows(NAMESPACES) == [("front", -1), ("rear", -2), ("idle", None)]


def test_processes_with_one_id_are_those_of_a_host(system: RosSystem, analyse: Analyse) -> None:
    """Elsewhere, others have that id: two as well, or one of the same name."""
    for trace, host in enumerate(("alpha", "beta", "gamma")):
        system.add_source(trace, host, "boot")
    called(system, Thread(7, name="front"), Thread(7, name="rear"))
    called(system, Thread(7, name="left", trace=1), Thread(7, name="right", trace=1))
    called(system, Thread(7, name="rear", trace=2))
    assert analyse(system).rows(NAMESPACES) == [
        ("front", -1),
        ("rear", -2),
        ("left", -1),
        ("right", -2),
        ("rear", None),
    ]


@pytest.mark.parametrize(("return_ns", "is_ambiguous"), [(9_990, True), (10_000, False)])
def test_a_thread_on_two_cpus_at_one_moment_is_of_several_processes(
    system: RosSystem, analyse: Analyse, return_ns: int, is_ambiguous: bool
) -> None:
    system.publisher(Thread(7), 0x10, "/a")
    system.subscription(Thread(7), 0x20, "/a", callback=0x30)
    system.subscription(Thread(9), 0x20, "/a")
    system.publisher(Thread(9), 0x40, "/b")
    system.subscription(Thread(7), 0x50, "/b")
    system.publish(Thread(9), 0x40, 2)
    system.take(Thread(7), 0x50, 2)
    system.wait(MILLISECOND)
    system.add("ros2:callback_start", Thread(7), callback=0x30, is_intra_process=0)
    begin = system.publish(Thread(7), 0x10, 1)
    system.add(
        "ros2:rmw_take", Thread(9), rmw_subscription_handle=0x1020, source_timestamp=1, taken=1
    )
    system.add("ros2:callback_end", Thread(7, cpu=1), ts=begin + 100, callback=0x30)
    begin = system.now - 80
    system.add("ros2:rclcpp_executor_wait_for_work", Thread(7), ts=begin + return_ns, timeout=-1)
    model = analyse(system)
    assert model.rows("SELECT pid, is_ambiguous FROM store.process ORDER BY pid") == [
        (7, is_ambiguous),
        (9, False),
    ]
    for view, count in (("link_transport", 2), ("link_causal", 1)):
        found = model.column(f"SELECT candidate_count FROM {view}")
        assert found == [1 + is_ambiguous] * count, view
    assert (
        model.rows("SELECT count, detail FROM store.finding WHERE name = 'mixed_processes'")
        == [(1, "processes that are several with equal ids: main 7 on alpha")] * is_ambiguous
    )


def test_a_pid_used_again(system: RosSystem, analyse: Analyse) -> None:
    """The same program once more, at the same addresses: nothing of the old one is meant."""
    first = system.context(MAIN)
    system.publisher(MAIN, 0x10, "/old")
    old = system.publish(MAIN, 0x10, 1) + 20
    second = system.context(MAIN)
    system.publisher(MAIN, 0x10, "/new")
    new = system.publish(MAIN, 0x10, 3) + 20
    model = analyse(system)
    assert model.rows(LIVES) == [(100, 1, "main", first, old), (100, 2, "main", second, new)]
    assert model.column(
        "SELECT topic_name FROM publication JOIN publisher USING (publisher_id) "
        "ORDER BY publication_id"
    ) == ["/old", "/new"]
    assert model.column("SELECT first_seen_ns FROM thread ORDER BY 1") == [first, second]
    assert model.rows(RESTARTS) == [(1,)]


def test_initialising_again_is_no_new_life_while_an_old_object_goes_on(
    system: RosSystem, analyse: Analyse
) -> None:
    system.context(MAIN)
    system.publisher(MAIN, 0x10, "/a")
    system.publish(MAIN, 0x10, 1)
    system.context(MAIN)
    system.publish(MAIN, 0x10, 2)
    model = analyse(system)
    assert len(model.rows(LIVES)) == 1
    assert model.column("SELECT topic_name FROM publisher") == ["/a"]


def test_nor_while_an_old_callback_is_called(system: RosSystem, analyse: Analyse) -> None:
    system.context(MAIN)
    system.timer(MAIN, 0x40, callback=0xC1)
    system.context(MAIN)
    system.start(MAIN, 0xC1)
    system.end(MAIN, 0xC1)
    assert len(analyse(system).rows(LIVES)) == 1


def called_once(system: RosSystem, thread: Thread, callback: int) -> int:
    system.start(thread, callback)
    return system.end(thread, callback)


@pytest.mark.parametrize(
    ("goes_on", "lives"),
    [
        ("nothing", 2),
        ("made_again", 2),
        ("another", 2),
        ("callback", 1),
        ("running", 1),
        ("around", 1),
    ],
)
def test_the_first_initialisation_recorded_may_not_be_the_first(
    system: RosSystem, analyse: Analyse, goes_on: str, lives: int
) -> None:
    """The recording began while a process ran. What goes on behind it is of the same process."""
    worker = Thread(100, 101, "worker")
    called_once(system, MAIN, 0xC1)
    system.start(worker, 0xC2)
    if goes_on == "around":
        system.start(MAIN, 0xC4)
    system.context(MAIN)
    if goes_on == "around":
        system.end(MAIN, 0xC4)
    if goes_on == "made_again":
        system.timer(MAIN, 0x40, callback=0xC1)
    if goes_on == "another":
        called_once(system, MAIN, 0xC3)
    if goes_on in {"made_again", "callback"}:
        called_once(system, MAIN, 0xC1)
    if goes_on == "running":
        system.end(worker, 0xC2)
    assert len(analyse(system).rows(LIVES)) == lives


@pytest.mark.parametrize("is_made_first", [True, False])
def test_an_address_goes_on_if_it_is_used_before_it_is_made_again(
    system: RosSystem, analyse: Analyse, is_made_first: bool
) -> None:
    """What comes later changes nothing."""
    called_once(system, MAIN, 0xC1)
    system.context(MAIN)
    if is_made_first:
        system.timer(MAIN, 0x40, callback=0xC1)
    called_once(system, MAIN, 0xC1)
    system.timer(MAIN, 0x40, callback=0xC1)
    called_once(system, MAIN, 0xC1)
    assert len(analyse(system).rows(LIVES)) == 1 + is_made_first


def test_an_object_made_before_the_first_initialisation_recorded_is_of_an_old_life(
    system: RosSystem, analyse: Analyse
) -> None:
    system.publisher(MAIN, 0x10, "/old")
    system.context(MAIN)
    system.publisher(MAIN, 0x10, "/new")
    system.publish(MAIN, 0x10, 1)
    model = analyse(system)
    assert len(model.rows(LIVES)) == 2
    assert model.column(
        "SELECT topic_name FROM publication JOIN publisher USING (publisher_id)"
    ) == ["/new"]


@pytest.mark.parametrize("is_again", [True, False])
def test_a_publisher_that_is_never_made_shows_no_life(
    system: RosSystem, analyse: Analyse, is_again: bool
) -> None:
    """The logger publishes to /rosout on a stack address, which may be the same in every life."""
    if is_again:
        system.context(MAIN)
    system.publish(MAIN, 0x10, 1)
    system.context(MAIN)
    system.publish(MAIN, 0x10, 2)
    assert len(analyse(system).rows(LIVES)) == 1 + is_again


def test_a_callback_whose_registration_was_lost_goes_on(
    system: RosSystem, analyse: Analyse
) -> None:
    system.context(MAIN)
    called_once(system, MAIN, 0xC1)
    system.context(MAIN)
    called_once(system, MAIN, 0xC1)
    assert len(analyse(system).rows(LIVES)) == 1


@pytest.mark.parametrize(("is_lost", "lives"), [(True, 2), (False, 1)])
def test_a_callback_behind_a_gap_keeps_no_life_going(
    system: RosSystem, analyse: Analyse, is_lost: bool, lives: int
) -> None:
    called_once(system, MAIN, 0xC1)
    first = system.context(MAIN)
    system.wait(100)
    end = called_once(system, MAIN, 0xC1)
    lose(system, 0, (first + 1, first + 2) if is_lost else (end, end + 1))
    assert len(analyse(system).rows(LIVES)) == lives


another = pytest.mark.parametrize(
    "other",
    [
        thorough(Thread(100, 101, "other", trace=1, pid_ns=1), id="on_another_host"),
        pytest.param(Thread(100, 101, "other", pid_ns=2), id="in_another_namespace"),
        thorough(Thread(200, 201, "other", pid_ns=1), id="with_another_id"),
    ],
)
OTHERS = "SELECT name, max(life) FROM store.process GROUP BY name ORDER BY name"


@another
def test_what_another_process_goes_on_with_keeps_no_life_going(
    system: RosSystem, analyse: Analyse, other: Thread
) -> None:
    """Not even where the handles of both are the same. Nor does what only begins afterwards."""
    main, worker = Thread(100, pid_ns=1), Thread(100, 102, "worker", pid_ns=1)
    system.add_source(1, "beta", "boot-b")
    system.context(main)
    system.publisher(main, 0x10, "/a")
    system.publish(worker, 0x10, 1)
    system.publisher(other, 0x11, "/b")
    system.start(other, 0xC1)
    system.context(main)
    system.publish(main, 0x11, 2)
    system.publish(other, 0x10, 3)
    system.publish(other, 0x11, 4)
    system.start(worker, 0xC2)
    system.end(worker, 0xC2)
    system.end(other, 0xC1)
    assert analyse(system).rows(OTHERS) == [("main", 2), ("other", 1)]


@pytest.mark.thorough
@another
def test_what_another_process_did_before_begins_no_life(
    system: RosSystem, analyse: Analyse, other: Thread
) -> None:
    system.add_source(1, "beta", "boot-b")
    called_once(system, other, 0xC1)
    system.publish(Thread(100, pid_ns=1), 0x20, 1)
    system.context(Thread(100, pid_ns=1))
    assert analyse(system).rows(OTHERS) == [("main", 1), ("other", 1)]


@pytest.mark.thorough
@another
def test_another_program_begins_a_life_whatever_another_process_does(
    system: RosSystem, analyse: Analyse, other: Thread
) -> None:
    system.add_source(1, "beta", "boot-b")
    system.context(Thread(100, name="talker", pid_ns=1), 0xC1)
    system.publish(other, 0x11, 1)
    system.context(Thread(100, name="listener", pid_ns=1), 0xC2)
    system.publish(other, 0x11, 2)
    assert analyse(system).rows(OTHERS) == [("listener", 2), ("other", 1), ("talker", 1)]


def test_another_program_may_do_something_before_it_initialises(
    system: RosSystem, analyse: Analyse
) -> None:
    """Only other threads that go on are those of an old life."""
    listener = Thread(100, name="listener")
    system.context(Thread(100, name="talker"), 0xC1)
    system.publish(listener, 0x10, 1)
    system.context(listener, 0xC2)
    system.publish(listener, 0x10, 2)
    assert len(analyse(system).rows(LIVES)) == 2


@pytest.mark.parametrize("before", [0xC1, 0xC2])
def test_a_callback_whose_start_was_lost_may_have_begun_in_the_new_life(
    system: RosSystem, analyse: Analyse, before: int
) -> None:
    """The worker called it before, or was in another one."""
    worker = Thread(100, 101, "worker")
    system.context(MAIN)
    system.start(worker, before)
    if before == 0xC1:
        system.end(worker, before)
    system.context(MAIN)
    system.end(worker, 0xC1)
    assert len(analyse(system).rows(LIVES)) == 2


def lose(system: RosSystem, trace: int, *gaps: tuple[int, int]) -> None:
    """Declare the gaps of a trace, all on a CPU without events."""
    begin = 0
    for last_event, end in gaps:
        system.add_packet(begin, end, last_event=last_event, discarded=5, cpu=1, trace=trace)
        begin = end
    system.add_packet(begin, system.now, cpu=1, trace=trace)


@pytest.mark.parametrize(
    ("lost", "lives"), [("before", 1), ("init", 2), thorough("use", 1), thorough("elsewhere", 1)]
)
def test_an_old_object_used_behind_a_gap_may_have_been_made_again(
    system: RosSystem, analyse: Analyse, lost: str, lives: int
) -> None:
    system.context(MAIN)
    system.publisher(MAIN, 0x10, "/a")
    system.wait(100)
    again = system.context(MAIN)
    used = system.publish(MAIN, 0x10, 2) + 10
    system.wait(100)
    end = system.publish(MAIN, 0x10, 3)
    system.add_source(1, "beta", "boot-b")
    gaps = {"before": (again - 50, again), "init": (again, again + 1), "use": (used, used + 50)}
    lose(system, 0, gaps.get(lost, (end, end + 1)), (end + 1, end + 5))
    lose(system, 1, (again - 1, again + 1))
    model = analyse(system)
    assert len(model.rows(LIVES)) == lives
    assert set(
        model.column("SELECT topic_name FROM publication JOIN publisher USING (publisher_id)")
    ) == {"/a" if lives == 1 else None}


@pytest.mark.parametrize(("lost", "lives"), [("before", 2), ("behind", 1)])
def test_a_callback_that_ends_behind_a_gap_may_have_begun_again(
    system: RosSystem, analyse: Analyse, lost: str, lives: int
) -> None:
    worker = Thread(100, 101, "worker")
    system.context(MAIN)
    system.start(worker, 0xC1)
    again = system.context(MAIN)
    ended = system.end(worker, 0xC1)
    system.publish(MAIN, 0x10, 1)
    lose(system, 0, (again, again + 1) if lost == "before" else (ended, ended + 1))
    assert len(analyse(system).rows(LIVES)) == lives


def test_a_pid_used_again_by_another_program(system: RosSystem, analyse: Analyse) -> None:
    """Or under another main thread, as in a container."""
    for name, tid, context in (("talker", 100, 1), ("listener", 100, 2), ("listener", 101, 3)):
        system.context(Thread(100, tid, name), context)
    assert [row[:3] for row in analyse(system).rows(LIVES)] == [
        (100, 1, "talker"),
        (100, 2, "listener"),
        (100, 3, "listener"),
    ]


def test_another_program_at_the_same_addresses_is_a_new_life(
    system: RosSystem, analyse: Analyse
) -> None:
    system.context(MAIN)
    system.publisher(MAIN, 0x10, "/a")
    system.publish(MAIN, 0x10, 1)
    other = Thread(100, 100, "listener")
    system.context(other)
    system.publish(other, 0x10, 2)
    model = analyse(system)
    assert [row[:3] for row in model.rows(LIVES)] == [(100, 1, "main"), (100, 2, "listener")]
    assert model.column("SELECT topic_name FROM publisher ORDER BY publisher_id") == ["/a", None]


def test_a_second_context_is_no_new_life(system: RosSystem, analyse: Analyse) -> None:
    system.context(MAIN, 0xC1)
    system.publisher(MAIN, 0x10, "/a")
    system.context(MAIN, 0xC2)
    system.publish(MAIN, 0x10, 1)
    model = analyse(system)
    assert len(model.rows(LIVES)) == 1
    assert model.rows(RESTARTS) == []
    assert model.column("SELECT topic_name FROM publisher") == ["/a"]


def test_initialising_again_is_no_new_life_while_another_thread_goes_on(
    system: RosSystem, analyse: Analyse
) -> None:
    worker = Thread(100, 101, "worker")
    system.context(MAIN)
    system.publisher(MAIN, 0x10, "/a")
    system.publish(worker, 0x10, 1)
    system.context(MAIN)
    system.context(Thread(100, 102, "other"), 0xC7)
    system.publish(worker, 0x10, 2)
    model = analyse(system)
    assert len(model.rows(LIVES)) == 1
    assert model.column("SELECT DISTINCT publisher_id FROM publication") == [1]


def test_threads_belong_to_a_life(system: RosSystem, analyse: Analyse) -> None:
    """A worker that goes on keeps the life going; the next life has the main thread's tid."""
    worker, next_worker = Thread(100, 101, "worker"), Thread(100, 102, "worker")
    system.context(MAIN)
    start = system.start(worker, 0xC1)
    system.context(MAIN)
    end = system.end(worker, 0xC1)
    system.context(MAIN)
    system.publish(next_worker, 0x10, 1)
    model = analyse(system)
    assert model.rows(
        "SELECT life, tid, first_event_id FROM store.thread JOIN store.process USING (process_id) "
        "ORDER BY thread_id"
    ) == [(1, 100, 0), (1, 101, 1), (2, 100, 4), (2, 102, 5)]
    assert model.rows("SELECT start_ns, end_ns FROM callback_instance") == [(start, end)]


def test_a_life_ends_the_runs_of_its_threads(system: RosSystem, analyse: Analyse) -> None:
    system.context(MAIN)
    system.start(MAIN, 0xC1)
    system.context(MAIN)
    system.end(MAIN, 0xC1)
    system.publish(MAIN, 0x10, 1)
    model = analyse(system)
    assert len(model.rows(LIVES)) == 2
    assert model.column("SELECT end_ns FROM callback_instance") == [None]
    assert model.rows("SELECT * FROM link_causal") == []


FAST_DDS = [1, 15]


def gid(process: int, entity: int, vendor: list[int] = FAST_DDS, participant: int = 1) -> list[int]:
    """Return the GID of an endpoint, where DDS gives each process a number of its own."""
    return [*vendor, 8, 9, 7, 0, 6, process, participant, 0, 0, 0, 0, 0, entity, 3]


MIXED = "SELECT pid, is_ambiguous FROM store.process ORDER BY process_id"
FRONT = Thread(7, pid_ns=1)


@pytest.mark.parametrize(
    ("used", "rear"),
    [
        ("publisher", FRONT),
        thorough("subscription", FRONT),
        thorough("creation", FRONT),
        ("publisher", replace(FRONT, pid=8)),
        thorough("publisher", replace(FRONT, trace=1)),
        thorough("publisher", replace(FRONT, pid_ns=2)),
    ],
)
def test_objects_of_several_processes_are_used_by_turns(
    system: RosSystem, analyse: Analyse, used: str, rear: Thread
) -> None:
    """Containers whose programs have one name, on one CPU."""
    system.add_source(1, "beta", "boot-b")
    system.publisher(FRONT, 0x10, "/a", gid=gid(1, 1))
    system.subscription(FRONT, 0x20, "/b", gid=gid(1, 2))
    system.publisher(rear, 0x30, "/b", gid=gid(2, 1))
    system.subscription(rear, 0x40, "/a", gid=gid(2, 2))
    system.publish(rear, 0x30, 1)
    worker = replace(FRONT, tid=17)
    if used == "publisher":
        system.publish(worker, 0x10, 1)
    elif used == "subscription":
        system.take(worker, 0x20, 1)
    else:
        system.publisher(worker, 0x50, "/c", gid=gid(1, 3))
    system.take(rear, 0x40, 1)
    expected = [(7, True)] if rear == FRONT else [(7, False), (rear.pid, False)]
    assert analyse(system).rows(MIXED) == expected


def test_a_publisher_of_several_layers_is_of_one_process(
    system: RosSystem, analyse: Analyse
) -> None:
    """The layers of two processes were made by turns."""
    for number in (1, 2):
        system.add("ros2:rmw_publisher_init", MAIN, rmw_publisher_handle=number, gid=gid(number, 1))
    for number in (1, 2):
        system.add(
            "ros2:rcl_publisher_init",
            MAIN,
            publisher_handle=0x10 + number,
            rmw_publisher_handle=number,
        )
    system.publish(MAIN, 0x11, 1, rmw=1)
    assert analyse(system).rows(MIXED) == [(100, True)]


def test_two_participants_of_a_process_take_turns(system: RosSystem, analyse: Analyse) -> None:
    """It initialised ROS twice, for two domains. A later process has its id."""
    for number in (1, 2):
        system.context(MAIN, 0xC0 + number)
        system.publisher(MAIN, number, "/a", gid=gid(1, number, participant=number))
    for _ in range(2):
        system.publish(MAIN, 1, 1)
        system.publish(MAIN, 2, 1)
    system.publisher(MAIN, 3, "/a", gid=gid(2, 1))
    assert analyse(system).rows(MIXED) == [(100, False)]


@pytest.mark.parametrize("vendor", [[1, 16], [2, 15]])
def test_other_middlewares_make_gids_as_they_like(
    system: RosSystem, analyse: Analyse, vendor: list[int]
) -> None:
    for number in (1, 2):
        system.publisher(MAIN, number, "/a", gid=gid(number, number, vendor))
    system.publish(MAIN, 1, 1)
    assert analyse(system).rows(MIXED) == [(100, False)]


@pytest.mark.parametrize("handle", [0x10, 0x20])
def test_objects_of_processes_that_follow_each_other(
    system: RosSystem, analyse: Analyse, handle: int
) -> None:
    """The later one has its publisher at the address of the earlier one, or not. So has another."""
    other = Thread(200)
    publishers = {1: 0x10, 2: handle}

    def begin(thread: Thread, life: int) -> None:
        system.context(thread, 0xC0 + life)
        system.publisher(thread, publishers[life], "/a", gid=gid(thread.pid + life, 1))
        system.subscription(thread, 0x30, "/b", gid=gid(thread.pid + life, 2))

    def use(thread: Thread, life: int) -> None:
        system.publish(thread, publishers[life], life)
        system.take(thread, 0x30, life)

    begin(other, 1)
    begin(MAIN, 1)
    use(MAIN, 1)
    begin(MAIN, 2)
    use(other, 1)
    begin(other, 2)
    use(MAIN, 2)
    use(other, 2)
    assert not any(is_ambiguous for _, is_ambiguous in analyse(system).rows(MIXED))


def test_addresses_are_those_of_one_process(system: RosSystem, analyse: Analyse) -> None:
    """Another process has the same ones, and a later one has the id of each."""
    other = Thread(200)

    def rmw(thread: Thread, life: int, handle: int) -> None:
        own = gid(thread.pid + life, 1)
        system.add("ros2:rmw_publisher_init", thread, rmw_publisher_handle=handle, gid=own)

    def rcl(thread: Thread, handle: int, rmw_handle: int) -> None:
        handles = {"publisher_handle": handle, "rmw_publisher_handle": rmw_handle}
        system.add("ros2:rcl_publisher_init", thread, **handles)

    rmw(MAIN, 1, 1)
    rmw(other, 1, 1)
    rcl(MAIN, 0x10, 1)
    system.publish(MAIN, 0x10, 1, rmw=1)
    system.publisher(MAIN, 0x30, "/a", gid=gid(101, 2))
    rmw(MAIN, 2, 2)
    rcl(MAIN, 0x20, 2)
    rmw(other, 2, 1)
    rcl(other, 0x20, 1)
    system.publish(MAIN, 0x20, 1, rmw=2)
    assert analyse(system).rows(MIXED) == [(100, False), (200, False)]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("lost", "is_mixed"),
    [("before", True), ("between", False), ("behind", True), ("elsewhere", True)],
)
def test_a_publisher_used_behind_a_gap_may_be_of_a_later_process(
    system: RosSystem, analyse: Analyse, lost: str, is_mixed: bool
) -> None:
    system.node(MAIN, 1, "a")
    system.wait(100)
    made = system.publisher(MAIN, 0x10, "/a", gid=gid(1, 1)) - STEP_NS
    system.wait(100)
    system.subscription(MAIN, 0x30, "/b", gid=gid(2, 1))
    used = system.publish(MAIN, 0x10, 1, layers="rcl")
    system.wait(100)
    end = system.publish(MAIN, 0x10, 2)
    system.add_source(1, "beta", "boot-b")
    between = (made + 20, made + 50)
    gaps = {"before": (made - 50, made), "between": between, "behind": (used, used + 50)}
    lose(system, 0, gaps.get(lost, (end, end + 1)), (end + 1, end + 5))
    lose(system, 1, between)
    assert analyse(system).rows(MIXED) == [(100, is_mixed)]
