"""Keys on the screen of `msgflow watch`, in a terminal."""

from __future__ import annotations

import os
import pty
import re
import select
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

LONGEST = 60.0


class Terminal:
    """A terminal of 80 columns, and a program in it."""

    def __init__(self, *command: str) -> None:
        self.pid, self.side = pty.fork()
        if self.pid == 0:
            os.environ |= {"TERM": "xterm", "COLUMNS": "80", "LINES": "40"}
            os.execv(command[0], command)
        self.before = termios.tcgetattr(self.side)

    def press(self, keys: bytes) -> None:
        os.write(self.side, keys)

    def wait_for(self, text: str) -> str:
        """Read until a text was shown, and return all that was shown, without colours."""
        shown = b""
        end = time.monotonic() + LONGEST
        while time.monotonic() < end:
            if select.select([self.side], [], [], 0.2)[0]:
                shown += os.read(self.side, 65536)
            plain = re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", shown.decode(errors="replace"))
            if text in plain:
                return plain
        raise AssertionError(f"{text!r} was not shown, but: {plain}")

    def end(self) -> int:
        self.press(b"\x03")
        _, status = os.waitpid(self.pid, 0)
        return os.waitstatus_to_exitcode(status)


@pytest.fixture
def terminal(shared_traces: Path) -> Iterator[Terminal]:
    """A directory is watched whose recording has ended: its last window stays."""
    directory = str(shared_traces / "real_rotate")
    started = Terminal(sys.executable, "-m", "msgflow", "watch", directory)
    yield started
    os.close(started.side)


def test_keys_sort_and_pick_a_path(terminal: Terminal) -> None:
    terminal.wait_for("missing▾")
    terminal.press(b"s")
    terminal.wait_for("max▾")
    # Of a key that is held, several come at once.
    terminal.press(b"sss\x1b[B\x1b[B")
    shown = terminal.wait_for("flows: ")
    assert "p99▾" in shown
    assert "/s▾" in shown
    # Other keys do nothing, and Ctrl-C ends the view.
    terminal.press(b"z")
    assert terminal.end() == 0
    # What is typed next is shown again.
    assert termios.tcgetattr(terminal.side) == terminal.before


@pytest.mark.thorough
def test_a_terminal_that_controls_no_session_has_no_keys(shared_traces: Path) -> None:
    side, other = pty.openpty()
    directory = str(shared_traces / "real_rotate")
    length = ("--window", "8s", "--step", "8s")
    command = [sys.executable, "-m", "msgflow", "watch", "--once", *length, directory]
    with subprocess.Popen(command, stdin=other, stdout=other, start_new_session=True) as run:
        os.close(other)
        # The terminal fails when its program has ended.
        with suppress(OSError):
            while os.read(side, 65536):
                pass
    os.close(side)
    assert run.returncode == 0
