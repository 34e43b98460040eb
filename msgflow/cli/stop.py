"""What SIGINT (Ctrl-C) and SIGTERM do to the program, from its first line to its last.

While a command runs, the first of them raises KeyboardInterrupt, so that the command can tidy up.
At any other moment, and the second time, there is nothing that could catch an exception: the
process ends at once, as with SIGKILL, which no database minds.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import sys
import threading
from typing import TYPE_CHECKING

from msgflow.errors import ExitCode
from msgflow.sql.interrupt import Terminated

if TYPE_CHECKING:
    from types import FrameType

# Until a signal is raised again that came at a moment at which it cannot be dealt with.
_PATIENCE_S = 0.02

_WORDS = {ExitCode.INTERRUPTED: b"interrupted", ExitCode.TERMINATED: b"terminated"}


class Stop:
    """The handler of both signals."""

    raises_interrupts = True

    def __init__(self) -> None:
        self._is_command_running = False
        self._came: ExitCode | None = None
        self._end: ExitCode | None = None

    def install(self) -> None:
        """Handle both signals, but what whoever started the process wants ignored."""
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                signal.signal(number, self)
        sys.unraisablehook = self._on_lost
        # Called last. Behind it Python would give the signals their default action back.
        atexit.register(self._ignore)

    def begin(self) -> None:
        """From here an exception is caught: by `RootGroup.main`."""
        self._came, self._end = None, None
        self._is_command_running = True

    def cease(self) -> None:
        """From here no exception is caught."""
        self._is_command_running = False

    def end_with(self, code: int) -> None:
        """The command is over and has said so: a signal cannot change its exit code any more."""
        self._end = ExitCode(code)

    @property
    def came(self) -> ExitCode | None:
        """Exit code of the signal that came while the command ran, or None."""
        return self._came

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Raise, or end the process."""
        if _is_importing_duckdb(frame):
            again = threading.Timer(_PATIENCE_S, signal.raise_signal, [number])
            again.daemon = True
            again.start()
            return
        code = ExitCode.TERMINATED if number == signal.SIGTERM else ExitCode.INTERRUPTED
        if not self._is_command_running or self._came is not None:
            self._leave(code)
        self._came = code
        raise Terminated if number == signal.SIGTERM else KeyboardInterrupt

    def _leave(self, code: ExitCode) -> None:
        if self._end is not None:
            os._exit(self._end)
        # A progress bar hides the cursor.
        shown = b"\x1b[?25h" if os.isatty(2) else b""
        with contextlib.suppress(OSError):  # stderr is closed
            os.write(2, shown + b"error: " + _WORDS[code] + b"\n")
        os._exit(code)

    def _on_lost(self, unraisable: sys.UnraisableHookArgs) -> None:
        # Raised inside of a finalizer, where Python prints an exception and goes on.
        if self._came is not None and isinstance(unraisable.exc_value, KeyboardInterrupt):
            self._leave(self._came)
        sys.__unraisablehook__(unraisable)

    def _ignore(self) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is self:
                signal.signal(number, signal.SIG_IGN)


def _is_importing_duckdb(frame: FrameType | None) -> bool:
    """Tell whether its C++ code is being set up, which aborts the process at any exception."""
    while frame is not None:
        if frame.f_code.co_name == "<module>" and frame.f_globals.get("__name__") == "duckdb":
            return True
        frame = frame.f_back
    return False


STOP = Stop()
