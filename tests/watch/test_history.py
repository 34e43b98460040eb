"""Borders and windows of chunks, without their events."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from msgflow.run.window import Window
from msgflow.watch.history import History
from msgflow.watch.kept_chunk import KeptChunk

ROBOT, LAPTOP = Path("robot"), Path("laptop")
STEP, WINDOW = 100, 300


def chunk(begin: int, end: int, source: Path = ROBOT) -> KeptChunk:
    return KeptChunk(
        source=source,
        path=source / f"{begin}",
        traces=(),
        events={},
        times_ns=np.empty(0, np.int64),
        packets=(),
        event_counts={},
        damages=(),
        begin_ns=begin,
        end_ns=end,
    )


def filled(*ends: int, window: int = WINDOW) -> History:
    """Return a history with a border at each end."""
    history = History(window, STEP)
    begin = 0
    for end in ends:
        history.add(chunk(begin, end))
        assert history.is_due
        history.add_border()
        begin = end
    return history


def test_a_window_is_final_once_the_next_border_has_come() -> None:
    assert filled(100).final_window() is None
    assert filled(100, 200).final_window() == Window(0, 100)
    assert filled(100, 200, 300, 400, 500).final_window() == Window(100, 400)
    assert filled(100, 200).final_window(is_last=True) == Window(0, 200)


def test_messages_that_take_longer_make_windows_wait() -> None:
    history = filled(100, 200, 300, 400)
    history.note_longest(150, 0)
    assert history.final_window() == Window(0, 200)
    assert [path.name for path in history.paths(Window(300, 400))] == ["100", "200", "300"]
    # No message is waited for longer than two windows.
    history.note_longest(10_000, 0)
    assert history.behind_ns == history.before_ns == 2 * WINDOW


def test_windows_wait_no_longer_once_messages_are_quick_again() -> None:
    history = filled(100)
    history.note_longest(250, 0)
    for begin in range(100, 700, 100):
        history.add(chunk(begin, begin + 100))
        history.add_border()
        assert history.behind_ns == 250
        history.note_longest(50, 0)
    assert history.behind_ns == 50


def test_data_that_nodes_keep_make_no_window_wait() -> None:
    history = filled(100, 200, 300, 400)
    history.note_longest(50, 250)
    assert history.final_window() == Window(0, 300)
    assert [path.name for path in history.paths(Window(300, 400))] == ["0", "100", "200", "300"]
    history.note_longest(50, 10_000)
    assert history.before_ns == 2 * WINDOW


def shown(history: History, *, is_last: bool = False) -> tuple[Window, bool] | None:
    """Return the next window as a view shows it."""
    found = history.next_window(is_live=True, is_last=is_last)
    if found is not None:
        history.note_shown(found[0], is_final=found[1])
    return found


def test_what_is_known_is_shown_while_messages_take_longer() -> None:
    history = filled(100, 200)
    assert shown(history) == (Window(0, 100), True)
    history.note_longest(350, 0)
    found = []
    for begin in range(200, 1_000, 100):
        history.add(chunk(begin, begin + 100))
        history.add_border()
        found.append(shown(history))
        assert shown(history) is None
    # A final one comes once in the length of a window, and begins where the last one ended.
    assert found == [
        (Window(0, 300), False),
        (Window(100, 400), False),
        (Window(200, 500), False),
        (Window(300, 600), False),
        (Window(400, 700), False),
        (Window(100, 400), True),
        (Window(600, 900), False),
        (Window(700, 1_000), False),
    ]
    assert history.judged_window(Window(700, 1_000)) == Window(400, 1_000)
    # Nobody waits for a recording that is finished.
    assert history.next_window(is_live=False) == (Window(300, 600), True)
    assert shown(history, is_last=True) == (Window(400, 1_000), True)
    assert shown(history, is_last=True) is None


def test_windows_as_short_as_steps_meet() -> None:
    """Rotations are never on time."""
    history = History(STEP, STEP)
    windows = []
    begin = 0
    for end in (97, 203, 295, 412, 498):
        history.add(chunk(begin, end))
        history.add_border()
        if (window := history.final_window()) is not None:
            windows.append(window)
            history.note_shown(window, is_final=True)
            history.forget(window)
        begin = end
    assert windows == [Window(0, 97), Window(97, 203), Window(203, 295), Window(295, 412)]


def test_a_window_leaves_out_nothing_where_steps_were_late() -> None:
    history = filled(100, 200)
    history.final_ns = 100
    for begin, end in ((200, 700), (700, 1_300)):
        history.add(chunk(begin, end))
    history.add_border()
    history.add(chunk(1_300, 1_400))
    history.add_border()
    assert history.final_window() == Window(100, 1_300)


def test_chunks_that_are_forgotten_are_named_once() -> None:
    history = filled(100, 200, 300, 400, 500, 600)
    assert [path.name for path in history.forget(Window(400, 500))] == ["0", "100", "200"]
    assert history.forget(Window(400, 500)) == []


def test_what_came_before_is_forgotten_later() -> None:
    history = filled(100, 200, 300, 400, 500, 600)
    window = Window(400, 500)
    assert [path.name for path in history.paths(window, earlier_ns=200)] == [
        "100", "200", "300", "400", "500",
    ]  # fmt: skip
    assert [path.name for path in history.forget(window, earlier_ns=200)] == ["0"]
    # The window itself needs no more than before.
    assert [path.name for path in history.paths(window)] == ["300", "400", "500"]
    assert [path.name for path in history.forget(window, earlier_ns=100)] == ["100"]


def test_a_host_is_waited_for_until_the_view_goes_on_without_it() -> None:
    history = filled(100)
    history.add(chunk(0, 100, LAPTOP))
    for begin in (100, 200, 300):
        history.add(chunk(begin, begin + 100))
    assert not history.is_due
    assert history.go_on_without(Path("one of which nothing could be read"))
    assert history.go_on_without(LAPTOP)
    assert history.is_due
    assert history.complete_ns == 400
    # Of the last host, the view does not go on alone.
    assert not history.go_on_without(ROBOT)
    assert history.complete_ns == 400


@pytest.mark.parametrize("ahead", [-100_000, 100_000])
def test_a_host_whose_clock_errs_leaves_nothing_behind(ahead: int) -> None:
    """Windows go on in the time of the others, none of them is longer than it should be."""
    history = History(WINDOW, STEP)
    for begin in (0, 100, 200, 300):
        history.add(chunk(begin + 100_000 + ahead, begin + 100_100 + ahead, LAPTOP))
        history.add(chunk(begin + 100_000, begin + 100_100))
        if history.is_due:
            history.add_border()
        if (window := history.final_window()) is not None:
            history.final_ns = window.end_ns
    history.leave_out(LAPTOP)
    windows = []
    for begin in (400, 500, 600):
        history.add(chunk(begin + 100_000, begin + 100_100))
        history.add_border()
        if (window := history.final_window()) is not None:
            windows.append(window)
            history.final_ns = window.end_ns
    assert [window.end_ns for window in windows][-2:] == [100_500, 100_600]
    assert windows[-1] == Window(100_300, 100_600) or ahead < 0
    assert history.last_event_ns == 100_700
    assert history.complete_ns == 100_700
    history.add_border(is_last=True)
    last = history.final_window(is_last=True)
    assert last is not None
    assert last.end_ns == 100_701
