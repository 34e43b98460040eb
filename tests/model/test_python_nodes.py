"""Python nodes whose callbacks are traced (`msgflow record`): what goes on later, and for what."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(200)
POOL = Thread(200, 201)
OTHER = Thread(200, 202)
# What was published, the message that it follows from, and how many others it may follow from.
CAUSES = (
    "SELECT b.source_timestamp_ns, t.source_timestamp_ns, l.kind, l.candidate_count "
    "FROM link_causal AS l JOIN publication AS b USING (publication_id) "
    "LEFT JOIN take AS t ON l.take_id = t.take_id ORDER BY b.publication_id"
)


@pytest.fixture
def python(system: RosSystem) -> RosSystem:
    """A node that hears /a and /b, and publishes /c."""
    system.node(MAIN, 0x1, "python")
    system.python(MAIN, 0, "python 3.12.3")
    system.python(MAIN, 0xE, "executor multi_threaded")
    system.publisher(MAIN, 0x10, "/c", node=0x1)
    system.subscription(MAIN, 0x20, "/a", callback=0xCA, node=0x1)
    system.subscription(MAIN, 0x21, "/b", callback=0xCB, node=0x1)
    return system


def hear(system: RosSystem, handle: int, callback: int, stamp: int, thread: Thread = MAIN) -> None:
    system.ready(thread)
    system.execute(thread, handle)
    system.take(thread, handle, stamp, layers="rmw rcl")
    system.start(thread, callback)


def job(system: RosSystem, number: int, callback: int, stamp: int, thread: Thread = OTHER) -> None:
    system.python(thread, number, "job")
    system.start(thread, callback)
    system.publish(thread, 0x10, stamp, layers="rcl rmw")
    system.end(thread, callback)


def resume(system: RosSystem, number: int, callback: int, thread: Thread = MAIN) -> None:
    system.ready(thread)
    system.python(thread, number, "resume")
    system.start(thread, callback)


def test_later_steps_follow_from_the_first(python: RosSystem, analyse: Analyse) -> None:
    """Two coroutines of one callback, another callback in between, on any thread."""
    python.python(MAIN, 5, "function node:heard (goes on)")
    for number, stamp in ((1, 11), (2, 12)):
        hear(python, 0x20, 0xCA, stamp)
        python.python(MAIN, number, "step")
        python.end(MAIN, 0xCA)
    hear(python, 0x21, 0xCB, 21)
    python.publish(MAIN, 0x10, 1, layers="rcl rmw")
    python.end(MAIN, 0xCB)
    resume(python, 2, 5, POOL)
    python.publish(POOL, 0x10, 2, layers="rcl rmw")
    python.end(POOL, 5)
    resume(python, 1, 5)
    python.publish(MAIN, 0x10, 3, layers="rcl rmw")
    python.end(MAIN, 5)
    resume(python, 1, 5)
    python.publish(MAIN, 0x10, 4, layers="rcl rmw")
    python.end(MAIN, 5)
    analysis = analyse(python)
    assert analysis.rows(CAUSES) == [
        (1, 21, "direct", 1),
        (2, 12, "direct", 1),
        (3, 11, "direct", 1),
        (4, 11, "direct", 1),
    ]
    # A step is no call of the subscription.
    assert analysis.rows(
        "SELECT node, label, kind, count(*) FROM callback_instance "
        "JOIN callback USING (callback_id) JOIN callback_label USING (callback_id) "
        "GROUP BY ALL ORDER BY label"
    ) == [
        ("/python", "Subscription(/a)", "subscription", 2),
        ("/python", "Subscription(/b)", "subscription", 1),
        ("/python", "heard (goes on)", "function", 3),
    ]
    assert analysis.rows("SELECT python_version FROM process") == [("3.12.3",)]


def test_a_step_that_nothing_announced_follows_from_nothing(
    python: RosSystem, analyse: Analyse
) -> None:
    """As where the session began in between; a number may have been another's before."""
    hear(python, 0x20, 0xCA, 11)
    python.end(MAIN, 0xCA)
    resume(python, 1, 0xCA)
    python.publish(MAIN, 0x10, 1, layers="rcl rmw")
    python.end(MAIN, 0xCA)
    python.python(MAIN, 1, "step")
    assert analyse(python).rows(CAUSES) == [(1, None, "direct", 1)]


@pytest.fixture
def calls(python: RosSystem) -> RosSystem:
    """It also calls a service, and has one."""
    python.client(MAIN, 0x30, "/add", gid=7, node=0x1)
    python.service(MAIN, 0x40, "/goal", callback=0xC9, node=0x1)
    python.python(MAIN, 6, "function node:answered")
    return python


def test_jobs_of_what_is_done_with_a_response(calls: RosSystem, analyse: Analyse) -> None:
    calls.ready(MAIN)
    taken = calls.take_response(MAIN, 0x30, 1, stamp=1)
    calls.python(MAIN, 1, "step")
    resume(calls, 1, 6)
    calls.python(MAIN, 2, "step")
    calls.end(MAIN, 6)
    job(calls, 2, 5, 1)
    analysis = analyse(calls)
    assert analysis.rows(
        "SELECT b.source_timestamp_ns, r.taken_ns, l.candidate_count FROM link_call AS l "
        "JOIN publication AS b USING (publication_id) "
        "JOIN response AS r ON l.taken_response_id = r.response_id"
    ) == [(1, taken, 1)]
    assert analysis.rows(CAUSES) == []


def test_what_is_done_with_a_response(calls: RosSystem, analyse: Analyse) -> None:
    """In tasks of their own, in any order: each knows its response."""
    taken = []
    for number in (1, 2):
        calls.ready(MAIN)
        taken.append(calls.take_response(MAIN, 0x30, number, stamp=number))
        calls.python(MAIN, number, "step")
    for number in (2, 1):
        resume(calls, number, 6)
        calls.publish(MAIN, 0x10, number, layers="rcl rmw")
        sent = calls.send_request(MAIN, 0x30, 10 + number)
        calls.end(MAIN, 6)
    analysis = analyse(calls)
    links = analysis.rows(
        "SELECT b.source_timestamp_ns, q.sent_ns, r.taken_ns, l.candidate_count "
        "FROM link_call AS l "
        "LEFT JOIN publication AS b USING (publication_id) LEFT JOIN request AS q "
        "ON l.request_id = q.request_id JOIN response AS r ON l.taken_response_id = r.response_id"
    )
    assert sorted((row[0], row[2], row[3]) for row in links if row[0]) == [
        (1, taken[0], 1),
        (2, taken[1], 1),
    ]
    assert (None, sent, taken[0], 1) in links
    assert len(links) == 4
    assert analysis.rows(CAUSES) == []


def test_what_is_not_done_in_the_turn_of_a_response(calls: RosSystem, analyse: Analyse) -> None:
    calls.take_response(MAIN, 0x30, 1, stamp=1)
    calls.ready(MAIN)
    calls.python(MAIN, 1, "step")
    resume(calls, 1, 6)
    calls.publish(MAIN, 0x10, 1, layers="rcl rmw")
    calls.end(MAIN, 6)
    analysis = analyse(calls)
    assert analysis.rows("FROM link_call") == []
    assert analysis.rows(CAUSES) == [(1, None, "direct", 1)]


def test_tasks_for_a_request(calls: RosSystem, analyse: Analyse) -> None:
    """As an action executes its goal: the first is the callback of the request, others go on."""
    calls.ready(MAIN)
    taken = calls.take_request(MAIN, 0x40, 1, gid=7)
    calls.python(MAIN, 1, "step")
    calls.python(MAIN, 2, "step")
    for number in (1, 2):
        resume(calls, number, 6, POOL)
        calls.publish(POOL, 0x10, number, layers="rcl rmw")
        calls.end(POOL, 6)
    analysis = analyse(calls)
    assert analysis.rows(
        "SELECT q.taken_ns, count(*) FROM link_causal JOIN callback_instance AS i "
        "USING (callback_instance_id) JOIN request AS q ON i.request_id = q.request_id GROUP BY ALL"
    ) == [(taken, 2)]


def test_threads_of_a_pool_are_of_one_executor(python: RosSystem, analyse: Analyse) -> None:
    """All of them wait at once, and one runs no callback."""
    for thread, handle, callback in ((POOL, 0x20, 0xCA), (OTHER, 0x21, 0xCB)):
        python.python(thread, 0xE, "executor multi_threaded")
        hear(python, handle, callback, callback, thread)
        python.end(thread, callback)
        python.idle(thread)
    python.idle(MAIN)
    rows = analyse(python).rows(
        "SELECT e.kind, e.is_inferred, count(*) FROM executor AS e "
        "JOIN executor_thread USING (executor_id) GROUP BY ALL"
    )
    assert rows == [("multi_threaded", False, 3)]


def test_no_message_causes_what_no_callback_published(python: RosSystem, analyse: Analyse) -> None:
    hear(python, 0x20, 0xCA, 11)
    python.end(MAIN, 0xCA)
    python.take(MAIN, 0x21, 21, layers="rmw rcl")
    python.publish(MAIN, 0x10, 1, layers="rcl rmw")
    assert analyse(python).rows(CAUSES) == []


def test_jobs_on_threads_follow_from_the_callback(python: RosSystem, analyse: Analyse) -> None:
    """Out of order, as pools work. Their threads are of no executor, although both ran the job."""
    python.python(MAIN, 5, "function node:work")
    for number, stamp in ((1, 11), (2, 12)):
        hear(python, 0x20, 0xCA, stamp)
        python.python(MAIN, number, "step")
        python.end(MAIN, 0xCA)
    job(python, 2, 5, 1)
    job(python, 1, 5, 2)
    job(python, 3, 5, 3, POOL)
    python.idle(MAIN)
    analysis = analyse(python)
    assert analysis.rows(CAUSES) == [
        (1, 12, "direct", 1),
        (2, 11, "direct", 1),
        (3, None, "direct", 1),
    ]
    assert analysis.rows("SELECT count(*) FROM executor_thread") == [(1,)]


@pytest.mark.parametrize("then", ["at once", "told", "another's", "led on"])
def test_a_job_that_publishes_again(python: RosSystem, analyse: Analyse, then: str) -> None:
    """It may use what its node was told since: the first publication, too."""
    python.node(MAIN, 0x2, "beside")
    python.subscription(MAIN, 0x22, "/a", callback=0xCC, node=0x2)
    python.python(MAIN, 5, "function node:work")
    hear(python, 0x20, 0xCA, 11)
    python.python(MAIN, 1, "step")
    python.end(MAIN, 0xCA)

    def told(stamp: int, handle: int = 0x21, callback: int = 0xCB) -> None:
        hear(python, handle, callback, stamp)
        python.end(MAIN, callback)

    told(21)
    python.python(OTHER, 1, "job")
    python.start(OTHER, 5)
    python.publish(OTHER, 0x10, 1, layers="rcl rmw")
    if then == "told":
        told(22)
    elif then == "another's":
        told(12, 0x22, 0xCC)
    elif then == "led on":
        hear(python, 0x21, 0xCB, 22)
        python.publish(MAIN, 0x10, 9, layers="rcl rmw")
        python.end(MAIN, 0xCB)
    python.publish(OTHER, 0x10, 2, layers="rcl rmw")
    python.end(OTHER, 5)
    python.idle(MAIN)
    candidates = 1 + (then == "told")
    rows = [row for row in analyse(python).rows(CAUSES) if row[0] != 9]
    assert rows == [(1, 11, "direct", candidates), (2, 11, "direct", candidates)]


def test_timers_that_jobs_start_again(python: RosSystem, analyse: Analyse) -> None:
    """Each is a job of its own. The first one ran before the node was told anything else."""
    python.python(MAIN, 5, "function node:work")
    hear(python, 0x20, 0xCA, 11)
    python.python(MAIN, 1, "step")
    python.end(MAIN, 0xCA)
    job(python, 1, 5, 1)
    hear(python, 0x20, 0xCA, 12)
    python.end(MAIN, 0xCA)
    job(python, 1, 5, 2, POOL)
    python.idle(MAIN)
    assert analyse(python).rows(CAUSES) == [(1, 11, "direct", 1), (2, 11, "direct", 2)]


@pytest.mark.parametrize("is_pool", [True, False])
def test_jobs_side_by_side_are_each_of_their_own(
    python: RosSystem, analyse: Analyse, is_pool: bool
) -> None:
    """A callback starts both, and each publishes once. What its node keeps is no cause."""
    python.python(MAIN, 5, "function node:work")
    expected = []
    for stamp in (11, 13, 15, 17):
        hear(python, 0x20, 0xCA, stamp)
        for number in (stamp, stamp + 1):
            python.python(MAIN, number, "step")
        python.end(MAIN, 0xCA)
        for number in (stamp, stamp + 1):
            hear(python, 0x21, 0xCB, 100 + number)
            python.end(MAIN, 0xCB)
            job(python, number, 5, number, POOL if is_pool and number % 2 else OTHER)
            expected.append((number, stamp, "direct", 1))
    python.idle(MAIN)
    analysis = analyse(python)
    assert analysis.rows(CAUSES) == expected
    # Their publications are not outside of callbacks.
    assert analysis.rows("SELECT topic_name, cause FROM dead_end([1])") == [("/b", "from /a")]


def test_jobs_of_a_later_step_follow_from_the_first(python: RosSystem, analyse: Analyse) -> None:
    python.python(MAIN, 5, "function node:heard (goes on)")
    hear(python, 0x20, 0xCA, 11)
    python.python(MAIN, 1, "step")
    python.end(MAIN, 0xCA)
    resume(python, 1, 5)
    for number in (2, 3):
        python.python(MAIN, number, "step")
    python.end(MAIN, 5)
    for number in (2, 3):
        hear(python, 0x21, 0xCB, 20 + number)
        python.end(MAIN, 0xCB)
        job(python, number, 6, number)
    python.idle(MAIN)
    assert analyse(python).rows(CAUSES) == [(2, 11, "direct", 1), (3, 11, "direct", 1)]


@pytest.fixture
def goals(python: RosSystem) -> RosSystem:
    """It also sends goals, and function 7 gets the feedback."""
    python.client(MAIN, 0x30, "/dock/_action/send_goal", gid=7, node=0x1)
    python.subscription(MAIN, 0x31, "/dock/_action/feedback", node=0x1)
    python.subscription(MAIN, 0x32, "/dock/_action/status", node=0x1)
    python.python(MAIN, 7, "function node:fed")
    return python


@pytest.mark.parametrize("is_cut", [False, True])
@pytest.mark.parametrize(("taken", "cause"), [("F", 31), ("FS", 31), ("S", None)])
def test_feedback_with_the_states_of_goals(
    goals: RosSystem, analyse: Analyse, taken: str, cause: int | None, is_cut: bool
) -> None:
    """Taken at once: only feedback has a callback. The tracer may say that the turn was over."""
    goals.ready(MAIN)
    for one in taken:
        goals.take(MAIN, 0x31 if one == "F" else 0x32, 31, layers="rmw rcl")
    if is_cut and taken.endswith("S"):
        goals.ready(MAIN)
    goals.start(MAIN, 7)
    goals.publish(MAIN, 0x10, 1, layers="rcl rmw")
    goals.end(MAIN, 7)
    analysis = analyse(goals)
    assert analysis.rows(CAUSES) == [(1, cause, "direct", 1)]
    if cause:
        assert analysis.rows(
            "SELECT topic_name FROM take JOIN callback_instance USING (take_id) "
            "JOIN subscription USING (subscription_id)"
        ) == [("/dock/_action/feedback",)]


def test_a_task_is_not_for_feedback(goals: RosSystem, analyse: Analyse) -> None:
    hear(goals, 0x20, 0xCA, 11)
    goals.python(MAIN, 1, "step")
    goals.end(MAIN, 0xCA)
    goals.ready(MAIN)
    goals.take(MAIN, 0x31, 31, layers="rmw rcl")
    goals.take(MAIN, 0x32, 32, layers="rmw rcl")
    resume(goals, 1, 7)
    goals.publish(MAIN, 0x10, 1, layers="rcl rmw")
    goals.end(MAIN, 7)
    assert analyse(goals).rows(CAUSES) == [(1, 11, "direct", 1)]


def test_an_open_coroutine_takes_nothing(goals: RosSystem, analyse: Analyse) -> None:
    """While it awaits, its thread takes for others; one of its steps may take, on any thread."""
    goals.subscription(MAIN, 0x22, "/polled", node=0x1)
    goals.python(MAIN, 5, "function node:heard (goes on)")
    hear(goals, 0x20, 0xCA, 11)
    goals.python(MAIN, 1, "step")
    goals.end(MAIN, 0xCA)
    for handle, stamp in ((0x22, 21), (0x31, 31), (0x32, 32)):
        goals.ready(MAIN)
        goals.take(MAIN, handle, stamp, layers="rmw rcl")
    resume(goals, 1, 5, POOL)
    goals.publish(POOL, 0x10, 1, layers="rcl rmw")
    goals.take(POOL, 0x31, 33, layers="rmw rcl")
    goals.take(POOL, 0x32, 34, layers="rmw rcl")
    goals.take(POOL, 0x22, 22, layers="rmw rcl")
    goals.publish(POOL, 0x10, 2, layers="rcl rmw")
    goals.end(POOL, 5)
    resume(goals, 1, 5)
    goals.publish(MAIN, 0x10, 3, layers="rcl rmw")
    goals.end(MAIN, 5)
    assert sorted(analyse(goals).rows(CAUSES)) == [
        (1, 11, "direct", 1),
        (2, 11, "direct", 1),
        (2, 22, "polled", 1),
        (3, 11, "direct", 1),
        (3, 22, "polled", 1),
    ]
