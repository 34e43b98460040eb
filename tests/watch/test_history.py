"""Borders and windows of chunks, without their events."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from msgflow.run.window import Window
from msgflow.watch import history as history_module
from msgflow.watch.history import History
from msgflow.watch.kept_chunk import KeptChunk

ROBOT, LAPTOP = Path("robot"), Path("laptop")
STEP, WINDOW, LATE = 100, 300, 150


def chunk(begin: int, end: int, source: Path = ROBOT) -> KeptChunk:
    """Return a chunk with an event each tenth of a step."""
    return KeptChunk(
        source=source,
        path=source / f"{begin}",
        traces=(),
        events={},
        times_ns=np.arange(begin, end, STEP // 10),
        packets=(),
        event_counts={},
        damages=(),
        begin_ns=begin,
        end_ns=end,
    )


def filled(*ends: int, window: int = WINDOW) -> History:
    """Return a history of chunks with these ends."""
    history = History(window, STEP, LATE)
    for begin, end in zip((0, *ends), ends, strict=False):
        history.add(chunk(begin, end))
    return history


def closed(history: History, *, is_last: bool = False) -> Window | None:
    """Close the next window."""
    window = history.next_window(history.newest_ns, is_last=is_last)
    if window is not None:
        history.close(window)
    return window


def test_a_window_is_closed_once_the_newest_time_is_late_enough() -> None:
    assert closed(filled(249)) is None
    assert closed(filled(250)) == Window(0, 100)
    assert closed(filled(349)) == Window(0, 100)
    history = filled(100, 250)
    assert closed(history) == Window(0, 100)
    assert closed(history) is None
    assert closed(history, is_last=True) == Window(0, 251)
    assert History(WINDOW, STEP, LATE).next_window(1_000) is None


@pytest.mark.parametrize("window", [STEP, STEP // 2, WINDOW])
def test_a_window_leaves_out_nothing(window: int) -> None:
    """Rotations are never on time, and steps may be late; each moment is in a window."""
    history = History(window, STEP, LATE)
    windows = []
    begin = 0
    for end in (97, 203, 295, 412, 498, 1_017, 1_099, 1_230):
        history.add(chunk(begin, end))
        windows.append(closed(history))
        begin = end
    windows.append(closed(history, is_last=True))
    found = [each for each in windows if each is not None]
    assert [each.end_ns for each in found] == [100, 200, 300, 800, 900, 1_000, 1_231]
    assert found[0].start_ns == 0
    for before, after in pairwise(found):
        usual_ns = -(-after.end_ns // STEP) * STEP - window
        assert after.start_ns == max(min(before.end_ns, usual_ns), 0)


def test_what_comes_too_late_is_counted() -> None:
    history = filled(100, 200, 300)
    assert closed(history) == Window(0, 100)
    # Within what is waited for, and a part of it too late, and all of it.
    assert history.add(chunk(100, 200, LAPTOP)) == 0
    assert history.add(chunk(60, 160, LAPTOP)) == 4
    assert history.add(chunk(0, 100, LAPTOP)) == 10


def test_a_source_that_stops_is_not_waited_for() -> None:
    history = filled(100)
    history.add(chunk(0, 100, LAPTOP))
    for begin in (100, 200, 300):
        history.add(chunk(begin, begin + 100))
    assert history.ends_ns == {ROBOT: 400, LAPTOP: 100}
    assert closed(history) == Window(0, 200)


def test_what_was_recorded_long_before_is_skipped() -> None:
    history = filled(*range(100, 1_300, 100))
    assert [path.name for path in history.skip_old(earlier_ns=100)] == ["0", "100", "200", "300"]
    assert history.skip_old(earlier_ns=100) == []
    assert [path.name for path in history.skip_old()] == ["400"]
    assert closed(history) == Window(700, 1_000)
    assert history.skip_old() == []
    # Of a recording that has just begun, nothing is.
    history = filled(100, 250)
    assert history.skip_old() == []
    assert closed(history) == Window(0, 100)


def test_as_much_as_may_be_late_is_kept_from_before_a_window() -> None:
    history = filled(100, 200, 300, 400, 500, 600)
    window = Window(400, 500)
    assert [path.name for path in history.paths(window)] == ["200", "300", "400", "500"]
    assert [path.name for path in history.forget(window)] == ["0", "100"]
    assert history.forget(window) == []


def test_what_came_before_is_forgotten_later() -> None:
    history = filled(100, 200, 300, 400, 500, 600)
    window = Window(400, 500)
    assert [path.name for path in history.paths(window, earlier_ns=100)] == [
        "100",
        "200",
        "300",
        "400",
        "500",
    ]
    assert [path.name for path in history.close(window, earlier_ns=100)] == ["0"]
    # The window itself needs no more than before.
    assert [path.name for path in history.paths(window)] == ["200", "300", "400", "500"]
    assert [path.name for path in history.forget(window)] == ["100"]


def test_a_clock_that_is_ahead_need_not_count_as_the_newest() -> None:
    history = History(WINDOW, STEP, LATE)
    history.add(chunk(0, 100))
    assert history.newest_without({ROBOT}) == 100
    history.add(chunk(300, 400, LAPTOP))
    assert (history.newest_ns, history.newest_without({LAPTOP})) == (400, 100)


@pytest.mark.parametrize("ahead", [-100_000, 100_000])
def test_a_host_whose_clock_errs_leaves_nothing_behind(ahead: int) -> None:
    """Windows go on in the time of the others, none of them is longer than it should be."""
    history = History(WINDOW, STEP, LATE)
    for begin in range(100_000, 100_400, 100):
        history.add(chunk(begin + ahead, begin + ahead + 100, LAPTOP))
        history.skip_old()
        history.add(chunk(begin, begin + 100))
        history.skip_old()
        closed(history)
    history.leave_out(LAPTOP)
    windows = []
    for begin in range(100_400, 101_000, 100):
        assert history.add(chunk(begin, begin + 100)) == 0
        history.skip_old()
        windows.append(closed(history))
    assert windows[-2:] == [Window(100_400, 100_700), Window(100_500, 100_800)]
    assert all(each is None or each.end_ns - each.start_ns <= WINDOW for each in windows)
    assert history.last_event_ns == 100_990
    assert history.newest_ns == 101_000
    last = closed(history, is_last=True)
    assert last is not None
    assert last.end_ns == 101_001
    # The last host is never left out.
    history.leave_out(ROBOT)
    assert history.newest_ns == 101_000


def test_a_step_of_many_events_is_a_window_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(history_module, "_MOST_EVENTS", 25)
    history = filled(250, 600)
    # Before the first window, `skip_old` bounds it.
    assert not history.is_full(600)
    history = filled(250)
    assert closed(history) == Window(0, 100)
    history.add(chunk(250, 400))
    assert not history.is_full(400)
    history.add(chunk(400, 550))
    assert history.is_full(550)
    # Of another source, less is known.
    assert not history.is_full(450)
    assert closed(history) == Window(100, 400)
    history.add(chunk(550, 700))
    assert not history.is_full(700)
