"""Entries of a directory, such as exported views: all are written aside, then take their places."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from msgflow.errors import UsageError
from msgflow.files.temporary_owner import left_behind, mark

PARTITION_FILE = "data.parquet"
"""The only file in a directory of one run of a view."""

_PARTITION = "run_id="
_ASIDE = ".export."
_SUFFIX = ".part"


@contextmanager
def replacing_entries(
    directory: Path, names: Sequence[str], *, force: bool = False
) -> Iterator[Path]:
    """Yield a directory to write `names` to; they take their places at the end.

    An error or an interrupt before that leaves `directory` as it was. Other entries stay.
    """
    _clean_up(directory)
    _refuse_existing(directory, names, force)
    aside = directory / f"{_ASIDE}{mark()}{_SUFFIX}"
    is_new = not directory.exists()
    action = "create"
    try:
        aside.mkdir(parents=True)
        action = "write to"
        yield aside
        _publish(directory, aside, names)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise UsageError(
            f"cannot {action} the directory: {reason} — {directory}",
            "give a directory in a place that exists and can be written",
        ) from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)
        if is_new and directory.is_dir() and not any(directory.iterdir()):
            directory.rmdir()


def _publish(directory: Path, aside: Path, names: Sequence[str]) -> None:
    old = aside / "old"
    old.mkdir()
    moved: list[str] = []
    try:
        for name in names:
            if (directory / name).is_dir():
                (directory / name).rename(old / name)
            moved.append(name)
            (aside / name).replace(directory / name)
    except BaseException:
        for name in moved:
            if (old / name).exists():
                shutil.rmtree(directory / name, ignore_errors=True)
                (old / name).rename(directory / name)
        raise


def _clean_up(directory: Path) -> None:
    """Remove remains of killed exports; entries that they were replacing go back."""
    for aside in left_behind(directory, _ASIDE, _SUFFIX):
        moved = aside / "old"
        # What a link leads to was never here.
        if aside.is_symlink() or moved.is_symlink():
            continue
        for old in moved.glob("*"):
            if not os.path.lexists(directory / old.name):
                old.rename(directory / old.name)
        shutil.rmtree(aside, ignore_errors=True)


def _refuse_existing(directory: Path, names: Sequence[str], force: bool) -> None:
    existing = [directory / name for name in names if os.path.lexists(directory / name)]
    if existing and not force:
        raise UsageError(
            f"it exists already — {existing[0]}",
            "choose another directory, or replace what exists with --force",
        )
    for path in existing:
        if path.is_symlink() or not (path.is_file() or path.is_dir()):
            raise UsageError(
                f"a link, pipe or device is in the place of a file — {path}",
                "choose another directory",
            )
        if path.is_dir() and not _is_exported(path):
            raise UsageError(
                f"the directory holds more than an export — {path}", "choose another directory"
            )


def _is_exported(path: Path) -> bool:
    return all(
        partition.is_dir()
        and not partition.is_symlink()
        and partition.name.startswith(_PARTITION)
        and all(
            file.name == PARTITION_FILE and file.is_file() and not file.is_symlink()
            for file in partition.iterdir()
        )
        for partition in path.iterdir()
    )
