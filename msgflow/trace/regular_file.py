"""Regular files of bounded size; pipes, devices and the like must not hang or fill a reader."""

from __future__ import annotations

import errno
import os
import shlex
import stat
from io import BufferedReader
from pathlib import Path

from msgflow.errors import TraceError

_KINDS = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a directory",
}


class UnsuitableFileError(OSError):
    """A file is of a kind or size that no tracer writes."""


def read_regular(path: Path, most_bytes: int | None, size: int = -1) -> bytes:
    """Return the content of a regular file, or the first `size` bytes of it."""
    with open_regular(path) as file:
        length = os.fstat(file.fileno()).st_size
        if most_bytes is not None and length > most_bytes:
            raise UnsuitableFileError(
                errno.EFBIG,
                f"{length:,} bytes, more than the {most_bytes:,} that make sense",
                str(path),
            )
        return file.read(length if size < 0 else size)


def open_regular(path: Path) -> BufferedReader:
    """Open a regular file for reading."""
    # A blocking `open` of a pipe without a writer would wait for ever.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        os.close(descriptor)
        raise UnsuitableFileError(errno.EINVAL, f"{_kind(mode)}, no file", str(path))
    return os.fdopen(descriptor, "rb")


def irregular(path: Path) -> str | None:
    """Say what this is if it is neither a regular file nor a directory, else None."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        if not path.is_symlink():
            return None
        return "a link in a circle" if error.errno == errno.ELOOP else "a link that leads nowhere"
    return None if stat.S_ISREG(mode) or stat.S_ISDIR(mode) else _kind(mode)


def unreadable_error(error: OSError, directory: Path) -> TraceError:
    """Return the error for a trace with a file that cannot be read, and a hint."""
    if isinstance(error, UnsuitableFileError):
        hint = "put the file there that was recorded: copy the trace again, with cp -rL"
    elif error.errno in {errno.EACCES, errno.EPERM}:
        hint = f"sudo chown -R $USER {shlex.quote(str(directory))}"
    elif error.errno in {errno.ELOOP, errno.ENOENT}:
        hint = "copy the trace again with cp -rL, which copies what links lead to"
    else:
        hint = "copy it again from where it was recorded"
    return TraceError(
        f"cannot read the trace ({error.strerror}) — {error.filename or directory}", hint=hint
    )


def _kind(mode: int) -> str:
    return _KINDS.get(stat.S_IFMT(mode), "a special file")
