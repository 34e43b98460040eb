"""What the kernel's scheduler does, recorded with `perf` where LTTng has no kernel modules."""

from __future__ import annotations

import shlex
import shutil
import signal
import subprocess
import tempfile
from contextlib import contextmanager
from typing import TYPE_CHECKING

from msgflow.record.daemon import started
from msgflow.record.kernel_events import PERF_EVENTS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

# The clock of LTTng; pages of memory of each CPU.
_RECORD = ("perf", "record", "--all-cpus", "--clockid=CLOCK_MONOTONIC", "--mmap-pages=8192")
_TRACE = "perf"


def why_perf_cannot_record() -> str | None:
    """Return why perf cannot record the scheduler here; None where it can."""
    if shutil.which("perf") is None:
        return "perf is not installed (apt-get install linux-perf)"
    with tempfile.NamedTemporaryFile(prefix="msgflow-") as target:
        trial = _command(target.name)
        run = subprocess.run([*trial, "--", "true"], capture_output=True, text=True)
    if run.returncode:
        lines = [line for line in run.stderr.splitlines() if line.strip(" :")]
        return f"perf may not: {lines[-1].strip()}" if lines else "perf fails"
    return None


@contextmanager
def recorded_with_perf(directory: Path, note: Callable[[str], None]) -> Iterator[None]:
    """Record the scheduler during the block, as a CTF trace below the directory."""
    data = directory / "perf.data"
    with tempfile.TemporaryFile("w+") as words:
        perf = started([*_command(str(data)), "--quiet"], words, end="INT")
        try:
            yield
        finally:
            ended_early = perf.poll() is not None
            perf.send_signal(signal.SIGINT)
            perf.wait()
        words.seek(0)
        if ended_early:
            note(f"perf ended before the recording{_reason(words.read())}")
    trace = directory / _TRACE
    convert = ["perf", "data", "convert", f"--to-ctf={trace}", f"--input={data}"]
    run = subprocess.run(convert, capture_output=True, text=True, start_new_session=True)
    if run.returncode:
        shutil.rmtree(trace, ignore_errors=True)
        note(
            f"what perf recorded of the scheduler is not read: {shlex.join(convert)}"
            f" failed{_reason(run.stderr)}"
        )
    else:
        data.unlink()


def _reason(printed: str) -> str:
    lines = printed.strip().splitlines()
    return f": {lines[-1].strip()}" if lines else ""


def _command(target: str) -> list[str]:
    return [*_RECORD, *(f"--event={name}" for name in PERF_EVENTS), f"--output={target}"]
