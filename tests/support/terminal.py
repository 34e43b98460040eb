"""A terminal in which a command runs, and what it shows."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import struct
import subprocess
import termios
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType

_SIZE = struct.pack("HHHH", 30, 100, 0, 0)


class Terminal:
    """A command in a terminal of 100 columns.

    Attributes:
        process: of the command.
        shown: all that the terminal got so far, with its control characters.
    """

    def __init__(self, words: Sequence[str], directory: Path, **environment: str) -> None:
        master, slave = pty.openpty()
        self._master = os.fdopen(master, "rb", buffering=0)
        fcntl.ioctl(slave, termios.TIOCSWINSZ, _SIZE)
        self.process = subprocess.Popen(
            ["setsid", "--ctty", *words],
            cwd=directory,
            stdin=slave,
            stdout=slave,
            stderr=slave,
            env=os.environ | {"TERM": "xterm"} | environment,
        )
        os.close(slave)
        self.shown = ""

    def wait_for(self, is_so: Callable[[], bool], seconds: float = 60) -> None:
        end = time.monotonic() + seconds
        while not is_so():
            assert time.monotonic() < end, self.shown
            if select.select([self._master], [], [], 0.1)[0]:
                try:
                    self.shown += self._master.read(65536).decode(errors="replace")
                except OSError:  # all that wrote to the terminal have ended
                    time.sleep(0.1)

    def wait(self) -> int:
        """Wait until the command ends, and return its exit code."""
        self.wait_for(lambda: self.process.poll() is not None, 120)
        return self.process.wait()

    def hang_up(self) -> None:
        """Go away, as the terminal of a connection that is lost."""
        self._master.close()

    def __enter__(self) -> Terminal:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        # All of its session: nothing is left running where the test failed.
        subprocess.run(["pkill", "-KILL", "-s", str(self.process.pid)], check=False)
        self.process.kill()
        self.process.wait()
        self.hang_up()
