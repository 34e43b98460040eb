"""Samples of stacks, as `perf script` writes them: the text that all tools for profiles read."""

from __future__ import annotations

import os
import shutil
import subprocess
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.errors import TraceError
from msgflow.trace.discovery import directories
from msgflow.trace.regular_file import open_regular

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

DATA, TEXT = "perf.data", "perf.script"
"""Names of the files: what perf recorded, and what `perf script` made of it."""
_MAGIC = b"PERFILE2"
# perf asks no server for symbols, and reads no settings.
_SCRIPT = (
    "perf", "script", "--header", "--ns", "--no-inline",
    "--fields=pid,tid,cpu,time,event,period,ip,sym,dso",
)  # fmt: skip
_SECONDS = 600.0
# What a damaged file may have perf write.
_MOST_BYTES = 1 << 32
_LONGEST_LINE = 1 << 16
_MOST_LINES = 1 << 10


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples of one file.

    Attributes:
        hostname: of the machine, as perf has it; None: not known.
        is_monotonic: whether their times are of the clock of LTTng.
        heads: of each sample a line with its process, thread, CPU, time and event.
        stacks: its calls, a line each, the innermost first.
    """

    hostname: str | None
    is_monotonic: bool
    heads: list[str]
    stacks: list[str]


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


def write_script(data: Path, text: Path) -> None:
    """Have perf write the samples of a `perf.data` as text, with the names of their functions.

    Raises:
        TraceError: perf is missing or fails, or the file is none of perf.
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
    environment = {**os.environ, "PERF_CONFIG": os.devnull, "DEBUGINFOD_URLS": ""}
    command = ["prlimit", f"--fsize={_MOST_BYTES}", *_SCRIPT, f"--input={data}"]
    try:
        with text.open("wb") as output:
            run = subprocess.run(
                command,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.PIPE,
                timeout=_SECONDS,
                start_new_session=True,
            )
    except subprocess.TimeoutExpired:
        raise _unread(data, f"perf takes longer than {_SECONDS:.0f} s") from None
    if run.returncode:
        said = run.stderr.decode(errors="replace").strip().splitlines()
        raise _unread(data, said[-1].strip() if said else f"perf ends with {run.returncode}")


def read_script(text: Path, at_once: int = 10_000) -> Iterator[Samples]:
    """Yield the samples of a text of perf, so many at a time.

    Raises:
        TraceError: the file cannot be read.
    """
    hostname: str | None = None
    is_monotonic = False
    heads: list[str] = []
    stacks: list[list[str]] = []

    def taken() -> Samples:
        return Samples(hostname, is_monotonic, heads, ["\n".join(lines) for lines in stacks])

    try:
        with open_regular(text) as file:
            while raw := file.readline(_LONGEST_LINE):
                line = raw.decode(errors="replace").replace("\0", "").rstrip()
                if line.startswith("# hostname :"):
                    hostname = line.partition(":")[2].strip()
                elif line.startswith("# clockid: monotonic ("):
                    is_monotonic = True
                elif line.startswith("\t"):
                    if stacks and len(stacks[-1]) < _MOST_LINES:
                        stacks[-1].append(line)
                elif line and not line.startswith("#"):
                    if len(heads) == at_once:
                        yield taken()
                        heads, stacks = [], []
                    heads.append(line)
                    stacks.append([])
    except OSError as error:
        raise _unread(text, error.strerror or str(error)) from None
    if heads:
        yield taken()


def _unread(path: Path, reason: str) -> TraceError:
    return TraceError(f"the samples of functions are not read: {reason} — {path}")
