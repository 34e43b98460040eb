"""A directory beside the database for what an ingest needs only while it runs."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.errors import DatabaseError

if TYPE_CHECKING:
    from collections.abc import Iterator

_PREFIX = ".msgflow-ingest-"
_LOCK = "lock"


@contextlib.contextmanager
def workspace(beside: Path) -> Iterator[Path]:
    """Yield an empty directory in the directory of `beside`; it is gone afterwards.

    What a killed ingest left behind is removed first: a directory whose lock nobody holds.

    Raises:
        DatabaseError: the directory of the database cannot be written.
    """
    parent = beside.absolute().parent
    _remove_abandoned(parent)
    try:
        directory = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=parent))
    except OSError as error:
        raise DatabaseError(
            f"cannot write — {parent}: {error.strerror}",
            "give a database in a directory that exists and can be written with --db",
        ) from error
    try:
        with open(directory / _LOCK, "wb") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield directory
    finally:
        shutil.rmtree(directory, ignore_errors=True)


def _remove_abandoned(parent: Path) -> None:
    for directory in parent.glob(f"{_PREFIX}*"):
        with contextlib.suppress(OSError):
            descriptor = os.open(directory / _LOCK, os.O_RDWR)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(directory, ignore_errors=True)
            finally:
                os.close(descriptor)
