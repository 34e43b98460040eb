"""`perf record`: whether it may here, and a recording of it beside ours."""

from __future__ import annotations

import shutil
import signal
import socket
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from msgflow.record.daemon import started

# The clock of LTTng.
_RECORD = ("perf", "record", "--clockid=CLOCK_MONOTONIC")
_LONGEST_START = 10.0


def why_not(options: Sequence[str]) -> str | None:
    """Return why perf cannot record so; None where it can."""
    if shutil.which("perf") is None:
        return "perf is not installed (apt-get install linux-perf)"
    with tempfile.NamedTemporaryFile(prefix="msgflow-") as target:
        trial = [*_RECORD, *options, f"--output={target.name}", "--", "true"]
        run = subprocess.run(trial, capture_output=True, text=True)
    if run.returncode:
        lines = [line for line in run.stderr.splitlines() if line.strip(" :")]
        return f"perf may not: {lines[-1].strip()}" if lines else "perf fails"
    return None


@contextmanager
def recorded(data: Path, options: Sequence[str], note: Callable[[str], None]) -> Iterator[None]:
    """Have perf record into a file during the block."""
    # Both ends of what perf takes commands from.
    ours, of_perf = socket.socketpair()
    ours.settimeout(_LONGEST_START)
    with tempfile.TemporaryFile("w+") as words, ours, of_perf:
        place = of_perf.fileno()
        control = f"--control=fd:{place},{place}"
        command = [*_RECORD, *options, control, f"--output={data}", "--quiet"]
        perf = started(command, words, end="INT", pass_fds=(place,))
        of_perf.close()
        try:
            # It answers when it samples: what starts before is not sampled.
            with suppress(OSError):
                ours.sendall(b"enable\n")
                ours.recv(8)
            yield
        finally:
            ended_early = perf.poll() is not None
            perf.send_signal(signal.SIGINT)
            perf.wait()
        words.seek(0)
        if ended_early:
            note(f"perf ended before the recording{reason(words.read())}")


def reason(printed: str) -> str:
    """Return the last line that a program printed, to stand behind a sentence."""
    lines = printed.strip().splitlines()
    return f": {lines[-1].strip()}" if lines else ""
