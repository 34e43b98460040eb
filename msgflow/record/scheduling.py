"""Events of the kernel's scheduler, recorded with `perf` where LTTng has no kernel modules."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from msgflow.record import perf

# As docs/scheduling.md asks for them, by the name of LTTng: that of perf.
_NAMES = {
    "sched_switch": "sched:sched_switch",
    "sched_waking": "sched:sched_waking",
    "sched_wakeup_new": "sched:sched_wakeup_new",
    "sched_migrate_task": "sched:sched_migrate_task",
    "power_cpu_frequency": "power:cpu_frequency",
    "irq_handler_entry": "irq:irq_handler_entry",
    "irq_handler_exit": "irq:irq_handler_exit",
    "irq_softirq_entry": "irq:softirq_entry",
    "irq_softirq_exit": "irq:softirq_exit",
    "timer_hrtimer_expire_entry": "timer:hrtimer_expire_entry",
    "timer_hrtimer_expire_exit": "timer:hrtimer_expire_exit",
}
KERNEL_EVENTS = tuple(_NAMES)
"""Names of LTTng."""

# Pages of memory of each CPU.
_OPTIONS = ("--all-cpus", "--mmap-pages=8192", *(f"--event={name}" for name in _NAMES.values()))
_TRACE = "perf"


def why_perf_cannot_record() -> str | None:
    """Return why perf cannot record the scheduler here; None where it can."""
    return perf.why_not(_OPTIONS)


@contextmanager
def recorded_with_perf(directory: Path, note: Callable[[str], None]) -> Iterator[None]:
    """Record the scheduler during the block, as a CTF trace below the directory, where perf can."""
    if (reason := why_perf_cannot_record()) is not None:
        note(
            "the scheduler is not recorded: LTTng cannot trace this kernel (it needs its modules,"
            f" and root or the group tracing), and {reason}"
        )
        yield
        return
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
