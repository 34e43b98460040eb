"""The truth agrees with the trace, event by event, and with itself."""

from __future__ import annotations

from collections import Counter

import pytest

from msgflow_sim import simulate

_SECOND = 1_000_000_000
_PUBLICATION = {"rclcpp": "rclcpp_publish", "rcl": "rcl_publish", "rmw": "rmw_publish"}
_AGNOCAST = {"callback_start": "callable_start", "callback_end": "callable_end"}
_TAKE = {"rmw": "rmw_take", "rcl": "rcl_take", "rclcpp": "rclcpp_take"}
_OF_ROSOUT = (("publication", "rcl"), ("publication", "rmw"))
# Timers without a subscriber; actions, whose flows go through services.
_WITHOUT_FLOWS = ("timers", "actions")


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
        # Where all is in one process, only /rosout goes through the middleware, and not rclcpp.
        is_alone = recording.meta["scenario"] == "intra_process"
        assert rows or (is_alone and (table, layer) not in _OF_ROSOUT)
        for *place, stamp in rows:
            fields = events[(*place, name)].fields
            if stamp is None:
                # In the process it is known without a stamp. None is given after a shutdown.
                assert table == "transport" or (table, layer) == ("publication", "rclcpp")
                continue
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
    known = recording.truth("SELECT host, pid, tid, rmw_ns FROM take WHERE rmw_ns IS NOT NULL")
    traced = [
        (e.host, e.pid, e.tid, e.ts_ns)
        for e in recording.events
        if e.name == "ros2:rmw_take" and e.fields["source_timestamp"]
    ]
    assert sorted(known) == sorted(traced)


def test_every_callback_is_known(recording):
    for column, name in (("start_ns", "callback_start"), ("end_ns", "callback_end")):
        traced = [
            # Events of Agnocast do not say which callback it is.
            (e.host, e.pid, e.tid, e.fields.get("callback", 0), e.ts_ns)
            for e in recording.events
            if e.name in {f"ros2:{name}", f"agnocast:agnocast_{_AGNOCAST[name]}"}
        ]
        handles = {handle for *_, handle, _ in traced}
        known = [
            (*place, handle if handle in handles else 0, time)
            for *place, handle, time in recording.truth(
                f"SELECT host, pid, tid, callback_handle, {column} FROM callback_instance "
                f"WHERE {column} IS NOT NULL"
            )
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
        "ORDER BY start_ns) AS next_ns FROM executor_state) WHERE end_ns != next_ns"
    )
    assert gaps == [(0,)]


def test_takes_carry_the_stamp_of_their_publication(recording):
    wrong = recording.truth(
        "SELECT count(*) FROM transport t JOIN publication p USING (publication_id) "
        "JOIN take k USING (take_id) WHERE p.source_timestamp_ns != k.source_timestamp_ns "
        "OR t.method != k.method "
        "OR p.topic_name != k.topic_name OR k.publication_id != p.publication_id "
        "OR t.latency_ns <= 0 AND t.method != 'agnocast'"
    )
    assert wrong == [(0,)]
    assert recording.meta["rows"]["transport"] == recording.meta["rows"]["take"] > 0


def test_causes_contain_their_publications(recording):
    (total, wrong) = recording.truth(
        "SELECT count(*), count(*) FILTER (WHERE "
        "NOT (coalesce(p.intra_ns, p.rmw_ns) BETWEEN c.start_ns AND coalesce(c.end_ns, p.rmw_ns)) "
        "OR p.tid != c.tid OR p.host != c.host OR l.callback_start_ns != c.start_ns "
        "OR l.take_id IS DISTINCT FROM c.take_id) "
        "FROM causal l JOIN publication p USING (publication_id) "
        "JOIN callback_instance c ON c.callback_instance_id = l.callback_instance_id "
        "WHERE l.kind = 'direct'"
    )[0]
    known = recording.truth("SELECT count(*) FROM causal WHERE kind = 'direct'")
    assert (known, wrong) == ([(total,)], 0)
    # Nothing is published inside a callback without being caused by the innermost one.
    stray = recording.truth(
        "SELECT count(*) FROM (SELECT p.callback_instance_id AS told, "
        "max_by(c.callback_instance_id, c.start_ns) AS innermost "
        "FROM publication p JOIN callback_instance c ON p.host = c.host AND p.pid = c.pid AND "
        "p.tid = c.tid AND coalesce(p.intra_ns, p.rmw_ns) BETWEEN c.start_ns AND c.end_ns "
        "GROUP BY p.publication_id, told) WHERE told IS DISTINCT FROM innermost"
    )
    assert stray == [(0,)]


def test_without_a_callback_what_was_taken_before_is_the_cause(recording):
    wrong = recording.truth(
        "SELECT count(*) FROM causal l JOIN publication p USING (publication_id) "
        "ASOF JOIN take t ON l.host = t.host AND l.pid = t.pid AND l.tid = t.tid "
        "AND p.rmw_ns >= t.rmw_ns "
        "WHERE l.kind = 'take_adjacent' AND (t.take_id != l.take_id "
        "OR t.callback_instance_id IS NOT NULL OR l.callback_instance_id IS NOT NULL)"
    )
    assert wrong == [(0,)]


def test_end_to_end_follows_from_the_links(recording):
    # Walk from each timer callback over publications and takes, as far as it goes.
    walked = recording.truth(
        """
        WITH RECURSIVE onward AS (
            SELECT l.callback_instance_id, l.take_id, l.topic_name, t.take_id AS next_take_id,
                l.publication_id
            FROM causal l JOIN transport t USING (publication_id)
            -- A filter passes on its sets. Which message triggered it does not matter.
            WHERE NOT l.is_internal AND NOT t.is_self_loop AND l.kind <> 'triggered'
        ),
        walk AS (
            SELECT callback_instance_id AS root, next_take_id AS current,
                [topic_name]::TEXT[] AS path
            FROM onward JOIN callback_instance USING (callback_instance_id)
            -- Not a timer that publishes what it makes of messages.
            WHERE kind = 'timer' AND onward.publication_id NOT IN (
                SELECT publication_id FROM causal WHERE take_id IS NOT NULL
            )
            UNION
            SELECT root, next_take_id, list_append(path, topic_name)
            FROM walk JOIN onward o ON o.take_id = current
        )
        SELECT root, path, current, c.end_ns
        FROM walk JOIN callback_instance c ON c.take_id = current
        JOIN take AS t ON t.take_id = current
        WHERE c.end_ns IS NOT NULL
          -- Nothing of this subscription leads on.
          AND NOT EXISTS (
              FROM causal l JOIN take o ON l.take_id = o.take_id
              WHERE o.subscription_id = t.subscription_id AND NOT l.is_internal
          )
        ORDER BY ALL
        """
    )
    known = recording.truth(
        "SELECT root_callback_instance_id, path, sink_take_id, sink_end_ns FROM end_to_end "
        "ORDER BY ALL"
    )
    assert bool(known) != (recording.meta["scenario"] in _WITHOUT_FLOWS)
    assert known == walked
    wrong = (
        "SELECT count(*) FROM end_to_end e JOIN callback_instance c "
        "ON e.root_callback_instance_id = c.callback_instance_id WHERE e.root_start_ns "
        "!= c.start_ns OR e.root_host = e.sink_host AND sink_end_ns - root_start_ns != latency_ns"
    )
    assert recording.truth(wrong) == [(0,)]


def test_every_message_was_taken_once_by_every_subscription_or_is_accounted_for(recording):
    """A copy that DDS carries beside a ring buffer is taken without a callback."""
    unaccounted = recording.truth(
        """
        WITH pair AS (
            SELECT publication_id, subscription_id, topic_name
            FROM publication AS p JOIN subscription AS s USING (topic_name)
            -- After a shutdown, rcl refuses the message. What Agnocast carries has no rmw handle.
            WHERE (p.rclcpp_ns IS NULL OR p.rcl_ns IS NOT NULL)
                AND (p.rmw_publisher_handle = 0) = (s.rmw_subscription_handle = 0)
        ),
        copy AS (
            SELECT t.take_id FROM take t JOIN publication p USING (publication_id)
            WHERE t.method = 'rmw' AND p.intra_ns IS NOT NULL AND t.callback_instance_id IS NULL
        ),
        outcome AS (
            SELECT publication_id, subscription_id, 'taken' AS how FROM take ANTI JOIN copy
            USING (take_id)
            UNION ALL
            SELECT publication_id, subscription_id, reason FROM undelivered
        )
        SELECT topic_name, list(how), count(*)
        FROM pair LEFT JOIN outcome USING (publication_id, subscription_id)
        GROUP BY publication_id, subscription_id, topic_name
        HAVING count(how) <> 1
        """
    )
    assert unaccounted == []
    told = Counter(reason for (reason,) in recording.truth("SELECT reason FROM undelivered"))
    assert told == recording.meta["undelivered"]
    assert set(told) <= {
        "before_discovery",
        "before_subscription",
        "expired",
        "lost_in_transport",
        "overwritten",
        "pending_at_end",
        "subscription_ended",
        "take_failed",
    }


def test_queues_of_plain_scenarios_never_overflow(basic):
    assert basic.meta["full_queues"] == 0
    assert basic.meta["undelivered"].keys() == {
        "before_discovery",
        "before_subscription",
        "pending_at_end",
    }


@pytest.mark.thorough
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


@pytest.mark.thorough
def test_messages_of_one_publisher_stay_in_order(tmp_path, burst, read):
    recording = read(simulate(burst, tmp_path / "out"))
    taken = recording.truth(
        "SELECT p.rmw_ns FROM take t JOIN publication p USING (publication_id) "
        "WHERE NOT t.is_internal ORDER BY t.rmw_ns"
    )
    assert len(taken) > 500
    assert taken == sorted(taken)


def test_a_callback_that_outlives_the_shutdown_publishes_nothing(recordings):
    """Only the event of rclcpp is left."""
    recording = recordings["restarts"]
    refused = recording.truth(
        "SELECT p.rclcpp_ns, c.end_ns FROM publication AS p "
        "JOIN callback_instance AS c USING (callback_instance_id) "
        "WHERE p.topic_name = '/result' AND p.rcl_ns IS NULL"
    )
    assert len(refused) == 1
    ((published, ended),) = refused
    assert published < ended
