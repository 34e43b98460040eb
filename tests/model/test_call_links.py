"""What threads send after they took a request or response, in no callback."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import thorough

CLIENT = Thread(100)
SERVER = Thread(200, trace=1)
# What was sent, what had been taken, and whether that is certain.
LINKS = (
    "SELECT coalesce(b.source_timestamp_ns, q.sent_ns, r.sent_ns), "
    "coalesce(tq.taken_ns, tr.taken_ns), l.taken_request_id IS NULL, l.candidate_count "
    "FROM link_call AS l LEFT JOIN publication AS b ON l.publication_id = b.publication_id "
    "LEFT JOIN request AS q ON l.request_id = q.request_id "
    "LEFT JOIN response AS r ON l.response_id = r.response_id "
    "LEFT JOIN request AS tq ON l.taken_request_id = tq.request_id "
    "LEFT JOIN response AS tr ON l.taken_response_id = tr.response_id ORDER BY ALL"
)


@pytest.fixture
def calls(system: RosSystem) -> RosSystem:
    """A client and a service on two hosts, each of which publishes and calls on."""
    system.add_source(1, "beta", "other boot")
    system.node(CLIENT, 0x1, "asking")
    system.client(CLIENT, 0x10, "/add", gid=7, node=0x1)
    system.publisher(CLIENT, 0x11, "/result", node=0x1)
    system.client(CLIENT, 0x12, "/next", gid=8, node=0x1)
    system.node(SERVER, 0x2, "adding")
    system.service(SERVER, 0x20, "/add", callback=0xC1, node=0x2)
    system.publisher(SERVER, 0x21, "/status", node=0x2)
    system.client(SERVER, 0x22, "/other", gid=9, node=0x2)
    system.ready(CLIENT)
    system.ready(SERVER)
    return system


def respond(system: RosSystem, number: int = 1) -> int:
    """The client takes a response."""
    return system.take_response(CLIENT, 0x10, number, stamp=number)


def test_until_the_executor_goes_on(calls: RosSystem, analyse: Analyse) -> None:
    taken = respond(calls)
    calls.publish(CLIENT, 0x11, 1)
    requested = calls.send_request(CLIENT, 0x12, 1)
    calls.publish(CLIENT, 0x11, 2)
    calls.ready(CLIENT)
    calls.publish(CLIENT, 0x11 + 1, 3)
    again = respond(calls, 2)
    calls.publish(CLIENT, 0x11, 4)
    calls.publish(Thread(100, 101), 0x11, 5)
    calls.idle(CLIENT)
    calls.send_request(CLIENT, 0x10, 3)
    assert analyse(calls).rows(LINKS) == [
        (1, taken, True, 1),
        (2, taken, True, 1),
        (4, again, True, 1),
        (requested, taken, True, 1),
    ]


@pytest.mark.thorough
def test_until_anything_else_is_taken_or_called(calls: RosSystem, analyse: Analyse) -> None:
    """And what is published in a callback has that as its cause."""
    calls.subscription(CLIENT, 0x30, "/a")
    calls.timer(CLIENT, 0x31, callback=0xC3)
    respond(calls, 1)
    calls.take(CLIENT, 0x30, 11, layers="rmw rcl")
    calls.publish(CLIENT, 0x11, 1)
    calls.ready(CLIENT)
    respond(calls, 2)
    calls.start(CLIENT, 0xC3)
    calls.publish(CLIENT, 0x11, 2)
    calls.end(CLIENT, 0xC3)
    calls.publish(CLIENT, 0x11, 3)
    calls.ready(CLIENT)
    calls.start(CLIENT, 0xC3)
    respond(calls, 4)
    calls.publish(CLIENT, 0x11, 4)
    calls.send_request(CLIENT, 0x12, 1)
    calls.end(CLIENT, 0xC3)
    calls.publish(CLIENT, 0x11, 5)
    analysis = analyse(calls)
    assert analysis.rows(LINKS) == []
    assert analysis.rows("SELECT count(*) FROM link_causal WHERE kind = 'direct'") == [(2,)]


def test_in_a_callback_of_another_node_that_spins(calls: RosSystem, analyse: Analyse) -> None:
    """What the node of the callback publishes afterwards, or without a response, is its own."""
    calls.node(CLIENT, 0x3, "spinning")
    calls.timer(CLIENT, 0x31, callback=0xC3, node=0x3)
    calls.publisher(CLIENT, 0x41, "/afterwards", node=0x3)
    calls.start(CLIENT, 0xC3)
    calls.publish(CLIENT, 0x11, 1)
    calls.ready(CLIENT)
    taken = respond(calls)
    calls.publish(CLIENT, 0x11, 2)
    calls.publish(CLIENT, 0x41, 3)
    calls.ready(CLIENT)
    calls.publish(CLIENT, 0x11, 4)
    calls.end(CLIENT, 0xC3)
    analysis = analyse(calls)
    assert analysis.rows(LINKS) == [(2, taken, True, 1)]
    assert analysis.rows(
        "SELECT b.source_timestamp_ns FROM link_causal "
        "JOIN publication AS b USING (publication_id) "
        "ORDER BY ALL"
    ) == [(1,), (3,), (4,)]


def test_not_across_a_gap(calls: RosSystem, analyse: Analyse) -> None:
    respond(calls)
    calls.lose()
    calls.publish(CLIENT, 0x11, 1)
    assert analyse(calls).rows(LINKS) == []


@pytest.mark.thorough
def test_not_where_a_gap_hides_what_was_taken_last(calls: RosSystem, analyse: Analyse) -> None:
    """It ends behind the take, and another one lies in it."""
    respond(calls, 1)
    taken = respond(calls, 2)
    published = calls.publish(CLIENT, 0x11, 1)
    calls.add_packet(0, taken + 5, last_event=taken - 90, discarded=3, cpu=1)
    calls.add_packet(0, taken - 50, last_event=taken - 60, discarded=3, cpu=2)
    assert taken + 5 < published
    assert analyse(calls).rows(LINKS) == []


@pytest.mark.parametrize(
    ("from_taken", "until_taken", "count"),
    [(-50, 0, 1), (-50, 1, 0), thorough(0, 0, 0), thorough(0, 5, 0)],
)
def test_a_gap_that_touches_the_take(
    calls: RosSystem, analyse: Analyse, from_taken: int, until_taken: int, count: int
) -> None:
    """Behind it, or before: from the last event of a packet to its end."""
    taken = respond(calls)
    calls.publish(CLIENT, 0x11, 1)
    calls.ready(CLIENT)
    calls.add_packet(0, taken + until_taken, last_event=taken + from_taken, discarded=3, cpu=1)
    assert len(analyse(calls).rows(LINKS)) == count


@pytest.mark.thorough
def test_a_gap_behind_what_was_sent(calls: RosSystem, analyse: Analyse) -> None:
    taken = respond(calls)
    requested = calls.send_request(CLIENT, 0x12, 1)
    calls.ready(CLIENT)
    calls.add_packet(0, requested + 5, last_event=requested, discarded=3, cpu=1)
    assert analyse(calls).rows(LINKS) == [(requested, taken, True, 1)]


def test_gaps_of_other_hosts_hide_nothing(calls: RosSystem, analyse: Analyse) -> None:
    calls.ready(SERVER)
    taken = respond(calls)
    calls.lose(trace=1)
    calls.publish(CLIENT, 0x11, 1)
    calls.ready(SERVER)
    assert analyse(calls).rows(LINKS) == [(1, taken, True, 1)]


@pytest.mark.thorough
def test_gaps_of_the_kernel_trace_hide_nothing(calls: RosSystem, analyse: Analyse) -> None:
    respond(calls)
    calls.lose()
    calls.publish(CLIENT, 0x11, 1)
    connection = analyse(calls).connection
    count = "SELECT count(*) FROM derive.link_call(1)"
    assert connection.execute(count).fetchall() == [(0,)]
    connection.execute("UPDATE store.trace SET domain = 'kernel'")
    assert connection.execute(count).fetchall() == [(1,)]


def test_each_thread_has_turns_of_its_own(calls: RosSystem, analyse: Analyse) -> None:
    """What another one sends by itself makes nothing doubtful."""
    other = Thread(100, 101)
    calls.ready(other)
    first = calls.take_response(other, 0x10, 1, stamp=1)
    calls.publish(other, 0x11, 1)
    calls.ready(other)
    second = respond(calls, 2)
    calls.publish(other, 0x11, 2)
    calls.publish(CLIENT, 0x11, 3)
    assert analyse(calls).rows(LINKS) == [(1, first, True, 2), (3, second, True, 1)]


@pytest.mark.thorough
def test_no_turns_without_an_executor(calls: RosSystem, analyse: Analyse) -> None:
    """In rclpy a timer may have published."""
    python = Thread(300, None, "python3")
    calls.client(python, 0x40, "/add", gid=10)
    calls.publisher(python, 0x41, "/result")
    calls.take_response(python, 0x40, 1, stamp=1)
    calls.publish(python, 0x41, 1, layers="rcl rmw")
    assert analyse(calls).rows(LINKS) == []


def test_another_process_may_have_sent_it(calls: RosSystem, analyse: Analyse) -> None:
    """One with the same ids: the thread is on two CPUs at one moment."""
    calls.ready(Thread(100, cpu=1))
    calls.ready(CLIENT)
    taken = respond(calls)
    calls.publish(CLIENT, 0x11, 1)
    assert analyse(calls).rows(LINKS) == [(1, taken, True, 2)]


@pytest.mark.thorough
def test_what_is_also_sent_otherwise_is_doubtful(calls: RosSystem, analyse: Analyse) -> None:
    """A loop that spins once and then publishes; what it published before it spun tells nothing."""
    calls.publish(CLIENT, 0x11, 1)
    taken = respond(calls)
    calls.publish(CLIENT, 0x11, 2)
    requested = calls.send_request(CLIENT, 0x12, 1)
    calls.ready(CLIENT)
    calls.send_request(CLIENT, 0x12, 2)
    calls.send_request(CLIENT, 0x12, 3)
    assert analyse(calls).rows(LINKS) == [(2, taken, True, 2), (requested, taken, True, 2)]


@pytest.mark.thorough
def test_what_was_sent_before_spinning_tells_nothing(system: RosSystem, analyse: Analyse) -> None:
    system.client(CLIENT, 0x10, "/add", gid=7)
    system.publisher(CLIENT, 0x11, "/result")
    system.publish(CLIENT, 0x11, 1)
    system.ready(CLIENT)
    taken = respond(system)
    system.publish(CLIENT, 0x11, 2)
    assert analyse(system).rows(LINKS) == [(2, taken, True, 1)]


@pytest.mark.thorough
def test_behind_a_gap_nothing_is_sent_otherwise(calls: RosSystem, analyse: Analyse) -> None:
    """What was taken before it may be lost."""
    calls.lose()
    calls.publish(CLIENT, 0x11, 1)
    calls.ready(CLIENT)
    taken = respond(calls)
    calls.publish(CLIENT, 0x11, 2)
    assert analyse(calls).rows(LINKS) == [(2, taken, True, 1)]


def test_a_request_without_callback(calls: RosSystem, analyse: Analyse) -> None:
    """An action server. That a request leads to its response is no such link."""
    taken = calls.take_request(SERVER, 0x20, 1, gid=7)
    calls.publish(SERVER, 0x21, 1)
    requested = calls.send_request(SERVER, 0x22, 1)
    calls.send_response(SERVER, 0x20, 1, gid=7, stamp=1)
    calls.publish(SERVER, 0x21, 2)
    calls.ready(SERVER)
    second = calls.take_request(SERVER, 0x20, 2, gid=7)
    late = calls.send_response(SERVER, 0x20, 1, gid=7, stamp=2)
    analysis = analyse(calls)
    assert analysis.rows(LINKS) == [
        (1, taken, False, 1),
        (2, taken, False, 1),
        (requested, taken, False, 1),
        (late, second, False, 1),
    ]
    assert analysis.rows(
        "SELECT from_kind, to_kind, count(*) FROM flow_edge WHERE link_kind = 'take_adjacent' "
        "GROUP BY ALL ORDER BY ALL"
    ) == [
        ("request", "publication", 2),
        ("request", "request", 1),
        ("request", "response", 1),
    ]


def test_a_response_that_a_loop_sends(calls: RosSystem, analyse: Analyse) -> None:
    """An executor event lies between: nothing was taken that it follows from."""
    calls.take_request(SERVER, 0x20, 1, gid=7)
    calls.ready(SERVER)
    calls.send_response(SERVER, 0x20, 1, gid=7, stamp=1)
    assert analyse(calls).rows(LINKS) == []


def test_a_request_with_a_callback(calls: RosSystem, analyse: Analyse) -> None:
    """Its callback tells what it led to; a response sent inside of it follows from it alone."""
    calls.service(SERVER, 0x23, "/sum", callback=0xC2)
    calls.take_request(SERVER, 0x23, 1, gid=7)
    calls.start(SERVER, 0xC2)
    calls.take_response(SERVER, 0x22, 1, stamp=1)
    calls.send_response(SERVER, 0x23, 1, gid=7, stamp=2)
    calls.end(SERVER, 0xC2)
    calls.publish(SERVER, 0x21, 1)
    assert analyse(calls).rows(LINKS) == []


@pytest.mark.thorough
def test_a_response_that_waited_for_another(calls: RosSystem, analyse: Analyse) -> None:
    """It is sent in no callback, though one began with its request: before, and on a thread."""
    calls.service(SERVER, 0x23, "/sum", callback=0xC2)
    calls.take_request(SERVER, 0x23, 1, gid=7)
    calls.start(SERVER, 0xC2)
    calls.end(SERVER, 0xC2)
    calls.ready(SERVER)
    first = calls.take_response(SERVER, 0x22, 1, stamp=1)
    sent = calls.send_response(SERVER, 0x23, 1, gid=7, stamp=2)
    calls.ready(SERVER)
    other = Thread(200, 201, trace=1)
    calls.take_request(other, 0x23, 2, gid=7)
    calls.start(other, 0xC2)
    second = calls.take_response(SERVER, 0x22, 2, stamp=3)
    sent_meanwhile = calls.send_response(SERVER, 0x23, 2, gid=7, stamp=4)
    calls.end(other, 0xC2)
    assert analyse(calls).rows(LINKS) == [
        (sent, first, True, 1),
        (sent_meanwhile, second, True, 1),
    ]


@pytest.mark.thorough
def test_flows_and_paths_go_on_from_a_response(system: RosSystem, analyse: Analyse) -> None:
    """A timer calls, the response leads to another call, and the response to that to a message."""
    system.node(CLIENT, 0x1, "asking")
    system.timer(CLIENT, 0x31, callback=0xC3, node=0x1)
    system.client(CLIENT, 0x10, "/add", gid=7, node=0x1)
    system.client(CLIENT, 0x12, "/next", gid=8, node=0x1)
    system.publisher(CLIENT, 0x11, "/result", node=0x1)
    server, sink = Thread(200), Thread(300)
    system.node(server, 0x2, "adding")
    system.service(server, 0x20, "/add", callback=0xC1, node=0x2)
    system.service(server, 0x24, "/next", callback=0xC2, node=0x2)
    system.node(sink, 0x3, "sink")
    system.subscription(sink, 0x50, "/result", callback=0xC5, node=0x3)
    for thread in (CLIENT, server, sink):
        system.ready(thread)
    begun = system.start(CLIENT, 0xC3)
    system.send_request(CLIENT, 0x10, 1)
    system.end(CLIENT, 0xC3)
    system.take_request(server, 0x20, 1, gid=7)
    system.start(server, 0xC1)
    system.end(server, 0xC1)
    system.send_response(server, 0x20, 1, gid=7, stamp=1)
    system.ready(CLIENT)
    system.take_response(CLIENT, 0x10, 1, stamp=1)
    system.send_request(CLIENT, 0x12, 1)
    system.ready(server)
    system.take_request(server, 0x24, 1, gid=8)
    system.send_response(server, 0x24, 1, gid=8, stamp=2)
    system.ready(CLIENT)
    system.take_response(CLIENT, 0x12, 1, stamp=2)
    system.publish(CLIENT, 0x11, 3)
    system.ready(CLIENT)
    system.take(sink, 0x50, 3)
    system.start(sink, 0xC5)
    ended = system.end(sink, 0xC5)
    analysis = analyse(system)
    assert analysis.rows("SELECT path FROM flow_path([1]) WHERE is_path") == [
        ("/asking → (/add) → /adding → (/next) → /adding → /asking → /result → /sink",)
    ]
    assert analysis.rows("SELECT root_kind, latency_ns FROM end_to_end_flow([1])") == [
        ("callback_instance", ended - begun)
    ]
    assert [
        part
        for (part,) in analysis.rows("SELECT part FROM end_to_end_part([1]) ORDER BY position")
        if part not in {"rclcpp", "rcl", "rmw", "intra", "dds"}
    ] == [
        "callback",
        "request_to_take",
        "take_to_callback",
        "service",
        "response_to_take",
        "callback",
        "request_to_take",
        "service",
        "response_to_take",
        "callback",
        "publish_to_take",
        "take_to_callback",
        "callback",
    ]
    assert analysis.rows("SELECT sum(duration_ns) FROM end_to_end_part([1])") == [(ended - begun,)]


@pytest.mark.thorough
def test_a_path_through_a_service_that_is_not_traced(system: RosSystem, analyse: Analyse) -> None:
    """A message leads to a call of which only the client shows."""
    source, sink = Thread(50), Thread(300)
    system.publisher(source, 0x5, "/a")
    system.node(CLIENT, 0x1, "asking")
    system.subscription(CLIENT, 0x6, "/a", callback=0xC6, node=0x1)
    system.client(CLIENT, 0x10, "/add", gid=7, node=0x1)
    system.publisher(CLIENT, 0x11, "/result", node=0x1)
    system.node(sink, 0x3, "sink")
    system.subscription(sink, 0x50, "/result", callback=0xC5, node=0x3)
    system.publish(source, 0x5, 1)
    system.take(CLIENT, 0x6, 1)
    system.start(CLIENT, 0xC6)
    system.send_request(CLIENT, 0x10, 1)
    system.end(CLIENT, 0xC6)
    system.ready(CLIENT)
    system.take_response(CLIENT, 0x10, 1, stamp=1)
    system.publish(CLIENT, 0x11, 3)
    system.take(sink, 0x50, 3)
    analysis = analyse(system)
    assert analysis.rows("SELECT path FROM flow_path([1]) WHERE is_path") == [
        ("[main 50] → /a → /asking → (?) → ? → /asking → /result → /sink",)
    ]
    parts = analysis.rows("SELECT part, duration_ns FROM end_to_end_part([1]) ORDER BY position")
    assert [part for part, _ in parts if part in {"request_to_take", "service", "callback"}] == [
        "callback",
        "service",
        "callback",
    ]


@pytest.mark.parametrize(
    ("service", "count"), [("/a/_action/cancel_goal", 1), ("/a/_action/get_result", 0)]
)
def test_a_question_for_a_result_waits_for_it(
    system: RosSystem, analyse: Analyse, service: str, count: int
) -> None:
    """What rclpy sends before the answer is due to other requests, but not to that one."""
    python = Thread(300)
    system.node(python, 0x3, "acting")
    system.service(python, 0x40, service, callback=None, node=0x3)
    system.publisher(python, 0x41, "/progress", node=0x3)
    system.take_request(python, 0x40, 1, gid=7)
    system.publish(python, 0x41, 1, layers="rcl rmw")
    system.send_response(python, 0x40, 1, gid=7, stamp=1)
    assert len(analyse(system).rows(LINKS)) == count
