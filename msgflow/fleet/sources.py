"""Sources that users type, resolved to recordings: paths, addresses, patterns and manifests.

A manifest is a list of recordings with their labels, as CSV. What files a recording has tells
whether it has changed.
"""

from __future__ import annotations

import csv
import fnmatch
import glob
import hashlib
import io
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from msgflow.db.runs import require_label
from msgflow.errors import TraceError, UsageError
from msgflow.files.text_file import MOST_BYTES
from msgflow.fleet.file_store import S3, Store, normal_url
from msgflow.trace.archive import SUFFIXES

_MANIFEST = ".csv"
PATH = "path"
# A recording takes some hundred bytes: this is enough for any fleet.
_MOST_BYTES = 100 * MOST_BYTES
# One row: its place, for messages, and its values as text.
_Row = tuple[str, dict[str, str]]


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


def find_recordings(
    sources: Sequence[str], labels: Mapping[str, str] | None = None
) -> list[Recording]:
    """Return the recordings of some sources, each once, in the given order."""
    found: dict[str, Recording] = {}
    for source in sources:
        for recording in _of(source):
            whole = Recording(recording.source, {**(labels or {}), **recording.labels})
            earlier = found.setdefault(whole.source, whole)
            if earlier != whole:
                raise UsageError(
                    f"one recording is given twice, with different labels — {whole.source}",
                    "leave out one of the two",
                )
    if not found:
        raise UsageError("there is no recording", "msgflow fleet ingest SOURCE --lake LAKE")
    return list(found.values())


def _of(source: str) -> list[Recording]:
    if not source:
        raise UsageError("the path of a recording is empty", "msgflow fleet ingest SOURCE…")
    names = [source]
    if glob.has_magic(source) and (source.startswith(S3) or not os.path.lexists(source)):
        names = _in_bucket(source) if source.startswith(S3) else sorted(glob.glob(source))
        if not names:
            raise UsageError(f"nothing fits the pattern — {source}", "check the path")
    found: list[Recording] = []
    for name in names:
        is_manifest = name.lower().endswith(_MANIFEST)
        found += read_manifest(name) if is_manifest else [Recording(normal_url(name))]
    return found


def _in_bucket(pattern: str) -> list[str]:
    """Return the addresses that fit a pattern, segment by segment, as in a folder."""
    bucket, *segments = pattern.removeprefix(S3).rstrip("/").split("/")
    found = [S3 + bucket]
    for segment in segments:
        if not glob.has_magic(segment):
            found = [f"{url}/{segment}" for url in found]
            continue
        found = [
            f"{url}/{name}"
            for url in found
            for name in Store(url).names()
            if fnmatch.fnmatchcase(name, segment)
        ]
    return sorted(found)


def read_manifest(source: str) -> list[Recording]:
    """Return the recordings of a manifest, in its order.

    Each has a path; a relative one starts in the folder of the manifest. All other columns are
    labels, taken as text; an empty value means no label.
    """
    url = normal_url(source)
    folder, _, name = url.rpartition("/")
    content = Store(folder or "/").read(name, _MOST_BYTES)
    if content is None:
        raise UsageError(f"no such manifest — {source}", "check the path")
    found = [_recording(place, values, folder, source) for place, values in _rows(content, source)]
    if not found:
        raise UsageError(f"the manifest is empty — {source}", "a column path, and a row for each")
    return found


def _recording(place: str, values: Mapping[str, str], folder: str, source: str) -> Recording:
    path = values.get(PATH)
    if not path:
        raise UsageError(f"a row without a path, in {place} — {source}", f"fill in {PATH}")
    labels = {key: value for key, value in values.items() if key != PATH and value}
    try:
        for key, value in labels.items():
            require_label(key, value)
    except UsageError as error:
        raise UsageError(f"{error.message}, in {place} — {source}", error.hint) from error
    is_whole = "://" in path or path.startswith("/")
    return Recording(normal_url(path if is_whole else f"{folder}/{path}"), labels)


def _rows(content: bytes, source: str) -> Iterator[_Row]:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UsageError(f"the manifest is not UTF-8 — {source}", "save it as UTF-8") from error
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        names = next(reader, [])
        _require_columns(names, source)
        for values in filter(None, reader):
            place = f"line {reader.line_num}"
            if len(values) != len(names):
                raise UsageError(
                    f"{len(values)} values for {len(names)} columns, in {place} — {source}",
                    "put values with commas or line breaks between quotes",
                )
            yield place, dict(zip(names, values, strict=True))
    except csv.Error as error:
        raise UsageError(
            f"cannot read the manifest: {error}, in line {reader.line_num} — {source}",
            "a quote inside of quotes is written twice",
        ) from error


def _require_columns(names: list[str], source: str) -> None:
    if PATH not in names:
        columns = ", ".join(names) or "none"
        raise UsageError(
            f"the manifest has no column {PATH}, its columns are {columns} — {source}",
            "name the recordings in a column path; all others are labels",
        )
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise UsageError(f"the manifest has two columns {twice[0]} — {source}", "rename one")
    for name in names:
        if name != PATH:
            try:
                require_label(name, None)
            except UsageError as error:
                raise UsageError(f"{error.message}, a column of {source}", error.hint) from error


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
