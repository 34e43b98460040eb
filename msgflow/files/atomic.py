"""Atomic files: they appear whole or not at all."""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from msgflow.errors import UsageError
from msgflow.files.temporary_owner import left_behind, mark

_SUFFIX = ".part"
_STDOUT = 1


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a path to write to; what was written there is at `path` when all went well.

    A file is replaced. Behind a symbolic link, this happens at the target. Anything else that
    stands there (a device, a pipe, the standard output of this process) stays and gets the bytes.
    """
    hint: str | None = "give a file in a directory that exists and can be written"
    try:
        if _is_stream(path):
            hint = None
            way = _into_stream(path)
        else:
            way = _in_place_of(path)
        with way as temporary:
            yield temporary
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise UsageError(f"cannot write the file: {reason} — {path}", hint) from error


@contextmanager
def _in_place_of(path: Path) -> Iterator[Path]:
    target = Path(os.path.realpath(path))
    for entry in left_behind(target.parent, f".{target.name}.", _SUFFIX):
        with suppress(OSError):
            entry.unlink()
    temporary = target.with_name(f".{target.name}.{mark()}{_SUFFIX}")
    try:
        yield temporary
        if target.is_file():
            shutil.copymode(target, temporary)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def _into_stream(path: Path) -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="msgflow-") as directory:
        temporary = Path(directory) / path.name
        yield temporary
        # If stdout were opened by its name, writing would begin at the start of the file.
        target = os.dup(_STDOUT) if _is_stdout(path) else path
        with temporary.open("rb") as source, open(target, "wb") as stream:
            shutil.copyfileobj(source, stream)


def _is_stream(path: Path) -> bool:
    """Tell whether something stands at `path` that must not be replaced."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return False
    return not stat.S_ISDIR(mode) and (not stat.S_ISREG(mode) or _is_stdout(path))


def _is_stdout(path: Path) -> bool:
    with suppress(OSError):  # a closed stdout
        return os.path.samestat(path.stat(), os.fstat(_STDOUT))
    return False
