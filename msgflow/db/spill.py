"""Where a connection spills to, and the removal of what killed processes have left there.

DuckDB makes the directory when it first needs it, and removes it when the connection is closed. By
its own rule all processes that read one file would share one.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

from msgflow.owner import is_abandoned, mark

_SUFFIX = ".spill"


def spill_directory(database: Path) -> Path:
    """Return where a connection of this process to `database` spills to; nothing is created."""
    return _place(database) / f"{_prefix(database)}{mark()}{_SUFFIX}"


def remove_abandoned(database: Path, *, is_ours_alone: bool) -> None:
    """Remove what processes that have ended spilled for `database`.

    Args:
        database: the file.
        is_ours_alone: whether it is open for writing, so that no other process can have it open.
    """
    prefix = _prefix(database)
    try:
        entries = [entry.name for entry in os.scandir(_place(database))]
    except OSError:
        return
    for name in entries:
        if name.startswith(prefix) and name.endswith(_SUFFIX):
            owner = name[len(prefix) : -len(_SUFFIX)]
            if owner != mark() and (is_ours_alone or is_abandoned(owner)):
                shutil.rmtree(_place(database) / name, ignore_errors=True)


def _place(database: Path) -> Path:
    parent = database.absolute().parent
    return parent if os.access(parent, os.W_OK) else Path(tempfile.gettempdir())


def _prefix(database: Path) -> str:
    return f".{database.name}."
