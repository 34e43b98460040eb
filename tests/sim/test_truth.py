"""The truth agrees with the trace, event by event, and with itself."""

from __future__ import annotations

from collections import Counter

import pytest

from msgflow.sim import simulate

_SECOND = 1_000_000_000
_PUBLICATION = {"rclcpp": "rclcpp_publish", "rcl": "rcl_publish", "rmw": "rmw_publish"}
_TAKE = {"rmw": "rmw_take", "rcl": "rcl_take", "rclcpp": "rclcpp_take"}


def _at(recording):
    """Events by host, process, thread, time and name."""
    return {
        (e.host, e.pid, e.tid, e.ts_ns, e.name.removeprefix("ros2:")): e for e in recording.events
    }


@pytest.mark.parametrize(
    ("table", "prefix", "layers"),
    [
        ("publication", "", _PUBLICATION),
        ("take", "", _TAKE),
        ("transport", "publication_", _PUBLICATION),
        ("transport", "take_", _TAKE),
    ],
)
def test_stamps_are_those_of_events(recording, table, prefix, layers):
    events = _at(recording)
    for layer, name in layers.items():
        rows = recording.truth(
            f"SELECT {prefix}host, {prefix}pid, {prefix}tid, {prefix}{layer}_ns, "
            f"source_timestamp_ns FROM {table} WHERE {prefix}{layer}_ns IS NOT NULL"
        )
        assert rows
        for *place, stamp in rows:
            fields = events[(*place, name)].fields
            assert stamp in (fields.get("timestamp", stamp), 0)
            assert fields.get("source_timestamp", stamp) == stamp


def test_every_publish_event_has_a_publication(recording):
    for layer, name in _PUBLICATION.items():
        known = recording.truth(f"SELECT host, pid, tid, {layer}_ns FROM publication")
        traced = [
            (e.host, e.pid, e.tid, e.ts_ns) for e in recording.events if e.name == f"ros2:{name}"
        ]
        assert sorted(row for row in known if row[3] is not None) == sorted(traced)


def test_every_successful_take_of_an_executor_is_known(recording):
    known = recording.truth("SELECT host, pid, tid, rmw_ns FROM take")
    traced = [
        (e.host, e.pid, e.tid, e.ts_ns)
        for e in recording.events
        if e.name == "ros2:rmw_take" and e.fields["source_timestamp"]
    ]
    assert sorted(known) == sorted(traced)


def test_every_callback_is_known(recording):
    for column, name in (("start_ns", "ros2:callback_start"), ("end_ns", "ros2:callback_end")):
        known = recording.truth(
            f"SELECT host, pid, tid, callback_handle, {column} FROM callback_instance"
        )
        traced = [
            (e.host, e.pid, e.tid, e.fields["callback"], e.ts_ns)
            for e in recording.events
            if e.name == name
        ]
        assert sorted(known) == sorted(traced)


def test_executor_states_are_the_executor_events(recording):
    names = {
        "ros2:rclcpp_executor_get_next_ready": "process",
        "ros2:rclcpp_executor_wait_for_work": "wait",
        "ros2:rclcpp_executor_execute": "execute",
    }
    known = recording.truth(
        "SELECT host, pid, tid, start_ns, state FROM executor_state ORDER BY ALL"
    )
    traced = [
        (e.host, e.pid, e.tid, e.ts_ns, names[e.name]) for e in recording.events if e.name in names
    ]
    assert known == sorted(traced)
    gaps = recording.truth(
        "SELECT count(*) FROM (SELECT end_ns, lead(start_ns) OVER (PARTITION BY host, tid "
        "ORDER BY start_ns) AS next_ns FROM executor_state) WHERE end_ns IS DISTINCT FROM next_ns"
    )
    assert gaps == [(0,)]


def test_takes_carry_the_stamp_of_their_publication(recording):
    wrong = recording.truth(
        "SELECT count(*) FROM transport t JOIN publication p USING (publication_id) "
        "JOIN take k USING (take_id) WHERE p.source_timestamp_ns != k.source_timestamp_ns "
        "OR p.topic_name != k.topic_name OR k.publication_id != p.publication_id "
        "OR t.latency_ns <= 0"
    )
    assert wrong == [(0,)]
    assert recording.meta["rows"]["transport"] == recording.meta["rows"]["take"] > 0


def test_causes_contain_their_publications(recording):
    (total, wrong) = recording.truth(
        "SELECT count(*), count(*) FILTER (WHERE NOT (p.rmw_ns BETWEEN c.start_ns AND c.end_ns) "
        "OR p.tid != c.tid OR p.host != c.host OR l.callback_start_ns != c.start_ns "
        "OR l.take_id IS DISTINCT FROM c.take_id) "
        "FROM causal l JOIN publication p USING (publication_id) "
        "JOIN callback_instance c ON c.callback_instance_id = l.callback_instance_id"
    )[0]
    assert (total, wrong) == (recording.meta["rows"]["causal"], 0)
    # Nothing is published inside a callback without being caused by it.
    stray = recording.truth(
        "SELECT count(*) FROM publication p JOIN callback_instance c ON p.host = c.host AND "
        "p.tid = c.tid AND p.rmw_ns BETWEEN c.start_ns AND c.end_ns "
        "WHERE p.callback_instance_id IS DISTINCT FROM c.callback_instance_id"
    )
    assert stray == [(0,)]


def test_end_to_end_follows_from_the_links(recording):
    # Walk from each timer callback over publications and takes, as far as it goes.
    walked = recording.truth(
        """
        WITH RECURSIVE walk AS (
            SELECT callback_instance_id AS root, callback_instance_id AS current, []::TEXT[] AS path
            FROM callback_instance WHERE kind = 'timer'
            UNION ALL
            SELECT root, k.callback_instance_id, list_append(path, p.topic_name)
            FROM walk
            JOIN publication p ON p.callback_instance_id = current AND NOT p.is_internal
            JOIN take k USING (publication_id)
        )
        SELECT root, path, t.take_id, c.end_ns
        FROM walk JOIN callback_instance c ON current = c.callback_instance_id
        JOIN take t USING (take_id)
        WHERE NOT EXISTS (
            FROM publication p WHERE p.callback_instance_id = current AND NOT p.is_internal
        )
        ORDER BY ALL
        """
    )
    known = recording.truth(
        "SELECT root_callback_instance_id, path, sink_take_id, sink_end_ns FROM end_to_end "
        "ORDER BY ALL"
    )
    assert known
    assert known == walked
    assert recording.truth(
        "SELECT count(*) FROM end_to_end e JOIN callback_instance c "
        "ON e.root_callback_instance_id = c.callback_instance_id "
        "WHERE e.root_start_ns != c.start_ns OR sink_end_ns - root_start_ns != latency_ns"
    ) == [(0,)]


def test_what_was_published_was_taken_or_is_accounted_for(recording):
    unaccounted = recording.truth(
        """
        SELECT p.topic_name, count(*)
        FROM publication p
        JOIN (
            SELECT topic_name, host, pid, subscription_handle,
                min(source_timestamp_ns) AS first_ns
            FROM take GROUP BY ALL
        ) s USING (topic_name)
        WHERE NOT EXISTS (FROM take t WHERE t.publication_id = p.publication_id
                          AND (t.host, t.pid, t.subscription_handle)
                            = (s.host, s.pid, s.subscription_handle))
          AND NOT EXISTS (FROM undelivered u WHERE u.publication_id = p.publication_id
                          AND (u.subscription_host, u.subscription_pid, u.subscription_handle)
                            = (s.host, s.pid, s.subscription_handle))
          AND p.source_timestamp_ns >= s.first_ns
        GROUP BY ALL
        """
    )
    assert unaccounted == []
    reasons = recording.meta["undelivered"]
    assert reasons["before_discovery"] > 0
    assert reasons["pending_at_end"] > 0
    assert set(reasons) == {"before_discovery", "pending_at_end"}
    told = Counter(reason for (reason,) in recording.truth("SELECT reason FROM undelivered"))
    assert told == reasons


def test_queues_of_built_in_scenarios_never_overflow(recording):
    assert recording.meta["full_queues"] == 0


def test_full_queues_lose_the_oldest_if_so_asked(tmp_path, overloaded, read):
    recording = read(simulate(overloaded, tmp_path / "out"))
    lost = recording.truth(
        "SELECT publication_rmw_ns, publication_id FROM undelivered WHERE reason = 'overwritten'"
    )
    taken = recording.truth(
        "SELECT t.rmw_ns, p.rmw_ns FROM take t JOIN publication p USING (publication_id) "
        "WHERE NOT t.is_internal ORDER BY t.rmw_ns"
    )
    assert len(lost) == recording.meta["full_queues"]
    assert len(lost) > len(taken) > 50
    # Order is kept, and no message is taken before three newer ones would have pushed it out.
    published = [publication for _, publication in taken]
    assert published == sorted(published)
    assert all(take - publication < 3 * 4.5e6 for take, publication in taken)


def test_clock_offset_shifts_one_host_and_nothing_else(tmp_path, recordings):
    shifted = simulate("two_hosts", tmp_path / "out", factor=0.15, clock_offset_ns=_SECOND)
    before = recordings["two_hosts"]
    after = type(before)(shifted, ())
    for table in ("transport", "end_to_end"):
        latencies = f"SELECT latency_ns FROM {table} ORDER BY ALL"
        assert before.truth(latencies) == after.truth(latencies)
    starts = "SELECT host, start_ns FROM callback_instance ORDER BY callback_instance_id"
    moved = {
        (host, later - earlier)
        for (host, earlier), (_, later) in zip(
            before.truth(starts), after.truth(starts), strict=True
        )
    }
    assert moved == {("alpha", 0), ("beta", _SECOND)}


def test_messages_of_one_publisher_stay_in_order(tmp_path, burst, read):
    recording = read(simulate(burst, tmp_path / "out"))
    taken = recording.truth(
        "SELECT p.rmw_ns FROM take t JOIN publication p USING (publication_id) "
        "WHERE NOT t.is_internal ORDER BY t.rmw_ns"
    )
    assert len(taken) > 500
    assert taken == sorted(taken)
