"""A terminal in which a command runs, and what it shows."""

from __future__ import annotations

import fcntl
import os
import pty
import struct
import subprocess
import termios
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from threading import Thread
from types import TracebackType

_SIZE = struct.pack("HHHH", 30, 100, 0, 0)


class Terminal:
    """A command in a terminal of 100 columns.

    Attributes:
        process: of the command.
        shown: all that the terminal got so far, with its control characters.
    """

    def __init__(self, words: Sequence[str], directory: Path) -> None:
        self._master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, _SIZE)
        self.process = subprocess.Popen(
            ["setsid", "--ctty", *words],
            cwd=directory,
            stdin=slave,
            stdout=slave,
            stderr=slave,
            env=os.environ | {"TERM": "xterm"},
        )
        os.close(slave)
        self.shown = ""
        self._reader = Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        # An error: all that wrote to the terminal have ended.
        try:
            while data := os.read(self._master, 65536):
                self.shown += data.decode(errors="replace")
        except OSError:
            pass

    def wait_for(self, is_so: Callable[[], bool], seconds: float = 60) -> None:
        end = time.monotonic() + seconds
        while not is_so():
            assert time.monotonic() < end, self.shown
            time.sleep(0.1)

    def press(self, key: str) -> None:
        os.write(self._master, key.encode())

    def wait(self) -> int:
        """Wait until the command ends, and return its exit code."""
        code = self.process.wait(120)
        self._reader.join(10)
        return code

    def __enter__(self) -> Terminal:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join(10)
        os.close(self._master)
