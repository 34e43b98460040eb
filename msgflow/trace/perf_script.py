"""Samples of stacks, as `perf script` writes them: the text that all tools for profiles read."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path

from msgflow.errors import TraceError
from msgflow.trace.discovery import directories
from msgflow.trace.regular_file import open_regular

DATA, TEXT = "perf.data", "perf.script"
"""Names of the files: what perf recorded, and what `perf script` made of it."""
_MAGIC = b"PERFILE2"
# perf asks no server for symbols, and reads no settings.
_SCRIPT = ("perf", "script", "--header", "--ns", "--no-inline")
# perf writes no field that it was not asked to record: the CPU and the period.
_FIELDS = ("pid,tid,cpu,time,event,period,ip,sym,dso", "pid,tid,time,event,ip,sym,dso")
_SECONDS = 600.0
# What a damaged file may have perf write, and take of memory.
_MOST_BYTES = 1 << 32
_MOST_MEMORY = 1 << 32
_LONGEST_LINE = 1 << 16
_MOST_LINES = 1 << 10
_MOST_SAMPLES = 10_000


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples of one file."""

    hostname: str | None  # of the machine, as perf has it; None: not known
    is_monotonic: bool  # whether their times are of the clock of LTTng
    heads: list[str]  # of each sample a line with its process, thread, CPU, time and event
    stacks: list[str]  # its calls, a line each, the innermost first


def sample_files(paths: Sequence[str | Path]) -> list[Path]:
    """Return the files of perf with samples below some folders; of a folder the text is enough."""
    found = set()
    for root in map(Path, paths):
        for folder, files in directories(root) if root.is_dir() else ():
            if TEXT in files:
                found.add(folder / TEXT)
            elif DATA in files:
                found.add(folder / DATA)
    return sorted(found)


def write_script(data: Path, text: Path) -> str | None:
    """Have perf write the samples of a `perf.data` as text, with the names of their functions.

    It returns what was left out, as a sentence; None where all is there.
    """
    if shutil.which("perf") is None:
        raise TraceError(
            f"the samples of functions are not read: perf is not installed — {data}",
            "apt-get install linux-perf",
        )
    try:
        with open_regular(data) as file:
            is_data = file.read(len(_MAGIC)) == _MAGIC
    except OSError as error:
        raise _unread(data, error.strerror or str(error)) from None
    if not is_data:
        raise _unread(data, "this is no recording of perf")
    for fields in _FIELDS:
        reason = _why_not_written(data, text, fields)
        if reason is None:
            return None
        if text.exists() and text.stat().st_size == _MOST_BYTES:
            return f"samples after the first {_MOST_BYTES:,} bytes of text are left out — {data}"
    raise _unread(data, str(reason))


def _why_not_written(data: Path, text: Path, fields: str) -> str | None:
    environment = {**os.environ, "PERF_CONFIG": os.devnull, "DEBUGINFOD_URLS": ""}
    command = [*_SCRIPT, f"--fields={fields}", f"--input={data}"]
    try:
        with text.open("wb") as output:
            run = subprocess.run(
                ["prlimit", f"--fsize={_MOST_BYTES}", f"--data={_MOST_MEMORY}", *command],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.PIPE,
                timeout=_SECONDS,
                start_new_session=True,
            )
    except subprocess.TimeoutExpired:
        return f"perf takes longer than {_SECONDS:.0f} s"
    # A full disk, or no prlimit.
    except OSError as error:
        return f"{error.filename or command[0]}: {error.strerror or error}"
    if run.returncode == 0:
        return None
    said = run.stderr.decode(errors="replace").strip().splitlines()
    return said[-1].strip() if said else f"perf ends with {run.returncode}"


def read_script(text: Path) -> Iterator[Samples]:
    """Yield the samples of a text of perf, some thousand at a time."""
    hostname: str | None = None
    is_monotonic = False
    heads: list[str] = []
    stacks: list[list[str]] = []

    def taken() -> Samples:
        return Samples(hostname, is_monotonic, heads, ["\n".join(lines) for lines in stacks])

    # A name may have any characters, also ends of lines: a sample begins behind an empty line.
    is_within = False
    try:
        with open_regular(text) as file:
            for line in _lines(file):
                if not line:
                    is_within = False
                elif line.startswith("\t"):
                    is_within = True
                    if stacks and len(stacks[-1]) < _MOST_LINES:
                        stacks[-1].append(line)
                elif is_within:
                    continue
                elif line.startswith("# hostname :"):
                    hostname = line.partition(":")[2].strip()
                elif line.startswith("# clockid: monotonic ("):
                    is_monotonic = True
                elif not line.startswith("#"):
                    if len(heads) == _MOST_SAMPLES:
                        yield taken()
                        heads, stacks = [], []
                    heads.append(line)
                    stacks.append([])
    except OSError as error:
        raise _unread(text, error.strerror or str(error)) from None
    if heads:
        yield taken()


def _lines(file: BufferedReader) -> Iterator[str]:
    """Yield lines without their ends; of a line that is too long for a name, its begin."""
    is_begin = True
    while piece := file.readline(_LONGEST_LINE):
        if is_begin:
            yield piece.decode(errors="replace").replace("\0", "").rstrip()
        is_begin = piece.endswith(b"\n")


def _unread(path: Path, reason: str) -> TraceError:
    return TraceError(f"the samples of functions are not read: {reason} — {path}")
