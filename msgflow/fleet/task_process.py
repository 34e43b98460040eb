"""The parent of a task's process: it starts it, watches time and memory, and ends it if it must."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, replace
from pathlib import Path

from msgflow.files.temporary_owner import temporary_directory
from msgflow.fleet.task import RESULT, STAGE, Outcome, Reason, Task, without_secrets

_PREFIX = "msgflow-fleet."
_LOG = "stderr"
_SECONDS_BETWEEN_LOOKS = 0.1
_LONGEST_LOG = 500


def run_task(task: Task) -> Outcome:
    """Do a task.

    No file of the task stays on this machine. Files that killed workers left here are removed.
    """
    begin = time.monotonic()
    try:
        with temporary_directory(_PREFIX, task.scratch) as directory:
            outcome = _watched(task, directory, begin + task.timeout)
    except OSError as error:
        is_full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        outcome = Outcome(
            reason=Reason.NO_SPACE if is_full else Reason.NO_SCRATCH,
            stage="making scratch space",
            error=f"{error.strerror or error} — {task.scratch or tempfile.gettempdir()}",
            hint=f"give a folder {'with free space' if is_full else 'that can be written'} with"
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
                return _ended(
                    directory,
                    Reason.TOO_LARGE,
                    f"it took {used:,} bytes of memory, and may take {task.memory:,}",
                )
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
    last = log.splitlines()[-1][-_LONGEST_LOG:] if log else ""
    return Outcome(
        reason=reason,
        stage=stage,
        error=without_secrets(f"{words}: {last}" if last else words),
        hint=hints.get(reason),
    )


def _memory(pid: int) -> int:
    """Return the current memory of a process in bytes; 0 if the system does not tell."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")
