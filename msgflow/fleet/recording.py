"""Recordings of a fleet: address, labels, and whether the files have changed."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from msgflow.errors import TraceError
from msgflow.fleet.file_store import Store
from msgflow.trace.archive import SUFFIXES


@dataclass(frozen=True)
class Recording:
    """A recording, which becomes one run."""

    source: str  # absolute path, or `s3://…`: a directory with traces, or an archive
    labels: Mapping[str, str] = field(default_factory=dict)  # by key


@dataclass(frozen=True)
class State:
    """The files of a source, without their content."""

    signature: str  # hash of names, sizes and times of all its files
    size: int  # their bytes
    is_archive: bool  # by its name


def look_at(source: str) -> State:
    """Return the state of a source, without reading its files."""
    store = Store(source)
    file = store.entry()
    if file is not None:
        files = [(source.rpartition("/")[2], file.size, file.changed_ns)]
    elif store.is_local:
        files = sorted(_local_files(source))
    else:
        # Times in a bucket are those of the upload: a second upload counts as a change.
        files = [(entry.path, entry.size, entry.changed_ns) for entry in store.entries()]
    if not files:
        raise TraceError(f"no such recording — {source}", "check the path")
    text = "\n".join(f"{name}\t{size}\t{time}" for name, size, time in files)
    digest = hashlib.sha256(text.encode(errors="surrogateescape")).hexdigest()
    is_archive = file is not None and source.lower().endswith(SUFFIXES)
    return State(digest[:32], sum(size for _, size, _ in files), is_archive)


def fetch(source: str, directory: Path) -> Path:
    """Copy a source from a bucket into a directory of this machine, under its own name."""
    store = Store(source)
    target = directory / source.rpartition("/")[2]
    if store.entry() is not None:
        store.fetch("", target)
        return target
    for entry in store.entries():
        place = target / entry.path
        # Names in a bucket may hold `..`.
        if not place.resolve().is_relative_to(target.resolve()):
            raise TraceError(f"a name that leads out of the recording — {entry.path}", None)
        place.parent.mkdir(parents=True, exist_ok=True)
        store.fetch(entry.path, place)
    return target


def _local_files(source: str) -> Iterator[tuple[str, int, int]]:
    seen = {os.path.realpath(source)}
    for directory, folders, names in os.walk(source, onerror=_raise, followlinks=True):
        for folder in sorted(folders):
            # A link may lead to a folder above.
            place = os.path.realpath(Path(directory, folder))
            if place in seen:
                folders.remove(folder)
            seen.add(place)
        for name in names:
            path = Path(directory, name)
            try:
                status = path.stat()
            except FileNotFoundError:  # a dangling link, or deleted meanwhile
                continue
            yield str(path.relative_to(source)), status.st_size, status.st_mtime_ns


def _raise(error: OSError) -> None:
    if not isinstance(error, FileNotFoundError | NotADirectoryError):
        raise error
