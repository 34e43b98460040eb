"""The program that a user records: it runs beside the recording, and ends with it."""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import IO

from msgflow.errors import UsageError

# Seconds after each signal; `ros2 launch` itself waits so long for its nodes.
_PATIENCE = ((signal.SIGINT, 10.0), (signal.SIGTERM, 5.0), (signal.SIGKILL, 5.0))
_BETWEEN_LOOKS = 0.05


class Program:
    """A program with all that it starts, as a group of processes.

    The group is its own, so that Ctrl-C of the terminal reaches it after the recording has stopped.
    """

    def __init__(
        self,
        words: Sequence[str],
        output: IO[bytes] | None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """Start it, with our environment if that is None.

        `output` gets what it prints. If that is None, our stderr does, since our stdout is for
        data.
        """
        self._name = words[0]
        require_program(words[0])
        # A stderr that is closed is None.
        stream = output or sys.__stderr__ or subprocess.DEVNULL
        # While its output goes to a file, the terminal has a screen, which has the keys.
        keys = None if output is None else subprocess.DEVNULL
        try:
            self._process = subprocess.Popen(
                list(words),
                stdin=keys,
                stdout=stream,
                stderr=stream,
                start_new_session=True,
                env=environment,
            )
        except OSError as error:
            raise UsageError(
                f"cannot execute {words[0]}: {(error.strerror or str(error)).lower()}",
                f"msgflow record -- sh {shlex.quote(words[0])}, if it is a script without a first"
                " line #!",
            ) from None

    @property
    def exit_code(self) -> int | None:
        """Exit code; negative: the signal that ended it; None while it runs."""
        return self._process.poll()

    def end(self, note: Callable[[str], None]) -> None:
        """Ask the group to end, as Ctrl-C does, then with more force; KeyboardInterrupt kills it.

        A shell starts its background processes so that they ignore Ctrl-C: they need the force.
        """
        try:
            for number, seconds in _PATIENCE:
                end = time.monotonic() + seconds
                if not self._send(number):
                    return
                while time.monotonic() < end:
                    # Collects the first process: a group has it until then.
                    self._process.poll()
                    if not self._send(0):
                        return
                    time.sleep(_BETWEEN_LOOKS)
        except PermissionError:
            note(
                f"{self._name} runs on, as it belongs to another user: sudo kill -INT --"
                f" -{self._process.pid}"
            )
        except KeyboardInterrupt:
            with suppress(PermissionError):
                self._send(signal.SIGKILL)
            raise

    def _send(self, number: int) -> bool:
        """Send a signal, 0 for none, to all of the group, and tell whether there is one."""
        try:
            os.killpg(self._process.pid, number)
        except ProcessLookupError:
            return False
        return True


def require_program(name: str) -> None:
    """Refuse a program that the shell would not find."""
    if shutil.which(name) is None:
        raise UsageError(
            f"there is no such program — {name}", "name it as in a shell, with its path"
        )
