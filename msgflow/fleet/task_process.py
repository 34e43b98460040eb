"""The parent of a task's process: it starts it, watches time and memory, and ends it if it must."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.files.temporary_owner import is_abandoned, mark
from msgflow.fleet.task import RESULT, STAGE, Outcome, Reason, Task, without_secrets

if TYPE_CHECKING:
    from collections.abc import Iterator

_PREFIX = "msgflow-fleet."
_LOG = "stderr"
_SECONDS_BETWEEN_LOOKS = 0.1
_LONGEST_LOG = 500


def run_task(given: dict[str, Any]) -> dict[str, Any]:
    """Do a task and return its outcome, both as plain values.

    No file of the task stays on this machine. Files that killed workers left here are removed.
    """
    task = Task(**given)
    begin = time.monotonic()
    try:
        with _scratch(task.scratch) as directory:
            outcome = _watched(task, directory, begin)
    except OSError as error:
        is_full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        outcome = Outcome(
            reason=Reason.NO_SPACE if is_full else Reason.NO_SCRATCH,
            stage="making scratch space",
            error=f"{error.strerror or error} — {task.scratch or tempfile.gettempdir()}",
            hint=f"give a folder {'with free space' if is_full else 'that can be written'} with"
            " --scratch",
            seconds=time.monotonic() - begin,
        )
    return {**asdict(outcome), "worker": f"{socket.gethostname()}:{os.getpid()}"}


@contextlib.contextmanager
def _scratch(parent: str | None) -> Iterator[Path]:
    root = Path(parent or tempfile.gettempdir())
    root.mkdir(parents=True, exist_ok=True)
    for left in root.glob(f"{_PREFIX}*"):
        if is_abandoned(left.name.removeprefix(_PREFIX).rpartition(".")[0]):
            shutil.rmtree(left, ignore_errors=True)
    directory = Path(tempfile.mkdtemp(prefix=f"{_PREFIX}{mark()}.", dir=root))
    try:
        yield directory
    finally:
        shutil.rmtree(directory, ignore_errors=True)


def _watched(task: Task, directory: Path, begin: float) -> Outcome:
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
            if time.monotonic() - begin > task.timeout:
                return _ended(
                    directory, begin, Reason.TIMEOUT, f"not done after {task.timeout:g} s"
                )
            used = _memory(child.pid)
            if task.most_memory is not None and used > task.most_memory:
                return _ended(
                    directory,
                    begin,
                    Reason.TOO_LARGE,
                    f"it took {used:,} bytes of memory, and may take {task.most_memory:,}",
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
        return _ended(directory, begin, Reason.CRASHED, f"the process ended with {how}")


def _ended(directory: Path, begin: float, reason: Reason, words: str) -> Outcome:
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
        seconds=time.monotonic() - begin,
    )


def _memory(pid: int) -> int:
    """Return the current memory of a process in bytes; 0 if the system does not tell."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")
