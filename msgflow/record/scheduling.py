"""What the kernel's scheduler does, recorded with `perf` where LTTng has no kernel modules."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from contextlib import contextmanager
from typing import TYPE_CHECKING

from msgflow.record import perf
from msgflow.record.kernel_events import PERF_EVENTS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

# Pages of memory of each CPU.
_OPTIONS = ("--all-cpus", "--mmap-pages=8192", *(f"--event={name}" for name in PERF_EVENTS))
_TRACE = "perf"


def why_perf_cannot_record() -> str | None:
    """Return why perf cannot record the scheduler here; None where it can."""
    return perf.why_not(_OPTIONS)


@contextmanager
def recorded_with_perf(directory: Path, note: Callable[[str], None]) -> Iterator[None]:
    """Record the scheduler during the block, as a CTF trace below the directory."""
    # Not perf.data, which has samples of functions.
    data = directory / "perf.scheduler"
    with perf.recorded(data, _OPTIONS, note):
        yield
    trace = directory / _TRACE
    convert = ["perf", "data", "convert", f"--to-ctf={trace}", f"--input={data}"]
    run = subprocess.run(convert, capture_output=True, text=True, start_new_session=True)
    if run.returncode:
        shutil.rmtree(trace, ignore_errors=True)
        note(
            f"what perf recorded of the scheduler is not read: {shlex.join(convert)}"
            f" failed{perf.reason(run.stderr)}"
        )
    else:
        data.unlink()
