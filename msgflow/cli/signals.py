"""Signal handling of the program: Ctrl-C, SIGTERM and SIGHUP end a command cleanly.

The first signal raises KeyboardInterrupt, so that the command can tidy up; during an import it ends
the process at once. Then all signals have their default action again: a second one ends the
process at once, as SIGKILL does. No database minds that.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from types import FrameType

from msgflow.errors import ExitCode
from msgflow.sql.interrupt import SIGNALS, Terminated


class SignalHandler:
    """The handler of all these signals.

    Attributes:
        came: exit code of the signal that came while the program ran; None without one.
    """

    # msgflow.sql.interrupt replaces such a handler while a statement runs.
    raises_interrupts = True

    def __init__(self) -> None:
        self.came: ExitCode | None = None

    def run(self, program: Callable[[], None]) -> None:
        """Run the program, and turn a signal into its exit code.

        A signal that the parent process ignores stays ignored.
        """
        self.came = None
        for number in SIGNALS:
            if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                signal.signal(number, self)
        sys.unraisablehook = _end_after_lost_signal
        try:
            program()
        except KeyboardInterrupt as error:
            from msgflow.cli.output import print_error

            code = _exit_code(type(error))
            print_error(code.name.lower())
            raise SystemExit(int(code)) from None
        finally:
            # The command is over and has said so: a signal cannot change its exit code any more.
            for number in SIGNALS:
                if signal.getsignal(number) is self:
                    signal.signal(number, signal.SIG_IGN)

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt, or Terminated for the others."""
        restore_default_actions()
        kind = KeyboardInterrupt if number == signal.SIGINT else Terminated
        if _is_importing(frame):
            # Code in C may lose an exception, and that of DuckDB would abort the process.
            self.end_process(kind)
        self.came = _exit_code(kind)
        raise kind

    def end_process(self, kind: type[KeyboardInterrupt]) -> None:
        """End the process at once, with the exit code of a signal."""
        code = _exit_code(kind)
        os.write(2, f"error: {code.name.lower()}\n".encode())
        os._exit(int(code))


def restore_default_actions() -> None:
    """Let each signal end the process at once from now on, unless it is ignored."""
    for number in SIGNALS:
        if signal.getsignal(number) is HANDLER:
            signal.signal(number, signal.SIG_DFL)


def _exit_code(kind: type[KeyboardInterrupt]) -> ExitCode:
    return ExitCode.TERMINATED if issubclass(kind, Terminated) else ExitCode.INTERRUPTED


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


def _end_after_lost_signal(unraisable: sys.UnraisableHookArgs) -> None:
    # Python prints an exception of a finalizer and goes on. Where it is that of a signal, the
    # default action of the signal follows.
    error = unraisable.exc_value
    if isinstance(error, KeyboardInterrupt):
        signal.raise_signal(signal.SIGTERM if isinstance(error, Terminated) else signal.SIGINT)
    sys.__unraisablehook__(unraisable)


HANDLER = SignalHandler()
