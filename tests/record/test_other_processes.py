"""Processes of others, whatever they are called, end no recording."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn

import pytest

from msgflow.errors import RecordingError
from msgflow.record import recording
from msgflow.record.lttng import ros_processes
from msgflow.record.session import Channel

# A name as prctl takes it: controls, and a byte that is not UTF-8.
LISTED = rb"""#!/bin/sh
printf '<command><pids><pid><id>7</id><name>a\033\377b</name>'
printf '<events><event><name>ros2:rcl_init</name></event></events></pid>'
printf '<pid><id>8</id><name>c</name><events><event><name>other:x</name></event></events></pid>'
printf '<pid><id>9</id><name>lttng-consumerd</name>'
printf '<events><event><name>ros2:rcl_init</name></event></events></pid>'
printf '</pids></command>'
"""


def test_any_name_can_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "lttng"
    program.write_bytes(LISTED)
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    assert ros_processes() == [("a\ufffd\ufffdb", 7)]


@pytest.mark.thorough
def test_what_cannot_be_read_is_a_note(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the start, and while it is recorded."""

    def fail(*_: object) -> NoReturn:
        raise RecordingError("cannot read what lttng list says: x", "lttng list")

    monkeypatch.setattr(recording, "ros_processes", fail)
    monkeypatch.setattr(recording, "losses", fail)
    notes: list[str] = []
    done = recording.record(
        tmp_path / "drive",
        name="other-processes",
        channel=Channel(("ros2:*",), "1M", 4),
        program=["sleep", "1.5"],
        note=notes.append,
        show=lambda _: None,
    )
    assert done.exit_code == 0
    assert done.last.seconds > 1
    assert [note.partition(":")[0] for note in notes] == [
        "it is not known what runs already",
        "not everything about the recording is known",
    ]
