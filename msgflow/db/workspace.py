"""Workspaces: directories beside a database for the temporary files of a command."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import uuid
from typing import TYPE_CHECKING

from msgflow.db.lock_holder import lock_holder
from msgflow.errors import DatabaseError, require_utf8

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_PREFIX = ".msgflow-"
_LOCK = ".lock"


@contextlib.contextmanager
def workspace(beside: Path) -> Iterator[Path]:
    """Yield an empty directory in the directory of `beside`; it is gone afterwards.

    It first removes workspaces of killed commands, whose lock files no process holds.
    """
    parent = beside.absolute().parent
    require_utf8(parent, DatabaseError)
    remove_abandoned_workspaces(parent)
    directory = parent / f"{_PREFIX}{uuid.uuid4().hex}"
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(_locked(directory.with_suffix(_LOCK), wait=True))
            directory.mkdir()
        except OSError as error:
            raise _cannot_write(parent, error) from error
        stack.callback(shutil.rmtree, directory, ignore_errors=True)
        yield directory


def remove_abandoned_workspaces(parent: Path) -> None:
    """Remove the workspaces of killed commands from a directory."""
    # Only names that we give: directories of users may begin so, too.
    for abandoned in parent.glob(f"{_PREFIX}{'[0-9a-f]' * 32}{_LOCK}"):
        with contextlib.suppress(OSError), _locked(abandoned, wait=False):
            shutil.rmtree(abandoned.with_suffix(""), ignore_errors=True)


@contextlib.contextmanager
def creating(database: Path) -> Iterator[None]:
    """Keep other processes from creating `database`."""
    path = database.absolute().with_name(f"{_PREFIX}{database.name}{_LOCK}")
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(_locked(path, wait=False))
        except BlockingIOError as error:
            raise DatabaseError(
                f"another process{lock_holder(path)} is creating the database — {database}",
                "wait for it, or give another file with --db",
            ) from error
        except OSError as error:
            raise _cannot_write(path.parent, error) from error
        yield


def _cannot_write(parent: Path, error: OSError) -> DatabaseError:
    return DatabaseError(
        f"cannot write — {parent}: {error.strerror}",
        "give a database in a directory that exists and can be written with --db",
    )


@contextlib.contextmanager
def _locked(path: Path, *, wait: bool) -> Iterator[None]:
    """Hold the lock file `path`, which is removed with the lock."""
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            if _is_still(path, descriptor):
                break
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)  # its last holder has removed it meanwhile
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(descriptor)


def _is_still(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(os.stat(path), os.fstat(descriptor))
    except FileNotFoundError:
        return False
