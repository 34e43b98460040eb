"""Requests and responses: both ends, the service callback between, and what sent them."""

from __future__ import annotations

import pytest
from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import thorough

CLIENT = Thread(100)
SERVER = Thread(200, trace=1)
REQUESTS = (
    "SELECT q.sequence_number, q.sent_ns, q.taken_ns, i.start_ns FROM request AS q "
    "LEFT JOIN callback_instance AS i USING (callback_instance_id) ORDER BY q.request_id"
)
RESPONSES = (
    "SELECT r.sequence_number, q.sent_ns, r.sent_ns, r.taken_ns FROM response AS r "
    "LEFT JOIN request AS q USING (request_id) ORDER BY r.response_id"
)


def hosts(system: RosSystem) -> None:
    """A client and a service on two hosts."""
    system.add_source(1, "beta", "other boot")
    system.client(CLIENT, 0x10, "/add", gid=7)
    system.service(SERVER, 0x20, "/add", callback=0xC1)


def call(
    system: RosSystem,
    number: int,
    *,
    client: Thread = CLIENT,
    server: Thread = SERVER,
    gid: int = 7,
    stamp: int | None = None,
) -> tuple[int, int, int, int, int]:
    """Times of a whole call: request sent, taken, callback begun, response sent, taken."""
    stamp = number * 1_000 if stamp is None else stamp
    sent = system.send_request(client, 0x10, number)
    taken = system.take_request(server, 0x20, number, gid=gid)
    start = system.start(server, 0xC1)
    system.end(server, 0xC1)
    answered = system.send_response(server, 0x20, number, gid=gid, stamp=stamp)
    return (
        sent,
        taken,
        start,
        answered,
        system.take_response(client, 0x10, number, stamp=stamp),
    )


def test_both_ends_of_calls(system: RosSystem, analyse: Analyse) -> None:
    hosts(system)
    calls = [call(system, number) for number in (1, 2)]
    analysis = analyse(system)
    assert analysis.rows(REQUESTS) == [
        (n, sent, taken, start) for n, (sent, taken, start, _, _) in enumerate(calls, start=1)
    ]
    assert analysis.rows(RESPONSES) == [
        (n, sent, answered, got) for n, (sent, _, _, answered, got) in enumerate(calls, start=1)
    ]
    assert analysis.rows(
        "SELECT i.request_id, r.callback_instance_id = i.callback_instance_id, l.response_id "
        "FROM callback_instance AS i JOIN response AS r USING (request_id) "
        "JOIN link_response AS l ON i.callback_instance_id = l.callback_instance_id ORDER BY ALL"
    ) == [(1, True, 1), (2, True, 2)]
    assert analysis.rows(
        "SELECT DISTINCT c.service_name, s.service_name, q.sender_thread_id <> "
        "q.receiver_thread_id FROM request AS q JOIN client AS c USING (client_id) "
        "JOIN service AS s USING (service_id)"
    ) == [("/add", "/add", True)]


@pytest.mark.thorough
def test_the_event_of_sending_may_come_last(system: RosSystem, analyse: Analyse) -> None:
    """The middleware may know the number only after writing."""
    hosts(system)
    taken = system.take_request(SERVER, 0x20, 1, gid=7)
    sent = system.send_request(CLIENT, 0x10, 1)
    assert analyse(system).rows(REQUESTS) == [(1, sent, taken, None)]


def test_only_16_bytes_of_a_gid_count(system: RosSystem, analyse: Analyse) -> None:
    system.add_source(1, "beta", "other boot")
    system.client(CLIENT, 0x10, "/add", gid=7, length=24)
    system.service(SERVER, 0x20, "/add", callback=0xC1)
    sent = system.send_request(CLIENT, 0x10, 1)
    taken = system.take_request(SERVER, 0x20, 1, gid=7)
    assert analyse(system).rows(REQUESTS) == [(1, sent, taken, None)]


def test_attempts_that_took_nothing_are_none(system: RosSystem, analyse: Analyse) -> None:
    hosts(system)
    system.take_request(SERVER, 0x20, 0, gid=7, taken=0)
    system.take_response(CLIENT, 0x10, 0, taken=0)
    analysis = analyse(system)
    assert analysis.value("SELECT count(*) FROM request") == 0
    assert analysis.value("SELECT count(*) FROM response") == 0


def test_one_side_alone(system: RosSystem, analyse: Analyse) -> None:
    """Nothing is dropped; a client that must have sent a request is named all the same."""
    hosts(system)
    lonely = system.send_request(CLIENT, 0x10, 1)
    taken = system.take_request(SERVER, 0x20, 2, gid=7)
    stranger = system.take_request(SERVER, 0x20, 2, gid=9)
    got = system.take_response(CLIENT, 0x10, 3, stamp=5)
    analysis = analyse(system)
    assert analysis.rows(
        "SELECT client_id, service_id, sent_ns, taken_ns FROM request ORDER BY request_id"
    ) == [(1, None, lonely, None), (1, 1, None, taken), (None, 1, None, stranger)]
    assert analysis.rows(
        "SELECT client_id, service_id, request_id, sent_ns, taken_ns FROM response"
    ) == [(1, None, None, None, got)]


def test_clients_are_told_apart(system: RosSystem, analyse: Analyse) -> None:
    """Every client counts from 1."""
    other = Thread(101)
    hosts(system)
    system.client(other, 0x10, "/add", gid=8)
    first, second = (
        system.send_request(CLIENT, 0x10, 1),
        system.send_request(other, 0x10, 1),
    )
    late = system.take_request(SERVER, 0x20, 1, gid=8)
    later = system.take_request(SERVER, 0x20, 1, gid=7)
    rows = analyse(system).rows(REQUESTS)
    assert rows == [(1, first, later, None), (1, second, late, None)]


def test_a_client_that_came_again(system: RosSystem, analyse: Analyse) -> None:
    """The same GID and numbers: nothing tells which of the two requests was taken and answered."""
    hosts(system)
    lost = system.send_request(CLIENT, 0x10, 1)
    again = Thread(100, name="again")
    system.wait(1_000_000)
    system.client(again, 0x10, "/add", gid=7)
    sent, taken, start, answered, got = call(system, 1, client=again)
    analysis = analyse(system)
    assert analysis.rows(REQUESTS) == [
        (1, lost, None, None),
        (1, sent, None, None),
        (1, None, taken, start),
    ]
    assert analysis.rows(RESPONSES) == [(1, None, answered, got)]
    assert analysis.rows("SELECT count FROM store.finding WHERE name = 'ambiguous_request'") == [
        (1,)
    ]


def test_handles_that_are_used_again(system: RosSystem, analyse: Analyse) -> None:
    """Clients and services made anew at the addresses of former ones; one before tracing began."""
    system.add_source(1, "beta", "other boot")
    system.send_request(CLIENT, 0x10, 9)
    system.take_request(SERVER, 0x20, 9, gid=3)
    for number, name in enumerate(("/add", "/sub", "/add"), start=1):
        system.client(CLIENT, 0x10, name, gid=10 + number)
        system.service(SERVER, 0x20, name, callback=None)
        call(system, 1, gid=10 + number, stamp=number)
    assert analyse(system).rows(
        "SELECT q.sequence_number, c.client_id, c.service_name, s.service_id, s.service_name "
        "FROM request AS q LEFT JOIN client AS c USING (client_id) "
        "LEFT JOIN service AS s USING (service_id) ORDER BY q.request_id"
    ) == [
        (9, 1, None, None, None),
        (9, None, None, 1, None),
        (1, 2, "/add", 2, "/add"),
        (1, 3, "/sub", 3, "/sub"),
        (1, 4, "/add", 4, "/add"),
    ]


def test_what_cannot_be_told_is_not_guessed(system: RosSystem, analyse: Analyse) -> None:
    """Two equal requests were sent, one was taken."""
    hosts(system)
    sent = [system.send_request(CLIENT, 0x10, 1) for _ in range(2)]
    taken = system.take_request(SERVER, 0x20, 1, gid=7)
    analysis = analyse(system)
    assert sorted(analysis.rows(REQUESTS), key=str) == sorted(
        [(1, sent[0], None, None), (1, sent[1], None, None), (1, None, taken, None)], key=str
    )
    assert analysis.rows("SELECT count FROM store.finding WHERE name = 'ambiguous_request'") == [
        (1,)
    ]


@pytest.mark.thorough
def test_two_services_of_one_name(system: RosSystem, analyse: Analyse) -> None:
    """Both take the request and answer."""
    second = Thread(201, trace=1)
    hosts(system)
    system.service(second, 0x20, "/add", callback=0xC1)
    sent = system.send_request(CLIENT, 0x10, 1)
    taken = [
        system.take_request(SERVER, 0x20, 1, gid=7),
        system.take_request(second, 0x20, 1, gid=7),
    ]
    answered = [
        system.send_response(second, 0x20, 1, gid=7, stamp=20),
        system.send_response(SERVER, 0x20, 1, gid=7, stamp=10),
    ]
    got = [
        system.take_response(CLIENT, 0x10, 1, stamp=10),
        system.take_response(CLIENT, 0x10, 1, stamp=20),
    ]
    analysis = analyse(system)
    assert analysis.rows(REQUESTS) == [(1, sent, taken[n], None) for n in range(2)]
    assert analysis.rows(
        "SELECT r.sent_ns, r.taken_ns, q.taken_ns FROM response AS r "
        "JOIN request AS q USING (request_id) ORDER BY r.response_id"
    ) == [(answered[0], got[1], taken[1]), (answered[1], got[0], taken[0])]


def test_started_late(system: RosSystem, analyse: Analyse) -> None:
    """No initialisation was traced: responses tell who is who, names come from the other side."""
    system.add_source(1, "beta", "other boot")
    system.service(SERVER, 0x20, "/add", callback=None)
    times = [call(system, number) for number in (41, 42)]
    analysis = analyse(system)
    assert analysis.rows(REQUESTS) == [
        (n, sent, taken, start) for n, (sent, taken, start, _, _) in enumerate(times, start=41)
    ]
    assert analysis.rows("SELECT service_name, created_ns, hex(gid) FROM client") == [
        ("/add", None, "07" + "01" * 15)
    ]
    assert analysis.rows("SELECT kind, service_id FROM callback") == [("service", 1)]
    kinds = analysis.column("SELECT subject FROM store.finding WHERE name = 'inferred_object'")
    assert "clients" in kinds
    assert "services" not in kinds


def test_a_service_learns_its_name(system: RosSystem, analyse: Analyse) -> None:
    system.add_source(1, "beta", "other boot")
    system.client(CLIENT, 0x10, "/node/get_parameters", gid=7)
    call(system, 1)
    assert analyse(system).rows("SELECT service_name, is_internal, created_ns FROM service") == [
        ("/node/get_parameters", True, None)
    ]


@pytest.mark.thorough
def test_a_callback_behind_something_else_is_not_of_the_request(
    system: RosSystem, analyse: Analyse
) -> None:
    hosts(system)
    system.subscription(SERVER, 0x30, "/t", callback=0xC2)
    taken = [system.take_request(SERVER, 0x20, number, gid=7) for number in (1, 2, 3)]
    system.start(SERVER, 0xC2)
    system.end(SERVER, 0xC2)
    taken.append(system.take_request(SERVER, 0x20, 4, gid=7))
    system.ready(SERVER)
    system.start(SERVER, 0xC1)
    system.end(SERVER, 0xC1)
    taken.append(system.take_request(SERVER, 0x20, 5, gid=7))
    system.lose(trace=1)
    system.start(SERVER, 0xC1)
    system.end(SERVER, 0xC1)
    taken.append(system.take_request(SERVER, 0x20, 6, gid=7))
    start = system.start(SERVER, 0xC1)
    rows = analyse(system).rows(
        "SELECT q.taken_ns, i.start_ns FROM request AS q "
        "LEFT JOIN callback_instance AS i USING (callback_instance_id) ORDER BY ALL"
    )
    assert rows == [*[(time, None) for time in taken[:5]], (taken[5], start)]


def senders(analysis: Analysis) -> list[tuple[int, int | None]]:
    return [
        (number, start)
        for number, start in analysis.rows(
            "SELECT q.sequence_number, i.start_ns FROM link_request AS l "
            "JOIN request AS q USING (request_id) LEFT JOIN callback_instance AS i "
            "ON l.callback_instance_id = i.callback_instance_id ORDER BY ALL"
        )
    ]


def test_what_sent_a_request(system: RosSystem, analyse: Analyse) -> None:
    """The innermost run on the thread, also between and behind nested ones; or the thread."""
    hosts(system)
    system.send_request(CLIENT, 0x10, 1)
    outer = system.start(CLIENT, 0xC2)
    system.send_request(CLIENT, 0x10, 2)
    inner = system.start(CLIENT, 0xC3)
    system.send_request(CLIENT, 0x10, 3)
    system.send_request(Thread(100, 101), 0x10, 4)
    system.end(CLIENT, 0xC3)
    system.send_request(CLIENT, 0x10, 5)
    system.end(CLIENT, 0xC2)
    system.send_request(CLIENT, 0x10, 6)
    last = system.start(CLIENT, 0xC2)
    system.send_request(CLIENT, 0x10, 7)
    system.ready(CLIENT)
    system.send_request(CLIENT, 0x10, 8)
    assert senders(analyse(system)) == [
        (1, None),
        (2, outer),
        (3, inner),
        (4, None),
        (5, outer),
        (6, None),
        (7, last),
        (8, None),
    ]


@pytest.mark.thorough
def test_a_run_begins_where_one_that_never_ended_is_over(
    system: RosSystem, analyse: Analyse
) -> None:
    hosts(system)
    system.start(CLIENT, 0xC2)
    second = system.start(CLIENT, 0xC3)
    system.send_request(CLIENT, 0x10, 1)
    system.end(CLIENT, 0xC3)
    system.send_request(CLIENT, 0x10, 2)
    assert senders(analyse(system)) == [(1, second), (2, None)]


def test_a_response_sent_later(system: RosSystem, analyse: Analyse) -> None:
    """It comes from the service callback, and from the run that sent it."""
    hosts(system)
    system.send_request(CLIENT, 0x10, 1)
    system.take_request(SERVER, 0x20, 1, gid=7)
    asked = system.start(SERVER, 0xC1)
    system.end(SERVER, 0xC1)
    done = system.start(SERVER, 0xC9)
    system.send_response(SERVER, 0x20, 1, gid=7, stamp=5)
    system.end(SERVER, 0xC9)
    analysis = analyse(system)
    assert analysis.column(
        "SELECT i.start_ns FROM link_response AS l JOIN callback_instance AS i "
        "USING (callback_instance_id) ORDER BY ALL"
    ) == [asked, done]
    assert analysis.rows(
        "SELECT link_kind, from_id FROM flow_edge WHERE to_kind = 'response' ORDER BY ALL"
    ) == [("direct", 2), ("service", 1)]


def test_a_service_without_callbacks(system: RosSystem, analyse: Analyse) -> None:
    """rclpy: the response comes from the request."""
    hosts(system)
    system.send_request(CLIENT, 0x10, 1)
    system.take_request(SERVER, 0x20, 1, gid=7)
    system.send_response(SERVER, 0x20, 1, gid=7, stamp=5)
    system.take_response(CLIENT, 0x10, 1, stamp=5)
    analysis = analyse(system)
    assert analysis.rows("SELECT * EXCLUDE (run_id) FROM flow_edge") == [
        (
            "request",
            1,
            "response",
            1,
            "service",
            *analysis.rows("SELECT q.taken_ns, r.sent_ns FROM request AS q, response AS r")[0],
        )
    ]


LIFECYCLE = ("change_state", "get_state", "states", "transitions", "graph")


def managed_node(
    system: RosSystem,
    node: int,
    name: str,
    callback: int,
    *,
    lost_services: int = 0,
    lost_callbacks: int = 0,
) -> None:
    """A node with a service of its own, and the services of its lifecycle, without some events."""
    system.node(SERVER, node, name)
    system.service(SERVER, node + 0x100, f"/{name}/parameters", node=node, callback=callback)
    for number, service in enumerate(LIFECYCLE[lost_services:], start=1):
        system.service(
            SERVER, node + 0x100 + number, f"/{name}/{service}", callback=None, node=node
        )
    system.add(
        "ros2:rcl_lifecycle_state_machine_init", SERVER, node_handle=node, state_machine=node + 5
    )
    for number in range(1, 6 - lost_callbacks):
        system.add(
            "ros2:rclcpp_service_callback_added",
            SERVER,
            service_handle=node + 0x200 + number,
            callback=callback + number,
        )


SERVICES_OF_CALLBACKS = (
    "SELECT n.full_name, s.service_name, c.callback_handle FROM callback AS c "
    "LEFT JOIN service AS s USING (service_id) LEFT JOIN node AS n ON c.node_id = n.node_id "
    "ORDER BY c.callback_id"
)


def test_services_of_managed_nodes(system: RosSystem, analyse: Analyse) -> None:
    """rclcpp has copies of them; an address of one may be that of a service gone by."""
    hosts(system)
    for node, name, callback in ((0x1000, "one", 0xA0), (0xF00, "two", 0xB0)):
        managed_node(system, node, name, callback)
    analysis = analyse(system)
    assert analysis.rows(SERVICES_OF_CALLBACKS)[1:] == [
        (f"/{node}", f"/{node}/{service}", callback + number)
        for node, callback in (("one", 0xA0), ("two", 0xB0))
        for number, service in enumerate(("parameters", *LIFECYCLE))
    ]
    assert analysis.rows("SELECT count(*) FROM service WHERE is_inferred") == [(0,)]


@pytest.mark.parametrize(("services", "callbacks"), [thorough(1, 1), (1, 0), thorough(0, 1)])
def test_services_of_a_managed_node_that_were_lost(
    system: RosSystem, analyse: Analyse, services: int, callbacks: int
) -> None:
    """The order of what is left tells nothing."""
    hosts(system)
    managed_node(system, 0x1000, "one", 0xA0, lost_services=services, lost_callbacks=callbacks)
    rows = analyse(system).rows(SERVICES_OF_CALLBACKS)[1:]
    assert rows == [
        ("/one", "/one/parameters", 0xA0),
        *[(None, None, 0xA0 + number) for number in range(1, 6 - callbacks)],
    ]


@pytest.mark.thorough
def test_services_of_managed_nodes_that_begin_together(system: RosSystem, analyse: Analyse) -> None:
    """Two processes with equal addresses, a thread that makes services, and a lost callback."""
    hosts(system)
    system.service(SERVER, 0x4000, "/lost", callback=None, node=0x9)
    other = Thread(200, 201, trace=1)
    nodes = ((SERVER, "one", 0xA0), (Thread(300, trace=1), "two", 0xB0))
    for thread, name, _ in nodes:
        system.node(thread, 0x1000, name)
    for number, service in enumerate(LIFECYCLE, start=1):
        for thread, name, _ in nodes:
            system.service(
                thread, 0x1000 + number, f"/{name}/{service}", callback=None, node=0x1000
            )
    for thread, _, _ in nodes:
        system.add(
            "ros2:rcl_lifecycle_state_machine_init", thread, node_handle=0x1000, state_machine=0x5
        )
    for number in range(1, 6):
        for thread, _, callback in nodes:
            system.add(
                "ros2:rclcpp_service_callback_added",
                thread,
                service_handle=0x2000 + number,
                callback=callback + number,
            )
        system.service(other, 0x3000 + number, "/else", callback=0x10 + number, node=0x1000)
    rows = analyse(system).rows(SERVICES_OF_CALLBACKS)
    assert [row for row in rows if row[2] in range(0xA0, 0xC0)] == [
        (f"/{name}", f"/{name}/{service}", callback + number)
        for number, service in enumerate(LIFECYCLE, start=1)
        for _, name, callback in nodes
    ]


RUNS = (
    "SELECT start_ns, end_ns, is_end_inferred FROM callback_instance ORDER BY callback_instance_id"
)


def serve(system: RosSystem, callback: int, *, ends: bool = False) -> int:
    """A callback of a service, called by an executor; its start."""
    system.ready(SERVER)
    start = system.start(SERVER, callback)
    if ends:
        system.end(SERVER, callback)
    return start


def test_a_response_that_comes_later(system: RosSystem, analyse: Analyse) -> None:
    """rclcpp records no end of the callback: the executor goes on when it is over.

    Ends of other callbacks say nothing of it.
    """
    hosts(system)
    system.timer(SERVER, 0x60, 0xC2)
    first = (system.start(SERVER, 0xC2), system.end(SERVER, 0xC2), False)
    starts = [serve(system, 0xC1)]
    ends = [system.ready(SERVER)]
    start = system.start(SERVER, 0xC2)
    starts += [start, serve(system, 0xC1)]
    analysis = analyse(system)
    assert analysis.rows(RUNS) == [
        first,
        (starts[0], ends[0], True),
        (start, None, False),
        (starts[2], None, False),
    ]


def test_a_service_callback_that_throws(system: RosSystem, analyse: Analyse) -> None:
    """Others of the service have an end."""
    hosts(system)
    first = serve(system, 0xC1)
    system.ready(SERVER)
    second = serve(system, 0xC1, ends=True)
    assert [row[::2] for row in analyse(system).rows(RUNS)] == [(first, False), (second, False)]
    assert analyse(system).rows(RUNS)[0][1] is None


@pytest.mark.thorough
def test_a_response_that_comes_later_and_a_gap(system: RosSystem, analyse: Analyse) -> None:
    """What the executor did last may be lost, and so may the end."""
    hosts(system)
    start = serve(system, 0xC1)
    system.lose(trace=1)
    system.ready(SERVER)
    assert analyse(system).rows(RUNS) == [(start, None, False)]
