"""The program `lttng` and its session daemon, as tests of recordings see them."""

from __future__ import annotations

import subprocess
import time


def lttng(*words: str) -> subprocess.CompletedProcess[str]:
    command = ["lttng", "--no-sessiond", *words]
    return subprocess.run(command, capture_output=True, text=True)


def daemons() -> list[str]:
    """Return the numbers of session daemons, once those that end have ended."""
    end = time.monotonic() + 10
    while found := subprocess.run(
        ["pgrep", "-x", "-r", "D,R,S", "lttng-sessiond"], capture_output=True, text=True
    ).stdout.split():
        if time.monotonic() > end:
            break
        time.sleep(0.1)
    return found
