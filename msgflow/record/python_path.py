"""Where Python finds what traces nodes of rclpy: the folder `python_nodes`, on PYTHONPATH."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path

PYTHON_NODES = Path(__file__).resolve().with_name("python_nodes")
"""The folder; Python runs its `sitecustomize` when it starts."""


def with_python_nodes(note: Callable[[str], None]) -> dict[str, str]:
    """Return an environment like ours, in which callbacks of rclpy are traced.

    Where the folder cannot be used, `note` is told, and the environment is ours.
    """
    environment = dict(os.environ)
    if (reason := _why_not(PYTHON_NODES)) is not None:
        note(f"callbacks of Python nodes are not traced: {reason}")
        return environment
    # An empty entry would be the current directory: none is added, and those of others stay.
    others = environment.get("PYTHONPATH")
    environment["PYTHONPATH"] = os.pathsep.join([str(PYTHON_NODES), *([others] if others else [])])
    return environment


def _why_not(folder: Path) -> str | None:
    if os.pathsep in str(folder):
        return f"PYTHONPATH cannot have a folder with a {os.pathsep!r} — {folder}"
    # What others may write would run in the processes of this user; so would compiled files.
    for path in (*folder.rglob("*"), folder, *folder.parents):
        try:
            status = path.stat()
        # Python writes compiled files under names that go again.
        except FileNotFoundError:
            continue
        is_shared = status.st_mode & stat.S_IWOTH and not (
            path.is_dir() and status.st_mode & stat.S_ISVTX
        )
        if is_shared or status.st_uid not in (0, os.geteuid()):
            return f"others may write to {path}"
    return None
