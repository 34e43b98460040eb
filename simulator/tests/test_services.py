"""Requests and responses: events and truth agree, and so do the callbacks between them."""

from __future__ import annotations

from collections import Counter


def _events(recording, name, *fields):
    return Counter(
        (e.host, e.pid, e.tid, e.ts_ns, *(e.fields[field] for field in fields))
        for e in recording.events
        if e.name == f"ros2:{name}"
    )


def _rows(recording, sql):
    return Counter(recording.truth(sql))


def test_truth_has_the_events_of_requests_and_responses(recordings):
    recording = recordings["services"]
    expected = {
        ("rmw_send_request", "sequence_number"): (
            "SELECT client_host, client_pid, client_tid, sent_ns, sequence_number FROM request"
        ),
        ("rmw_take_request", "client_gid", "sequence_number"): (
            "SELECT service_host, service_pid, service_tid, taken_ns, client_gid, sequence_number "
            "FROM request WHERE taken_ns IS NOT NULL"
        ),
        ("rmw_send_response", "client_gid", "sequence_number", "timestamp"): (
            "SELECT service_host, service_pid, service_tid, sent_ns, client_gid, "
            "sequence_number, source_timestamp_ns FROM response"
        ),
        ("rmw_take_response", "sequence_number", "source_timestamp"): (
            "SELECT client_host, client_pid, client_tid, taken_ns, sequence_number, "
            "source_timestamp_ns FROM response WHERE taken_ns IS NOT NULL"
        ),
    }
    for (name, *fields), sql in expected.items():
        events = _events(recording, name, *fields)
        assert sum(events.values()) > 20
        assert events == _rows(recording, sql)


def test_clients_have_identifiers_of_their_own(recordings):
    recording = recordings["services"]
    created = {e.fields["gid"] for e in recording.events if e.name == "ros2:rmw_client_init"}
    used = {gid for (gid,) in recording.truth("SELECT DISTINCT client_gid FROM request")}
    assert len(created) == 3
    assert used <= created


def test_a_service_answers_after_its_callback(recordings):
    ((count, right),) = recordings["services"].truth(
        "SELECT count(*), count(*) FILTER (WHERE q.taken_ns < c.start_ns AND c.end_ns < r.sent_ns "
        "AND c.kind = 'service' AND c.tid = r.service_tid) FROM request q "
        "JOIN response r USING (request_id) "
        "JOIN callback_instance c ON q.callback_instance_id = c.callback_instance_id"
    )
    assert count == right > 20


def test_services_and_clients_publish(recordings):
    recording = recordings["services"]
    in_services = recording.truth(
        "SELECT count(*) FROM publication JOIN callback_instance USING (callback_instance_id) "
        "WHERE kind = 'service' AND topic_name = '/plan_made'"
    )
    by_clients = recording.truth(
        "SELECT count(*), count(callback_instance_id) FROM publication "
        "WHERE topic_name = '/answered'"
    )
    assert in_services[0][0] > 10
    assert by_clients[0][0] > 10
    assert by_clients[0][1] == 0


def test_a_managed_node_changes_state_in_a_callback_of_a_service(recordings):
    recording = recordings["services"]
    traced = Counter(
        (e.host, e.tid, e.ts_ns, e.fields["start_label"], e.fields["goal_label"])
        for e in recording.events
        if e.name == "ros2:rcl_lifecycle_transition"
    )
    known = _rows(
        recording, "SELECT host, tid, at_ns, start_state, goal_state FROM lifecycle_transition"
    )
    assert traced == known
    states = recording.truth(
        "SELECT start_state, goal_state FROM lifecycle_transition ORDER BY at_ns"
    )
    assert states[:2] == [("unconfigured", "configuring"), ("configuring", "inactive")]
    inside = recording.truth(
        "SELECT count(*) FROM lifecycle_transition l JOIN callback_instance c ON l.tid = c.tid "
        "AND l.at_ns BETWEEN c.start_ns AND c.end_ns WHERE c.kind = 'service'"
    )
    assert inside == [(len(states),)]
