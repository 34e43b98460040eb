"""Owners of temporary files: the name says which process, so that others can remove its remains."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

# A process number is valid in this container, until the machine starts again.
_NAMESPACE = ("/proc/sys/kernel/random/boot_id", "/proc/self/ns/pid")
_UNKNOWN = "0" * 12
_MARK = re.compile(r"([0-9a-f]{12})-(\d+)-(\d+)")


def mark() -> str:
    """Return what this process puts into the names of its temporary files."""
    return f"{_place()}-{os.getpid()}-{_start(os.getpid())}"


def is_abandoned(text: str) -> bool:
    """Tell whether the process with this mark has certainly ended.

    Nothing is certain for a process on another machine, in another container, or before a restart.
    """
    found = _MARK.fullmatch(text)
    if found is None or found[1] != _place() or _place() == _UNKNOWN:
        return False
    return _start(int(found[2])) != int(found[3])


def left_behind(
    folder: Path, prefix: str, suffix: str = "", *, by_others: bool = False
) -> list[Path]:
    """Return what processes that ended left in a folder, named by prefix, mark and suffix.

    Behind a dot, more may follow the mark. `by_others` says that no other process is at work there:
    what is not of this one was left.
    """
    found = []
    with contextlib.suppress(OSError):
        for entry in folder.iterdir():
            if entry.name.startswith(prefix) and entry.name.endswith(suffix):
                owner = entry.name.removeprefix(prefix).removesuffix(suffix).partition(".")[0]
                if is_abandoned(owner) or (by_others and owner != mark()):
                    found.append(entry)
    return found


@contextmanager
def temporary_directory(prefix: str, parent: str | None = None) -> Iterator[Path]:
    """Yield a new directory, and remove it afterwards; those of killed processes go before."""
    root = Path(parent or tempfile.gettempdir())
    root.mkdir(parents=True, exist_ok=True)
    remove_abandoned_directories(prefix, root)
    directory = tempfile.mkdtemp(prefix=f"{prefix}{mark()}.", dir=root)
    try:
        yield Path(directory)
    finally:
        shutil.rmtree(directory, ignore_errors=True)


def remove_abandoned_directories(prefix: str, root: Path | None = None) -> None:
    """Remove what `temporary_directory` made in processes that were killed."""
    for left in left_behind(root or Path(tempfile.gettempdir()), prefix):
        shutil.rmtree(left, ignore_errors=True)


@cache
def _place() -> str:
    try:
        boot = Path(_NAMESPACE[0]).read_text(encoding="ascii")
        space = os.readlink(_NAMESPACE[1])
    except OSError:  # a system without /proc
        return _UNKNOWN
    return hashlib.sha256(f"{boot}{space}".encode()).hexdigest()[:12]


def _start(pid: int) -> int:
    """Return the start of a process, in ticks since the machine started; 0 for no process."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        status = Path(f"/proc/{pid}/stat").read_bytes()
        return int(status.rpartition(b")")[2].split()[19])
    return 0
