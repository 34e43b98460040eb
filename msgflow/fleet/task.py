"""Tasks of workers, and the process that does one.

Tasks and their outcomes are plain values, which can be sent to any machine. The parent of the
process starts it, watches time and memory, and ends it if it must.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from msgflow.backports import StrEnum
from msgflow.files.temporary_owner import temporary_directory

# Variables with secrets, which messages of libraries could repeat.
_SECRETS = ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN")
_MEGABYTE = 1_000_000
_FULL = (errno.ENOSPC, errno.EDQUOT)
_FULL_WORDS = re.compile("no space left|not enough free|disk quota", re.IGNORECASE)
# Files in which the process of a task says what it is doing, and its outcome.
STAGE, RESULT = "stage", "result.json"
_PREFIX = "msgflow-fleet."
_LOG = "stderr"
_SECONDS_BETWEEN_LOOKS = 0.1
_LONGEST_LOG = 500


class Reason(StrEnum):
    """Why a recording failed."""

    BROKEN = "broken"
    TOO_LARGE = "too_large"
    TIMEOUT = "timeout"
    CHANGED = "changed"
    SAME_PACKETS = "same_packets"
    UNREACHABLE = "unreachable"
    NO_SPACE = "no_space"
    NO_SCRATCH = "no_scratch"
    CRASHED = "crashed"
    WORKER_LOST = "worker_lost"
    ERROR = "error"


# Another try may succeed although nothing has been changed.
PASSING = (
    Reason.CHANGED, Reason.UNREACHABLE, Reason.NO_SPACE, Reason.CRASHED, Reason.WORKER_LOST,
    Reason.ERROR,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options for all recordings."""

    # Options of the ingest: reader, strict, ignore, events, clock_sync.
    ingest: dict[str, Any] = field(default_factory=dict)
    database: bool = True  # also write the database
    replace: bool = False  # ingest recordings again that the lake has already
    retry_failed: bool = False  # ingest recordings again that failed before
    tries: int = 3  # most tries of a recording, if another one may succeed
    timeout: float = 3600.0  # most seconds of one recording
    memory: int | None = None  # most bytes of one recording
    scratch: str | None = None  # folder of each worker for temporary files, absolute


@dataclass(frozen=True)
class Task(Options):
    """One recording to ingest, with the options of all."""

    source: str  # address of the recording
    lake: str  # address of the lake
    needed_memory: int = 0  # estimated bytes
    needed_disk: int = 0  # estimated bytes of scratch space


@dataclass(frozen=True)
class Outcome:
    """The outcome of a task."""

    reason: str = ""
    stage: str = ""  # what the task was doing
    error: str = ""  # what went wrong
    hint: str | None = None
    values: dict[str, Any] | None = None  # columns of the table `run`; None after a failure
    signature: str | None = None  # of the source, if known
    seconds: float = 0.0
    worker: str = ""  # machine and process


def run_task(task: Task) -> Outcome:
    """Do a task.

    No file of the task stays on this machine. Files that killed workers left here are removed.
    """
    begin = time.monotonic()
    try:
        with temporary_directory(_PREFIX, task.scratch) as directory:
            outcome = _watched(task, directory, begin + task.timeout)
    except OSError as error:
        is_full = is_disk_full(error)
        outcome = Outcome(
            Reason.NO_SPACE if is_full else Reason.NO_SCRATCH,
            "making scratch space",
            f"{error.strerror or error} — {task.scratch or tempfile.gettempdir()}",
            f"give a folder {'with free space' if is_full else 'that can be written'} with"
            " --scratch",
        )
    worker = f"{socket.gethostname()}:{os.getpid()}"
    return replace(outcome, worker=worker, seconds=time.monotonic() - begin)


def _watched(task: Task, directory: Path, end: float) -> Outcome:
    with (directory / _LOG).open("wb") as log:
        child = subprocess.Popen(
            # -P: nothing is imported from the current folder.
            [sys.executable, "-P", "-m", "msgflow.fleet.child_process", str(directory)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=log,
            # Archives are unpacked there as well.
            env={**os.environ, "TMPDIR": str(directory)},
            start_new_session=True,
        )
    try:
        assert child.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            # It stays open: the child ends when it is closed.
            child.stdin.write(json.dumps(asdict(task)).encode() + b"\n")
            child.stdin.flush()
        while child.poll() is None:
            if time.monotonic() > end:
                return _ended(directory, Reason.TIMEOUT, f"not done after {task.timeout:g} s")
            used = _memory(child.pid)
            if task.memory is not None and used > task.memory:
                words = f"it took {used:,} bytes of memory, and may take {task.memory:,}"
                return _ended(directory, Reason.TOO_LARGE, words)
            time.sleep(_SECONDS_BETWEEN_LOOKS)
    finally:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(child.pid, signal.SIGKILL)
        child.wait()
    try:
        return Outcome(**json.loads((directory / RESULT).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        how = f"signal {-child.returncode}" if child.returncode < 0 else f"{child.returncode}"
        return _ended(directory, Reason.CRASHED, f"the process ended with {how}")


def _ended(directory: Path, reason: Reason, words: str) -> Outcome:
    stage, log = "starting", ""
    with contextlib.suppress(OSError):
        stage = (directory / STAGE).read_text(encoding="utf-8")
    with contextlib.suppress(OSError):
        log = (directory / _LOG).read_text(encoding="utf-8", errors="replace").strip()
    hints = {
        Reason.TIMEOUT: "allow more with --timeout, if it is only slow",
        Reason.TOO_LARGE: "allow more with --memory, on a machine that has it",
        Reason.CRASHED: "was there memory enough? --memory keeps a recording below what there is",
    }
    if log:
        words += f": {log.splitlines()[-1][-_LONGEST_LOG:]}"
    return Outcome(reason, stage, without_secrets(words), hints.get(reason))


def _memory(pid: int) -> int:
    """Return the current memory of a process in bytes; 0 if the system does not tell."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")


def needs(size: int, *, is_archive: bool, is_remote: bool) -> tuple[int, int]:
    """Estimate (memory, disk) that a recording needs, in bytes; see docs/fleet.md#sizing."""
    unpacked = size * 8 if is_archive else size
    copied = (size if is_remote else 0) + (unpacked if is_archive else 0)
    return 1_200 * _MEGABYTE + unpacked * 3 // 2, 100 * _MEGABYTE + copied + 3 * unpacked


def is_disk_full(error: Exception) -> bool:
    """Tell whether an error, also one of DuckDB or pyarrow, says that a disk is full."""
    return getattr(error, "errno", None) in _FULL or bool(_FULL_WORDS.search(str(error)))


def without_secrets(text: str) -> str:
    """Return a text without credentials of the environment."""
    for name in _SECRETS:
        value = os.environ.get(name)
        if value and len(value) > 3:
            text = text.replace(value, "…")
    return text
