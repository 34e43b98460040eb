"""Processes that end, crash, and begin again."""

from __future__ import annotations

from collections import defaultdict

import pytest
from support.thorough import few

MILLISECOND = 1_000_000


@pytest.fixture(params=few(["restarts", "container_restarts"], "restarts"))
def restarted(request, recordings):
    """Processes that begin again, with other ids of threads and with the same ones."""
    return recordings[request.param]


@pytest.mark.thorough
def test_lives_of_an_id_do_not_overlap(restarted):
    recording = restarted
    begin = recording.meta["hosts"]["alpha"]["begin_of_tracing_ns"]
    relay = [e.ts_ns - begin for e in recording.events if e.pid == 1201]
    stops = (1_000 * MILLISECOND, 2_001 * MILLISECOND)
    starts = (1_200 * MILLISECOND, 2_300 * MILLISECOND)
    assert any(time > starts[1] for time in relay)
    for stop, start in zip(stops, starts, strict=True):
        assert not [time for time in relay if stop + 5 * MILLISECOND < time < start]


def test_lives_have_equal_addresses_and_other_identifiers(restarted):
    handles, gids = defaultdict(list), defaultdict(list)
    for event in restarted.events:
        if event.pid == 1201 and event.name == "ros2:rcl_publisher_init":
            handles[event.fields["topic_name"]].append(event.fields["publisher_handle"])
        if event.pid == 1201 and event.name == "ros2:rmw_publisher_init":
            gids[event.fields["rmw_publisher_handle"]].append(event.fields["gid"][:16])
    assert len(handles["/result"]) == 3
    assert len(set(handles["/result"])) == 1
    assert all(len(set(each)) == len(each) for each in gids.values())


def test_a_crash_leaves_a_callback_without_an_end(restarted):
    recording = restarted
    begin = recording.meta["hosts"]["alpha"]["begin_of_tracing_ns"]
    open_instances = recording.truth(
        f"SELECT pid, start_ns - {begin} FROM callback_instance WHERE end_ns IS NULL"
    )
    assert [pid for pid, _ in open_instances] == [1201]
    assert 1_990 * MILLISECOND < open_instances[0][1] < 2_001 * MILLISECOND


@pytest.mark.thorough
def test_threads_get_ids_as_of_their_life(recordings):
    tids = {
        name: {e.tid for e in recordings[name].events if e.pid == 1201}
        for name in ("restarts", "container_restarts")
    }
    assert len(tids["restarts"]) == 4
    assert len(tids["container_restarts"]) == 2


def test_another_program_gets_the_id(restarted):
    names = []
    for event in restarted.events:
        if event.pid == 1301 and event.procname not in names:
            names.append(event.procname)
    assert names == ["sink", "other"]
