"""Workspaces: directories beside a database for the temporary files of a command; and locks."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shlex
import shutil
import uuid
from collections.abc import Iterator
from pathlib import Path

from msgflow.errors import DatabaseError, require_utf8

_PREFIX = ".msgflow-"
_LOCK = ".lock"
_LOCKS = Path("/proc/locks")
# Of a command; the rest says nothing new.
_MOST_CHARACTERS = 99


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
            if os.path.samestat(os.stat(path), os.fstat(descriptor)):
                break
            os.close(descriptor)
        except FileNotFoundError:  # its last holder has removed it meanwhile
            os.close(descriptor)
        except BaseException:
            os.close(descriptor)
            raise
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(descriptor)


def lock_holder(path: Path) -> str:
    """Return ' (process ID: COMMAND)' of a process that has a lock on a file; '' if unknown."""
    with contextlib.suppress(OSError, ValueError):
        status = path.stat()
        device = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}"
        for line in _LOCKS.read_text(encoding="ascii").splitlines():
            words = line.split()
            # 'NUMBER: KIND ADVISORY MODE PROCESS FILE BEGIN END'; '->' stands before who waits.
            if words[5:6] == [f"{device}:{status.st_ino}"] and int(words[4]) > 0:
                return f" (process {words[4]}{_command(int(words[4]))})"
    return ""


def _command(process: int) -> str:
    with contextlib.suppress(OSError):
        words = Path(f"/proc/{process}/cmdline").read_bytes().decode(errors="replace")
        text = shlex.join(words.rstrip("\0").split("\0"))
        if len(text) > _MOST_CHARACTERS:
            text = f"{text[: _MOST_CHARACTERS - 1]}…"
        return f": {text}"
    return ""
