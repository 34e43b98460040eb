"""Keys that somebody presses while a screen is shown."""

from __future__ import annotations

import os
import re
import select
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Thread

try:
    import termios
    import tty
except ImportError:  # Windows has no such terminals
    termios = None  # type: ignore[assignment]

# What terminals send: of a key that is held, several times at once.
_KEY = re.compile(r"\x1b[\[O][\d;]*[A-Za-z~]|.", re.DOTALL)
_NAMES = {"\x1b[A": "up", "\x1b[B": "down", "\x1bOA": "up", "\x1bOB": "down", "\x1b": "escape"}
_MOST_BYTES = 64


@contextmanager
def noted_keys(pressed: Callable[[str], None]) -> Iterator[None]:
    """Call a function with each key during the block, from a thread; Ctrl-C stays what it is.

    Without a terminal, and in the background, there are no keys.
    """
    if not _has_keys():
        yield
        return
    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    ended, end = os.pipe()
    thread = Thread(target=_read, args=(terminal, ended, pressed))
    try:
        # At once, and not shown.
        tty.setcbreak(terminal, termios.TCSADRAIN)
        thread.start()
        yield
    finally:
        os.close(end)
        if thread.is_alive():
            thread.join()
        os.close(ended)
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def _has_keys() -> bool:
    if termios is None or sys.stdin is None or not sys.stdin.isatty():
        return False
    try:
        # Another program has the terminal if this one was started with &.
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except OSError:
        # It controls another session, or none.
        return False


def _read(terminal: int, ended: int, pressed: Callable[[str], None]) -> None:
    while True:
        ready, _, _ = select.select([terminal, ended], [], [])
        if ended in ready or not (sent := os.read(terminal, _MOST_BYTES)):
            return
        for key in _KEY.findall(sent.decode(errors="replace")):
            pressed(_NAMES.get(key, key))
