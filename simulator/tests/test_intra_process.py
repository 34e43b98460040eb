"""Ring buffers: their events are those of rclcpp's, and truth knows each message in them."""

from __future__ import annotations

from collections import deque

import pytest
from support.thorough import few

from msgflow_sim import simulate

INTRA = ("intra_process", "mixed_intra_process")


@pytest.fixture(params=few(INTRA, "intra_process"))
def intra(request, recordings):
    """Each scenario with messages that stay in their process."""
    return recordings[request.param]


def _short(event):
    return event.name.removeprefix("ros2:")


def test_buffers_behave_as_those_of_rclcpp(intra):
    capacities, held, indexes, overwritten = {}, {}, {}, 0
    for event in intra.events:
        name, fields = _short(event), event.fields
        if name == "rclcpp_construct_ring_buffer":
            capacities[fields["buffer"]] = fields["capacity"]
            held[fields["buffer"]] = deque()
            indexes[fields["buffer"]] = -1
        elif name == "rclcpp_ring_buffer_enqueue":
            buffer = fields["buffer"]
            capacity, queue = capacities[buffer], held[buffer]
            indexes[buffer] = (indexes[buffer] + 1) % capacity
            is_full = len(queue) == capacity
            assert fields["index"] == indexes[buffer]
            assert fields["size"] == len(queue) + 1
            assert fields["overwritten"] == int(is_full)
            if is_full:
                assert queue.popleft() == fields["index"]
                overwritten += 1
            queue.append(fields["index"])
        elif name == "rclcpp_ring_buffer_dequeue":
            queue = held[fields["buffer"]]
            assert fields["index"] == queue.popleft()
            assert fields["size"] == len(queue)
    assert len(capacities) > 3
    if intra.meta["scenario"] == "intra_process":
        assert overwritten > 30
        assert intra.meta["undelivered"]["overwritten"] == overwritten


def test_truth_knows_which_message_was_dequeued(intra):
    """Followed from slot to slot in the trace alone, but for replayed ones."""
    taken = {
        (tid, dequeued): (published, is_replay)
        for tid, dequeued, published, is_replay in intra.truth(
            "SELECT take_tid, take_dequeue_ns, publication_intra_ns, is_replay FROM transport "
            "WHERE method = 'ring_buffer'"
        )
    }
    publishing, slots, found = {}, {}, {}
    for event in intra.events:
        name, fields = _short(event), event.fields
        if name == "rclcpp_intra_publish":
            publishing[event.tid] = event.ts_ns
        elif name == "rclcpp_ring_buffer_enqueue":
            slots[fields["buffer"], fields["index"]] = publishing.get(event.tid)
        elif name == "rclcpp_ring_buffer_dequeue":
            found[event.tid, event.ts_ns] = slots.pop((fields["buffer"], fields["index"]))
        elif name not in {"rclcpp_publish", "rcl_publish", "rmw_publish"}:
            publishing.pop(event.tid, None)
    assert taken.keys() == found.keys()
    direct = {key for key, (_, is_replay) in taken.items() if not is_replay}
    assert len(direct) > 100
    assert all(found[key] == taken[key][0] for key in direct)
    # A replay is not published when it is put into the buffer.
    replayed = taken.keys() - direct
    assert all(found[key] is None for key in replayed)
    assert bool(replayed) == (intra.meta["scenario"] == "mixed_intra_process")


def test_a_dequeue_leads_to_an_intra_process_callback(intra):
    last = {}
    dequeues = 0
    for event in intra.events:
        before = last.get(event.tid)
        if before is not None and _short(before) == "rclcpp_ring_buffer_dequeue":
            assert _short(event) == "callback_start"
            dequeues += 1
        if _short(event) == "callback_start":
            is_dequeued = before is not None and _short(before) == "rclcpp_ring_buffer_dequeue"
            assert event.fields["is_intra_process"] == int(is_dequeued)
        last[event.tid] = event
    assert dequeues > 100


@pytest.mark.thorough
def test_only_what_somebody_else_wants_goes_through_dds(recordings):
    counts = "SELECT count(*), count(rmw_ns) FROM publication WHERE intra_ns IS NOT NULL"
    ((alone, published),) = recordings["intra_process"].truth(counts)
    assert alone > 50
    assert published == 0
    ((mixed, published),) = recordings["mixed_intra_process"].truth(counts)
    # Before the other process was discovered DDS was not needed.
    assert 0.8 * mixed < published < mixed


def test_copies_by_dds_are_taken_without_a_callback(recordings):
    recording = recordings["mixed_intra_process"]
    ((copies, with_buffer),) = recording.truth(
        "SELECT count(*), count(b.take_id) FROM take t LEFT JOIN take b "
        "ON t.publication_id = b.publication_id AND t.subscription_id = b.subscription_id "
        "AND b.method = 'ring_buffer' "
        "WHERE t.method = 'rmw' AND t.callback_instance_id IS NULL"
    )
    assert copies > 100
    assert copies - with_buffer <= 3  # The last ones wait in their buffers.


def test_a_subscription_has_two_callbacks_of_one_handle(intra):
    handles = {}
    for event in intra.events:
        if _short(event) == "rclcpp_subscription_init":
            handles.setdefault(event.fields["subscription_handle"], set()).add(
                event.fields["subscription"]
            )
    is_alone = intra.meta["scenario"] == "intra_process"
    assert {len(objects) for objects in handles.values()} == ({2} if is_alone else {1, 2})
    linked = [e for e in intra.events if _short(e) == "rclcpp_ipb_to_subscription"]
    objects = set().union(*handles.values())
    assert linked
    assert {event.fields["subscription"] for event in linked} <= objects


def test_in_humble_only_the_callback_tells(tmp_path, read):
    recording = read(simulate("intra_process", tmp_path / "out", factor=0.1, layout="humble"))
    names = {_short(event) for event in recording.events}
    assert not {name for name in names if "buffer" in name or "intra" in name}
    starts = [e for e in recording.events if _short(e) == "callback_start"]
    intra_process = [e for e in starts if e.fields["is_intra_process"]]
    ((known,),) = recording.truth("SELECT count(*) FROM callback_instance WHERE is_intra_process")
    assert len(intra_process) == known > 20
