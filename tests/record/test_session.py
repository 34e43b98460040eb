"""A session that records the kernel, without a kernel that can be recorded."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from msgflow.errors import RecordingError
from msgflow.record import session
from msgflow.record.lttng import Session
from msgflow.record.session import Channel, recording_session


def test_the_kernel_is_recorded_without_contexts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What ran at the events of a thread tells which thread of the kernel it is."""
    said: list[tuple[str, ...]] = []
    monkeypatch.setattr(session, "lttng", lambda *words: said.append(words))
    monkeypatch.setattr(session, "is_there", lambda name: True)
    of_kernel = ["sched_switch", "sched_waking"]
    channel = Channel(("ros2:*",), "1M", 4)
    with recording_session("robot", tmp_path, channel, of_kernel=of_kernel):
        pass
    assert [words[1] for words in said if words[0] == "enable-channel"] == [
        "--userspace",
        "--kernel",
    ]
    ((_, domain, *_, first, second, third),) = [w for w in said if w[0] == "add-context"]
    assert (domain, first, second, third) == (
        "--userspace",
        "--type=vpid",
        "--type=vtid",
        "--type=procname",
    )
    (events,) = (w[-1] for w in said if w[:2] == ("enable-event", "--kernel"))
    assert events == "sched_switch,sched_waking"
    assert [words[0] for words in said][-2:] == ["start", "destroy"]


def test_events_are_left_out_of_the_patterns_that_have_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[tuple[str, ...]] = []
    monkeypatch.setattr(session, "lttng", lambda *words: said.append(words))
    monkeypatch.setattr(session, "is_there", lambda name: True)
    channel = Channel(("ros2:*", "dds:*"), "1M", 4, without=("ros2:a", "ros2:b"))
    with recording_session("robot", tmp_path, channel):
        pass
    enabled = [words[3:] for words in said if words[0] == "enable-event"]
    assert [words[1:] for words in enabled] == [
        ("--exclude=ros2:a,ros2:b", "ros2:*"),
        ("dds:*",),
    ]


def test_a_pipe_in_the_directory_of_a_session_is_no_leftover(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.mkfifo(tmp_path / ".msgflow-record")
    monkeypatch.setattr(session, "sessions", lambda: [Session("theirs", tmp_path, False)])
    assert not session.remove_leftovers()


def test_a_session_created_anew_rotates_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """LTTng refuses only what is set already."""
    asked = 0

    def lttng(*words: str) -> None:
        nonlocal asked
        asked += words[0] == "enable-rotation"
        if asked == 2:
            raise RecordingError("lttng enable-rotation failed: already set", "another")

    monkeypatch.setattr(session, "lttng", lttng)
    with session.rotated("drive", 1) as go_on:
        go_on()
        go_on()
    assert asked == 3
