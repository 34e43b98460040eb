"""`msgflow watch`: each word has one meaning, and what has none is an error with a remedy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

from msgflow.errors import ExitCode, RecordingError, TraceError
from msgflow.record.lttng import Session
from msgflow.watch import watched_sessions

Msgflow = Callable[..., Result]
DRIVE = Session("drive", Path("/traces/drive"), False)
OTHER = Session("other", Path("/traces/other"), False)
SNAPSHOT = Session("snap", None, True)
REMOTE = Session("remote", None, False)


@pytest.fixture
def there_are(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Says which sessions LTTng has; without any call it has none."""

    def have(*sessions: Session) -> None:
        monkeypatch.setattr(watched_sessions, "sessions", lambda: list(sessions))

    have()
    return have


@pytest.fixture(autouse=True)
def _nothing_starts(monkeypatch: pytest.MonkeyPatch, there_are: object) -> None:
    def fail(*_: object, **__: object) -> None:
        raise AssertionError("a program is started")

    monkeypatch.setattr("msgflow.record.recording.record", fail)


def refused(result: Result, *words: str) -> None:
    assert result.exit_code == ExitCode.USAGE, result.stderr
    said = " ".join(result.stderr.split())
    for word in words:
        assert word in said


def test_a_word_is_no_program(msgflow: Msgflow, there_are: Callable[..., None]) -> None:
    """A program stands behind `--` only."""
    there_are(DRIVE)
    remedy = "msgflow watch -- sleep starts, records and watches a program"
    refused(msgflow("watch", "sleep"), "no session and no directory of this name — sleep", remedy)
    refused(msgflow("watch", "drve"), "— drve", "did you mean drive")
    refused(msgflow("watch", "sleep", "5"), "not 2 — sleep 5", "msgflow watch -- sleep 5 starts")


@pytest.mark.parametrize(
    ("session", "reason", "remedy"),
    [
        (SNAPSHOT, "a snapshot session", "lttng create, without --snapshot"),
        (REMOTE, "over the network", "msgflow watch DIR there, with the directory of lttng-relayd"),
    ],
)
def test_a_session_that_cannot_be_watched(
    msgflow: Msgflow,
    there_are: Callable[..., None],
    session: Session,
    reason: str,
    remedy: str,
) -> None:
    there_are(DRIVE, session)
    refused(msgflow("watch", session.name), reason, f"— {session.name}", remedy)


def test_once_reads_one_directory(msgflow: Msgflow, tmp_path: Path) -> None:
    refused(msgflow("watch", "--once", tmp_path, "b"), f"not 2 — {tmp_path} b", "above")
    refused(msgflow("watch", "--once", "--", "sleep"), "--once", "msgflow watch -- sleep")
    refused(msgflow("watch", "--once"), "--once needs a directory", "msgflow watch --once DIR")
    missing = msgflow("watch", "--once", "nothing")
    assert missing.exit_code == ExitCode.TRACE
    assert "no such directory — nothing" in missing.stderr


def test_windows_wait_for_two_steps_unless_late_says_more(
    msgflow: Msgflow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits = []

    def made(**given: Any) -> None:
        waits.append(given["late_ns"])
        raise TraceError("enough", "no more")

    monkeypatch.setattr("msgflow.watch.watcher.Watcher", made)
    lates = ((), ("--step", "3s"), ("--step", "3s", "--late", "500ms"), ("--late", "0"))
    for words in lates:
        assert msgflow("watch", "--once", tmp_path, *words).exit_code == ExitCode.TRACE
    assert waits == [4_000_000_000, 6_000_000_000, 500_000_000, 0]
    refused(msgflow("watch", "--late", "soon"), "cannot read the duration of --late — soon")


def test_a_program_is_watched_alone(msgflow: Msgflow, tmp_path: Path) -> None:
    refused(msgflow("watch", tmp_path, "--", "sleep", "5"), "msgflow watch -- sleep 5")
    refused(msgflow("watch", tmp_path, "-o", "kept"), "-o", "msgflow watch -o kept -- COMMAND")


def test_behind_two_dashes_all_belongs_to_the_program(
    msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch
) -> None:
    started = []
    monkeypatch.setattr("msgflow.cli.watch._record", lambda words, *_, **__: started.append(words))
    assert msgflow("watch", "--json", "--", "env", "--", "sleep", "--once").exit_code == 0
    assert started == [["env", "--", "sleep", "--once"]]


def test_without_a_word_the_only_session_is_watched(
    msgflow: Msgflow, there_are: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    watched = []
    monkeypatch.setattr(
        "msgflow.watch.follow.watch_live", lambda place, *_, **__: watched.append(place) or iter(())
    )
    monkeypatch.setattr("msgflow.watch.watched_sessions.WatchedSessions", lambda *_: _Nothing())
    there_are(DRIVE, SNAPSHOT)
    assert msgflow("watch").exit_code == 0
    assert watched == [DRIVE.directory]
    there_are(DRIVE, OTHER, SNAPSHOT)
    refused(msgflow("watch"), "several sessions — drive, other", "msgflow watch drive")
    there_are(SNAPSHOT)
    refused(msgflow("watch"), "no session that can be watched", "msgflow watch -- COMMAND")


class _Nothing:
    """No sessions."""

    def __enter__(self) -> _Nothing:
        return self

    def __exit__(self, *error: object) -> None:
        pass


def test_without_a_daemon_its_absence_is_the_reason(
    msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> list[Session]:
        raise RecordingError("lttng list failed: No session daemon is available")

    monkeypatch.setattr(watched_sessions, "sessions", fail)
    refused(msgflow("watch"), "No session daemon is available", "msgflow watch DIR")
    refused(msgflow("watch", "drive"), "— drive", "No session daemon is available")
