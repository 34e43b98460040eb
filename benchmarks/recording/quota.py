"""A cgroup with a quota of CPU time, for a process of a robot that is recorded."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

# In each period, processes of the cgroup have the CPU for so long, and no longer.
_PERIOD_US, _QUOTA_US = 30_000, 9_000
_ROOT = Path("/sys/fs/cgroup")
_LONGEST_SECONDS = 5.0


@contextlib.contextmanager
def cgroup_with_quota() -> Iterator[Path]:
    """Yield the directory of a cgroup, which is removed again.

    Raises:
        OSError: it cannot be made here.
    """
    of_version_1 = _ROOT / "cpu"
    parent = of_version_1 if of_version_1.is_dir() else _ROOT
    # Others may record, too.
    group = parent / f"msgflow-planted-{os.getpid()}"
    group.mkdir()
    try:
        if parent == of_version_1:
            (group / "cpu.cfs_period_us").write_text(str(_PERIOD_US))
            (group / "cpu.cfs_quota_us").write_text(str(_QUOTA_US))
        else:
            (group / "cpu.max").write_text(f"{_QUOTA_US} {_PERIOD_US}")
        yield group
    finally:
        _remove(group, parent)


def why_no_quota() -> str | None:
    """Say why no process can have a quota here; None: it can."""
    try:
        with cgroup_with_quota():
            return None
    except OSError as error:
        return str(error)


def _remove(group: Path, parent: Path) -> None:
    """Remove a cgroup; who is still in it goes to the one above."""
    latest = time.monotonic() + _LONGEST_SECONDS
    while True:
        for process in (group / "cgroup.procs").read_text().split():
            # It may have ended.
            with contextlib.suppress(OSError):
                (parent / "cgroup.procs").write_text(process)
        try:
            group.rmdir()
        except OSError:
            if time.monotonic() > latest:
                raise
            time.sleep(0.1)
        else:
            return
