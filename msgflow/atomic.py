"""Atomic files: they appear whole or not at all."""

from __future__ import annotations

import os
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.temporary_owner import is_abandoned, mark

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


_SUFFIX = ".part"


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a path beside `path` to write to; it takes the place of `path` when all went well.

    Raises:
        UsageError: the file cannot be created there.
    """
    _remove_abandoned(path)
    temporary = path.with_name(f".{path.name}.{mark()}{_SUFFIX}")
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise UsageError(
            f"cannot write the file: {reason} — {path}",
            "give a file in a directory that exists and can be written",
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def _remove_abandoned(path: Path) -> None:
    """Remove what killed processes have left of `path`."""
    prefix = f".{path.name}."
    with suppress(OSError):
        for entry in os.scandir(path.parent):
            name = entry.name
            is_ours = name.startswith(prefix) and name.endswith(_SUFFIX)
            if is_ours and is_abandoned(name[len(prefix) : -len(_SUFFIX)]):
                os.unlink(entry.path)
