"""Which functions run, sampled by `perf` beside the events."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from msgflow.errors import TraceError, UsageError
from msgflow.record import perf
from msgflow.trace.perf_script import DATA, TEXT, write_script

# A clock of each CPU is there in virtual machines, too. Symbols are resolved at once: what perf
# keeps for later is not needed.
_OPTIONS = ("--event=cpu-clock", "--sample-cpu", "--no-buildid", "--no-buildid-cache")
_MOST_HZ = 10_000
_TOO_OLD = 12
# `python3.12`, and no program whose name only begins so: it is executed to learn its version.
_PYTHON = re.compile(r"(^|/)python[\d.]*$")
_LONGEST_LINE = 256
_LONGEST_SECONDS = 10
_PYTHON_NAMES = (
    f"import sys; sys.exit(0 if hasattr(sys, 'activate_stack_trampoline') else {_TOO_OLD})"
)


@dataclass(frozen=True, slots=True)
class Rate:
    """How to sample."""

    hz: int  # samples of each CPU per second
    graph: str  # how perf finds callers: 'fp' by frame pointers, 'dwarf' by what debuggers read


def read_rate(text: str) -> Rate:
    """Return what `99` or `99:dwarf` means."""
    hz, _, graph = text.partition(":")
    if not (hz.isdecimal() and 1 <= int(hz) <= _MOST_HZ and graph in ("", "fp", "dwarf")):
        raise UsageError(
            f"no rate of samples — {text}", f"--profile 99, or 99:dwarf; at most {_MOST_HZ}"
        )
    return Rate(int(hz), graph or "fp")


@contextmanager
def recorded_samples(
    directory: Path, rate: Rate, *, is_ours: bool, note: Callable[[str], None]
) -> Iterator[None]:
    """Sample stacks during the block, as a text of perf in the directory.

    `is_ours` samples only what this process starts meanwhile, else all processes are sampled.
    `note` gets sentences about what is missing.
    """
    options = [*_OPTIONS, f"--freq={rate.hz}", f"--call-graph={rate.graph}"]
    # Processes inherit it from the one that starts them.
    place = f"--pid={os.getpid()}" if is_ours else "--all-cpus"
    if (reason := perf.why_not([*options, *([] if is_ours else [place])])) is not None:
        note(
            f"functions are not sampled: {reason}; it needs root, CAP_PERFMON, or"
            f" sysctl kernel.perf_event_paranoid={1 if is_ours else 0}"
        )
        yield
        return
    data = directory / DATA
    with perf.recorded(data, [*options, place], note):
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


def with_python_functions(
    words: Sequence[str], environment: dict[str, str], note: Callable[[str], None]
) -> dict[str, str]:
    """Return an environment in which perf sees the functions of Python, from 3.12 on.

    What a command runs is known if it is Python, or a script of Python, such as `ros2`.
    """
    python = _python_of(words[0], environment)
    code = 0
    # One that cannot be asked hinders no recording.
    with suppress(OSError, subprocess.TimeoutExpired):
        if python is not None:
            code = subprocess.run(
                [python, "-c", _PYTHON_NAMES],
                env=environment,
                stdin=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=_LONGEST_SECONDS,
            ).returncode
    if code:
        why = "is older than 3.12" if code == _TOO_OLD else f"does not run (exit code {code})"
        note(
            f"functions of Python have no names in the samples: {python} {why}; those of C and C++"
            " have"
        )
    return {**environment, "PYTHONPERFSUPPORT": "1"}


def _python_of(program: str, environment: Mapping[str, str]) -> str | None:
    """Return the Python that a program is, or that runs it by its first line."""
    path = environment.get("PATH")
    found = shutil.which(program, path=path)
    if found is None or _PYTHON.search(found):
        return found
    line = ""
    with suppress(OSError), open(found, "rb") as file:
        line = os.fsdecode(file.readline(_LONGEST_LINE))
    words = line[2:].split() if line.startswith("#!") else []
    return next((shutil.which(word, path=path) for word in words if _PYTHON.search(word)), None)
