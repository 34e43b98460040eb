"""The program `lttng` and its session daemon, as tests of recordings see them."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass
class Ended:
    """A command that is over."""

    exit_code: int
    out: str
    err: str


Record = Callable[..., Ended]


def lttng(*words: str) -> subprocess.CompletedProcess[str]:
    command = ["lttng", "--no-sessiond", *words]
    return subprocess.run(command, capture_output=True, text=True)


def daemons() -> list[str]:
    """Return the numbers of this user's session daemons, once those that end have ended."""
    end = time.monotonic() + 10
    while found := subprocess.run(
        ["pgrep", "-x", "-r", "D,R,S", "-u", str(os.geteuid()), "lttng-sessiond"],
        capture_output=True,
        text=True,
    ).stdout.split():
        if time.monotonic() > end:
            break
        time.sleep(0.1)
    return found


def free_port() -> int:
    """Return a port of this machine that nobody listens on."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])
