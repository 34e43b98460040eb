"""What `perf` records beside the events of ROS 2: which functions run, and the scheduler."""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import socket
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from msgflow.errors import TraceError, UsageError
from msgflow.record.daemon import started
from msgflow.trace.perf_script import DATA, TEXT, write_script

# The clock of LTTng.
_RECORD = ("perf", "record", "--clockid=CLOCK_MONOTONIC")
_LONGEST_START = 10.0
# A clock of each CPU is there in virtual machines, too. Symbols are resolved at once: what perf
# keeps for later is not needed.
_SAMPLE_OPTIONS = ("--event=cpu-clock", "--sample-cpu", "--no-buildid", "--no-buildid-cache")
_MOST_HZ = 10_000
# As docs/scheduling.md asks for them, by the name of LTTng: that of perf.
_KERNEL_NAMES = {
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
KERNEL_EVENTS = tuple(_KERNEL_NAMES)
"""Events of the scheduler that a recording has, by their names of LTTng."""

# Pages of memory of each CPU.
SCHEDULER_OPTIONS = (
    "--all-cpus",
    "--mmap-pages=8192",
    *(f"--event={name}" for name in _KERNEL_NAMES.values()),
)


@dataclass(frozen=True, slots=True)
class Rate:
    """How to sample."""

    hz: int  # samples of each CPU per second
    graph: str  # how perf finds callers: 'fp' by frame pointers, 'dwarf' by what debuggers read


def read_rate(text: str) -> Rate:
    """Return what `99` or `99:dwarf` means."""
    hz, _, graph = text.partition(":")
    if not (
        hz.isascii()
        and hz.isdecimal()
        and 1 <= int(hz) <= _MOST_HZ
        and graph in ("", "fp", "dwarf")
    ):
        raise UsageError(
            f"no rate of samples — {text}", f"--profile 99, or 99:dwarf; at most {_MOST_HZ}"
        )
    return Rate(int(hz), graph or "fp")


def why_not(options: Sequence[str]) -> str | None:
    """Return why perf cannot record so; None where it can."""
    if shutil.which("perf") is None:
        return "perf is not installed (apt-get install linux-perf)"
    trial = [*_RECORD, *options, f"--output={os.devnull}", "--", "true"]
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
            note(f"perf ended before the recording{_last_line(words.read())}")


@contextmanager
def recorded_samples(
    directory: Path, rate: Rate, *, is_ours: bool, note: Callable[[str], None]
) -> Iterator[None]:
    """Sample stacks during the block, as a text of perf in the directory.

    `is_ours` samples only what this process starts meanwhile, else all processes are sampled.
    `note` gets sentences about what is missing.
    """
    options = [*_SAMPLE_OPTIONS, f"--freq={rate.hz}", f"--call-graph={rate.graph}"]
    # Processes inherit it from the one that starts them.
    place = f"--pid={os.getpid()}" if is_ours else "--all-cpus"
    if (reason := why_not([*options, *([] if is_ours else [place])])) is not None:
        note(
            f"functions are not sampled: {reason}; it needs root, CAP_PERFMON, or"
            f" sysctl kernel.perf_event_paranoid={1 if is_ours else 0}"
        )
        yield
        return
    data = directory / DATA
    with recorded(data, [*options, place], note):
        yield
    # Half a text would stand before all of the data.
    part = directory / f"{TEXT}.part"
    try:
        if (cut := write_script(data, part)) is not None:
            note(cut)
        part.replace(directory / TEXT)
        data.unlink()
    except TraceError as error:
        note(error.message)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def recorded_with_perf(directory: Path, note: Callable[[str], None]) -> Iterator[None]:
    """Record the scheduler during the block, as a CTF trace below the directory, where perf can."""
    if (reason := why_not(SCHEDULER_OPTIONS)) is not None:
        note(
            "the scheduler is not recorded: LTTng cannot trace this kernel (it needs its modules,"
            f" and root or the group tracing), and {reason}"
        )
        yield
        return
    # Not perf.data, which has samples of functions.
    data = directory / "perf.scheduler"
    with recorded(data, SCHEDULER_OPTIONS, note):
        yield
    trace = directory / "perf"
    convert = ["perf", "data", "convert", f"--to-ctf={trace}", f"--input={data}"]
    run = subprocess.run(convert, capture_output=True, text=True, start_new_session=True)
    if run.returncode:
        shutil.rmtree(trace, ignore_errors=True)
        note(
            f"what perf recorded of the scheduler is not read: {shlex.join(convert)}"
            f" failed{_last_line(run.stderr)}"
        )
    else:
        data.unlink()


def _last_line(printed: str) -> str:
    """Return the last line that a program printed, to stand behind a sentence."""
    lines = printed.strip().splitlines()
    return f": {lines[-1].strip()}" if lines else ""
