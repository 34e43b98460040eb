"""Sessions that are watched: they rotate until they end, and what ends the view is said."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from msgflow.errors import RecordingError
from msgflow.record.lttng import Session
from msgflow.watch import watched_sessions
from msgflow.watch.watched_sessions import WatchedSessions

TRACES = Path("/traces")
ONE, TWO = (Session(name, TRACES / name, False) for name in ("one", "two"))
FOREIGN = Session("foreign", Path("/elsewhere"), False)


class Lttng:
    """Sessions as LTTng would have them, and what was done with them."""

    def __init__(self) -> None:
        self.sessions: list[Session] = []
        self.is_dead = False
        self.rotating: list[str] = []
        self.went_on: list[str] = []

    def list(self) -> list[Session]:
        if self.is_dead:
            raise RecordingError("lttng list failed: No session daemon is available")
        return self.sessions

    @contextmanager
    def rotated(self, name: str, length_ns: int) -> Iterator[Callable[[], None]]:
        if name == "refuses":
            raise RecordingError("lttng enable-rotation failed: it refuses")
        self.rotating.append(name)
        yield lambda: self.went_on.append(name)
        self.rotating.remove(name)


@pytest.fixture
def tracer(monkeypatch: pytest.MonkeyPatch) -> Lttng:
    tracer = Lttng()
    monkeypatch.setattr(watched_sessions, "sessions", tracer.list)
    monkeypatch.setattr(watched_sessions, "rotated", tracer.rotated)
    monkeypatch.setattr(watched_sessions, "_BETWEEN_LOOKS", 0)
    return tracer


def test_all_sessions_below_a_directory_rotate_until_the_last_ends(tracer: Lttng) -> None:
    tracer.sessions = [ONE, TWO, FOREIGN]
    notes: list[str] = []
    with WatchedSessions(TRACES, 1, notes.append) as watched:
        assert tracer.rotating == ["one", "two"]
        tracer.sessions = [TWO]
        assert [watched.are_over() for _ in range(4)] == [False] * 4
        assert tracer.went_on == ["two"] * 4
        tracer.sessions = []
        # The last chunk may come after its session has gone.
        assert [watched.are_over() for _ in range(2)] == [False, True]
    assert tracer.rotating == []
    assert notes == []


def test_a_session_that_comes_later_rotates_too(tracer: Lttng) -> None:
    notes: list[str] = []
    with WatchedSessions(TRACES, 1, notes.append) as watched:
        # A directory without a session may be that of lttng-relayd.
        assert [watched.are_over() for _ in range(3)] == [False] * 3
        refuses = Session("refuses", TRACES / "refuses", False)
        tracer.sessions = [ONE, refuses]
        assert [watched.are_over() for _ in range(2)] == [False] * 2
        assert tracer.rotating == ["one"]
        assert notes == [
            "session refuses cannot be watched: lttng enable-rotation failed: it refuses"
        ]


def test_a_session_that_cannot_rotate_is_an_error_at_first(tracer: Lttng) -> None:
    tracer.sessions = [Session("refuses", TRACES / "refuses", False)]
    with pytest.raises(RecordingError), WatchedSessions(TRACES, 1, lambda text: None):
        pass


def test_a_daemon_that_was_killed_is_said(tracer: Lttng) -> None:
    tracer.sessions = [ONE]
    notes: list[str] = []
    with WatchedSessions(TRACES, 1, notes.append) as watched:
        tracer.is_dead = True
        assert [watched.are_over() for _ in range(2)] == [False, True]
    (said,) = notes
    assert said.startswith("the view ends: lttng list failed: No session daemon is available")


def test_a_session_created_anew_elsewhere_is_said(tracer: Lttng) -> None:
    tracer.sessions = [ONE]
    notes: list[str] = []
    with WatchedSessions(TRACES / "one", 1, notes.append) as watched:
        tracer.sessions = [Session("one", TRACES / "one-anew", False)]
        assert [watched.are_over() for _ in range(2)] == [False, True]
    (said,) = notes
    assert "session one was created anew" in said
    assert "/traces/one-anew" in said
