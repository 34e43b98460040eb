"""Events of the user's own tracepoints, and the callback instances inside which they happened."""

from __future__ import annotations

import pytest
from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
# When the event happened, and when the callback instance began.
PLACES = """
SELECT u.at_ns, i.start_ns
FROM user_event AS u
LEFT JOIN callback_instance AS i USING (callback_instance_id)
ORDER BY u.user_event_id
"""


def happen(system: RosSystem, thread: Thread = MAIN, ts: int | None = None) -> int:
    """Record an event; returns its time."""
    return system.add("user_event", thread, ts=ts, name="my_pkg:done", fields='{"x":1}')


def begin(system: RosSystem, callback: int, thread: Thread = MAIN, ts: int | None = None) -> int:
    return system.add("ros2:callback_start", thread, ts=ts, callback=callback, is_intra_process=0)


def end(system: RosSystem, callback: int, thread: Thread = MAIN, ts: int | None = None) -> int:
    return system.add("ros2:callback_end", thread, ts=ts, callback=callback)


def marks(model: Analysis) -> list[tuple[bool]]:
    return model.rows("SELECT is_loss_affected FROM user_event ORDER BY user_event_id")


def test_an_event_is_of_the_callback_that_runs_on_its_thread(
    system: RosSystem, analyse: Analyse
) -> None:
    """Not before its begin, nor behind its end, nor on another thread."""
    before = happen(system)
    start = begin(system, 0xC1)
    inside = happen(system)
    other = happen(system, Thread(100, 101))
    end(system, 0xC1)
    behind = happen(system)
    model = analyse(system)
    assert model.rows(PLACES) == [(before, None), (inside, start), (other, None), (behind, None)]
    assert model.rows(
        "SELECT u.name, u.fields, u.cpu, u.trace_id, p.pid, t.tid "
        f"FROM user_event AS u JOIN process AS p USING (process_id) JOIN thread AS t "
        f"USING (thread_id) WHERE u.at_ns = {other}"
    ) == [("my_pkg:done", '{"x":1}', 0, 1, 100, 101)]


def test_of_nested_callbacks_the_innermost_counts(system: RosSystem, analyse: Analyse) -> None:
    """Behind the end of the inner ones, the outer one goes on."""
    outer = begin(system, 0xC1)
    first = happen(system)
    middle = begin(system, 0xC2)
    inner = begin(system, 0xC3)
    second = happen(system)
    end(system, 0xC3)
    third = happen(system)
    end(system, 0xC2)
    fourth = happen(system)
    end(system, 0xC1)
    fifth = happen(system)
    assert analyse(system).rows(PLACES) == [
        (first, outer),
        (second, inner),
        (third, middle),
        (fourth, outer),
        (fifth, None),
    ]


def test_the_order_of_events_decides_where_times_are_equal(
    system: RosSystem, analyse: Analyse
) -> None:
    happen(system, ts=2_000)
    begin(system, 0xC1, ts=2_000)
    happen(system, ts=2_000)
    end(system, 0xC1, ts=2_000)
    happen(system, ts=2_000)
    assert analyse(system).rows(PLACES) == [(2_000, None), (2_000, 2_000), (2_000, None)]


def test_a_callback_that_is_not_seen_to_end_is_over_behind_a_gap(
    system: RosSystem, analyse: Analyse
) -> None:
    """Even if nothing but the user's own events comes after the gap."""
    system.add_packet(0, 1_500, last_event=1_400, discarded=5)
    system.add_packet(1_500, 3_000)
    start = begin(system, 0xC1, ts=1_200)
    happen(system, ts=1_300)
    happen(system, ts=2_000)
    happen(system, ts=2_100)
    model = analyse(system)
    assert model.rows(PLACES) == [(1_300, start), (2_000, None), (2_100, None)]
    assert marks(model) == [(True,), (False,), (False,)]


def test_a_callback_that_is_seen_to_end_is_not_affected_by_a_loss_after_it(
    system: RosSystem, analyse: Analyse
) -> None:
    begin(system, 0xC1)
    happen(system)
    end(system, 0xC1)
    assert marks(analyse(system)) == [(False,)]


@pytest.mark.thorough
def test_the_time_is_corrected_as_all_others(system: RosSystem, analyse: Analyse) -> None:
    happen(system, ts=2_000)
    model = analyse(system)
    model.connection.execute("UPDATE store.clock SET offset_ns = 500, method = 'file'")
    assert model.rows("SELECT at_ns FROM user_event") == [(2_500,)]


def test_a_publication_without_a_stamp_does_not_end_at_an_event_of_the_user(
    system: RosSystem, analyse: Analyse
) -> None:
    """It may be recorded in the middle of publishing, by a middleware that the user traces."""
    system.add("ros2:rcl_publish", MAIN, publisher_handle=0x10, message=0xA)
    happen(system)
    after = begin(system, 0xC1)
    rows = analyse(system).connection.execute("SELECT next_event_ns FROM store.publication")
    assert rows.fetchall() == [(after,)]
