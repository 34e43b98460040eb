"""Messages that do not arrive, each for the reason that the truth tells."""

from __future__ import annotations

from collections import Counter

import pytest

from msgflow_sim import Host, Node, Process, Publisher, Scenario, Subscription, Timer, simulate


def _reasons(recording, topic):
    return Counter(
        reason
        for (reason,) in recording.truth(
            f"SELECT reason FROM undelivered WHERE topic_name = '{topic}'"
        )
    )


@pytest.mark.thorough
def test_a_full_queue_drops_its_oldest_message(recordings):
    recording = recordings["overload"]
    assert _reasons(recording, "/points")["overwritten"] > 30
    # While it waited at least as many newer ones arrived as the queue holds.
    newer = recording.truth(
        "SELECT u.publication_id, s.depth, count(p.publication_id) FROM undelivered u "
        "JOIN (VALUES ('/points', 3), ('/image', 1)) s(topic, depth) ON u.topic_name = s.topic "
        "JOIN publication p ON p.topic_name = u.topic_name "
        "AND p.rmw_ns > u.publication_rmw_ns WHERE reason = 'overwritten' GROUP BY ALL"
    )
    assert newer
    assert all(count >= depth for _, depth, count in newer)


@pytest.mark.thorough
def test_each_loss_has_its_own_reason(recordings):
    recording = recordings["losses"]
    lossy = _reasons(recording, "/lossy")
    assert 5 < lossy["lost_in_transport"] < 60
    late = _reasons(recording, "/late")
    assert late["before_discovery"] > 60
    dynamic = _reasons(recording, "/dynamic")
    assert min(dynamic["subscription_ended"], dynamic["before_subscription"]) > 50
    assert _reasons(recording, "/short_lived")["take_failed"] > 5


def test_expired_messages_make_takes_fail(recordings):
    recording = recordings["losses"]
    failed = sum(
        event.name == "ros2:rmw_take" and not event.fields["taken"] and event.tid == event.pid
        for event in recording.events
    )
    assert failed == recording.meta["failed_takes"] > 5
    late = recording.truth(
        "SELECT max(take_rmw_ns - publication_rmw_ns) FROM transport "
        "WHERE topic_name = '/short_lived'"
    )
    assert late[0][0] < 3_020_000


@pytest.mark.thorough
def test_nothing_is_taken_outside_the_life_of_a_subscription(recordings):
    for name in ("losses", "restarts"):
        ((outside,),) = recordings[name].truth(
            "SELECT count(*) FROM take t JOIN subscription s USING (subscription_id) "
            "WHERE coalesce(t.rmw_ns, t.dequeue_ns) < s.created_ns "
            "OR coalesce(t.rmw_ns, t.dequeue_ns) > s.ended_ns + 5000000"
        )
        assert outside == 0


def test_an_address_is_used_again(recordings):
    again = recordings["losses"].truth(
        "SELECT count(*) FROM subscription a JOIN subscription b USING (host, pid) "
        "WHERE a.subscription_handle = b.subscription_handle AND a.ended_ns < b.created_ns"
    )
    assert again == [(1,)]


@pytest.mark.thorough
def test_a_subscription_is_there_once_the_middleware_has_it(tmp_path, read):
    """What is sent before the rest of it is created comes before discovery."""
    recording = read(
        simulate("host_chain", tmp_path, layout="humble-cyclonedds", factor=0.1, seed=1)
    )
    created = recording.truth("SELECT pid, rmw_subscription_handle, created_ns FROM subscription")
    initialised = {
        (e.pid, e.fields["rmw_subscription_handle"]): e.ts_ns
        for e in recording.events
        if e.name == "ros2:rmw_subscription_init"
    }
    assert all(initialised[pid, handle] == ts_ns for pid, handle, ts_ns in created)
    meanwhile = recording.truth(
        "SELECT u.reason FROM undelivered AS u JOIN publication AS p USING (publication_id) "
        "JOIN subscription AS s USING (subscription_id) "
        "WHERE p.rmw_ns BETWEEN s.created_ns AND s.created_ns + 30_000"
    )
    assert {reason for (reason,) in meanwhile} == {"before_discovery"}


def test_who_comes_late_gets_what_was_kept(tmp_path, read):
    keeper = Node(
        "keeper",
        publishers=(Publisher("/state", 3, transient_local=True),),
        timers=(Timer(20_000_000, ("/state",)),),
    )
    late = Node(
        "late",
        subscriptions=(
            Subscription("/state", transient_local=True, created_ns=500_000_000),
            Subscription("/state", created_ns=500_000_000),
        ),
    )
    scenario = Scenario(
        "late",
        "Late.",
        (Host("alpha"),),
        (Process("keeper", "alpha", 100, (keeper,)), Process("late", "alpha", 200, (late,))),
        duration_ns=800_000_000,
    )
    recording = read(simulate(scenario, tmp_path / "out"))
    replayed = recording.truth(
        "SELECT t.subscription_id, count(*) FROM transport JOIN take t USING (take_id) "
        "WHERE is_replay GROUP BY ALL"
    )
    # Three were kept; one of them may be newer than the subscription, but not than its discovery.
    assert [count for _, count in replayed] in ([2], [3])
    reasons = _reasons(recording, "/state")
    assert reasons["before_subscription"] > 30
