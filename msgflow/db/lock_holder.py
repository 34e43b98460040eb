"""Holders of locks: which process has a file."""

from __future__ import annotations

import contextlib
import os
import shlex
from pathlib import Path

_LOCKS = Path("/proc/locks")
# Of a command; the rest says nothing new.
_MOST_CHARACTERS = 99


def lock_holder(path: Path) -> str:
    """Return ' (process ID: COMMAND)' of a process that has a lock on a file; '' if unknown."""
    with contextlib.suppress(OSError, ValueError):
        status = path.stat()
        device = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}"
        for line in _LOCKS.read_text(encoding="ascii").splitlines():
            words = line.split()
            # 'NUMBER: KIND ADVISORY MODE PROCESS FILE BEGIN END'; '->' stands before who waits.
            if words[5:6] == [f"{device}:{status.st_ino}"] and int(words[4]) > 0:
                return f" (process {words[4]}{_command(int(words[4]))})"
    return ""


def _command(process: int) -> str:
    with contextlib.suppress(OSError):
        words = Path(f"/proc/{process}/cmdline").read_bytes().decode(errors="replace")
        text = shlex.join(words.rstrip("\0").split("\0"))
        if len(text) > _MOST_CHARACTERS:
            text = f"{text[: _MOST_CHARACTERS - 1]}…"
        return f": {text}"
    return ""
