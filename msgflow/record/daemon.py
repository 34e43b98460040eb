"""The session daemon of LTTng: the one that runs, or one of our own for as long as we record."""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import IO

from msgflow.errors import RecordingError
from msgflow.record.lttng import is_daemon_running, sessions
from msgflow.sql.interrupt import noted_interrupts

_LONGEST_START = 10.0
_LONGEST_END = 20.0
_BETWEEN_LOOKS = 0.1
# Processes that run already connect to a new daemon in this time.
_CONNECTING = 1.0


@contextmanager
def session_daemon(*, with_kernel: bool, note: Callable[[str], None]) -> Iterator[None]:
    """Have a session daemon: one that runs is used and stays; else one runs during the block.

    Ours waits for the end of sessions that others began. SIGKILL of this process ends it at once.
    """
    if is_daemon_running():
        yield
        return
    command = ["lttng-sessiond", *([] if with_kernel else ["--no-kernel"])]
    with tempfile.TemporaryFile("w+") as words:
        daemon = started(command, words)
        try:
            _wait_until_it_answers(daemon, words)
            time.sleep(_CONNECTING)
            try:
                yield
            finally:
                # We do not wait for a daemon that does not answer.
                with suppress(RecordingError):
                    _wait_for_others(note)
        finally:
            daemon.terminate()
            try:
                daemon.wait(_LONGEST_END)
            except subprocess.TimeoutExpired:
                daemon.kill()


def started(
    command: list[str], words: IO[str], end: str = "TERM", *, pass_fds: Sequence[int] = ()
) -> subprocess.Popen[str]:
    """Start a program that gets the signal `end` when this process ends, however it ends."""
    try:
        # A group of its own: Ctrl-C of the terminal is not for it.
        return subprocess.Popen(
            ["setpriv", "--pdeathsig", end, *command],
            stdin=subprocess.DEVNULL,
            stdout=words,
            stderr=words,
            text=True,
            start_new_session=True,
            pass_fds=pass_fds,
        )
    except FileNotFoundError:
        raise RecordingError("setpriv is not installed", "apt-get install util-linux") from None


def _wait_for_others(note: Callable[[str], None]) -> None:
    if others := sessions():
        names = ", ".join(session.name for session in others)
        note(f"other sessions use the session daemon that was started here; it waits for: {names}")
        with noted_interrupts() as interrupts:
            while sessions():
                interrupts.check()
                time.sleep(_BETWEEN_LOOKS)


def _wait_until_it_answers(daemon: subprocess.Popen[str], words: IO[str]) -> None:
    end = time.monotonic() + _LONGEST_START
    while time.monotonic() < end and daemon.poll() is None:
        if is_daemon_running():
            return
        time.sleep(_BETWEEN_LOOKS)
    if daemon.poll() is None:
        reason = f"it does not answer after {_LONGEST_START:.0f} s"
    else:
        words.seek(0)
        said = words.read().strip().splitlines()
        reason = said[-1].removeprefix("Error: ") if said else f"exit code {daemon.returncode}"
    raise RecordingError(
        f"the session daemon of LTTng does not start: {reason}",
        "lttng-sessiond -vvv shows why; it needs a home directory it can write to ($LTTNG_HOME)",
    )
