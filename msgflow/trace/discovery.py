"""Discovery of the CTF traces below given paths."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from msgflow.errors import TraceError, require_utf8
from msgflow.trace import metadata_frame
from msgflow.trace.archive import is_archive
from msgflow.trace.model import TraceLocation
from msgflow.trace.regular_file import irregular, read_regular, unreadable_error

SYSTEM_SAMPLES = "usage.gz"
"""The name of the file that has samples of the system, beside a recording."""

_RECORD_HINT = "ros2 trace"
_RECORDING_HINT = f"messages are not traces, record one: {_RECORD_HINT}"
# What files with these suffixes are, and what to do; {} is the path. See also `is_archive`.
_FOREIGN = {
    ".mcap": ("a rosbag2 recording", _RECORDING_HINT),
    ".db3": ("a rosbag2 recording", _RECORDING_HINT),
    ".bag": ("a ROS 1 recording", _RECORDING_HINT),
    ".pickle": (
        "a converted file of tracetools_analysis",
        "give the directory of the trace that it was converted from",
    ),
    **dict.fromkeys((".tar", ".tgz", ".zip", ".7z"), ("an archive", "tar xf {}")),
    **dict.fromkeys((".gz", ".zst", ".xz", ".bz2"), ("a compressed file", "tar xf {}")),
}
_STREAM_MAGICS = {b"\xc1\x1f\xfc\xc1", b"\xc1\xfc\x1f\xc1"}
_MAGIC_SIZE = 4
# LTTng writes it into the metadata of traces of programs, in CTF 1.8 and CTF 2.
_OF_PROGRAMS = re.compile(rb'\bdomain"?\s*[=:]\s*"ust"')
_MOST_LOOKED_AT = 20


def discover(paths: Sequence[str | Path]) -> list[TraceLocation]:
    """List every directory with a `metadata` file below `paths`, sorted by path.

    Symbolic links are followed and resolved, so that no directory is listed twice. At least one
    trace has event data.
    """
    found: dict[Path, TraceLocation] = {}
    for path in map(Path, paths):
        _check_exists(path)
        below: list[TraceLocation] = []
        strays: list[Path] = []
        for directory, files in directories(path):
            if metadata_frame.FILE_NAME in files:
                below.append(_locate(directory))
            else:
                strays += _first_stream(directory, files)
        if not below:
            raise _no_trace_error(path, strays)
        below[0] = replace(below[0], strays=tuple(strays))
        found.update((location.path, location) for location in below)
    locations = [found[path] for path in sorted(found)]
    if not locations:
        raise TraceError("no trace given", hint="msgflow ingest TRACE")
    if not any(location.size_bytes for location in locations):
        raise _no_event_error([location.path for location in locations])
    return locations


def archives_below(paths: Sequence[str | Path]) -> list[Path]:
    """List the archives below the directories among `paths` that are not given, sorted by path.

    `discover` finds no trace in them: an archive is read only if it is named.
    """
    given = {Path(os.path.realpath(path)) for path in paths}
    found = {
        directory / name
        for path in map(Path, paths)
        if path.is_dir()
        for directory, files in directories(path)
        for name in files
        if is_archive(directory / name)
    }
    return sorted(found - given)


def stream_files(directory: Path) -> list[Path]:
    """List the files of a trace directory that hold events, sorted by name."""
    return sorted(
        entry
        for entry in directory.iterdir()
        if entry.name != metadata_frame.FILE_NAME
        and not entry.name.startswith(".")
        and entry.is_file()
    )


def irregular_files(directory: Path) -> list[tuple[Path, str]]:
    """List what in a trace directory is neither a file nor a directory, and what it is."""
    found = ((entry, irregular(entry)) for entry in sorted(directory.iterdir()))
    return [(entry, kind) for entry, kind in found if kind is not None]


def _check_exists(path: Path) -> None:
    kind = irregular(path)
    if kind is not None:
        raise TraceError(f"not a trace but {kind} — {path}", hint=metadata_frame.DIRECTORY_HINT)
    if not path.exists():
        raise TraceError(
            f"no such file or directory — {path}",
            hint="ros2 trace writes its sessions below ~/.ros/tracing",
        )
    if path.is_file():
        if (
            path.name == metadata_frame.FILE_NAME
            or (path.parent / metadata_frame.FILE_NAME).is_file()
        ):
            raise TraceError(
                f"this is a file inside a trace, give the directory — {path}",
                hint=f"msgflow ingest {shlex.quote(str(path.parent))}",
            )
        what, hint = _foreign(path)
        raise TraceError(f"not a trace but {what} — {path}", hint=hint)


def directories(root: Path) -> Iterator[tuple[Path, list[str]]]:
    """Yield a directory and all below it, each once, with the names of their files."""
    visited: set[Path] = set()

    def fail(error: OSError) -> None:
        raise TraceError(
            f"cannot read the directory ({error.strerror}) — {error.filename}",
            hint=f"ls -ld {shlex.quote(str(error.filename))}",
        ) from error

    for directory, names, files in os.walk(root, onerror=fail, followlinks=True):
        resolved = Path(os.path.realpath(directory))
        if resolved in visited:
            names.clear()
            continue
        visited.add(resolved)
        names.sort()
        yield resolved, files


def _first_stream(directory: Path, names: Sequence[str]) -> list[Path]:
    """Return the first of these files that is a stream of a trace, if there is one."""
    for name in sorted(names)[:_MOST_LOOKED_AT]:
        try:
            is_stream = read_regular(directory / name, None, _MAGIC_SIZE) in _STREAM_MAGICS
        except OSError:
            continue
        if is_stream:
            return [directory / name]
    return []


def _locate(directory: Path) -> TraceLocation:
    try:
        metadata_frame.text_of(directory)
        files = stream_files(directory)
        size = sum(file.stat().st_size for file in files)
    except OSError as error:
        raise unreadable_error(error, directory) from error
    for path in (directory, *files):
        require_utf8(path, TraceError)
    for path in files:
        if not os.access(path, os.R_OK):
            raise TraceError(
                f"cannot read the trace (Permission denied) — {path}",
                hint=f"sudo chown -R $USER {shlex.quote(str(directory))}",
            )
    return TraceLocation(directory, size)


def _no_event_error(paths: Sequence[Path]) -> TraceError:
    listed = ", ".join(map(str, paths))
    if not any(_OF_PROGRAMS.search(metadata_frame.text_of(path)[1]) for path in paths):
        return TraceError(
            f"the trace has metadata but no events, other files are missing or empty — {listed}",
            hint="copy all files of the directory again from where it was recorded",
        )
    return TraceError(
        f"the trace has metadata but no events, nothing was recorded — {listed}",
        hint="start the trace before the application, check that tracetools was built with "
        "LTTng: ros2 run tracetools status",
    )


def _no_trace_error(path: Path, strays: Sequence[Path]) -> TraceError:
    if strays:
        return TraceError(
            f"a stream of a trace without its `metadata`, which is missing or renamed — "
            f"{strays[0]}",
            hint=f"ls {shlex.quote(str(strays[0].parent))};"
            " copy the file `metadata` from where it was recorded",
        )
    entries = sorted(path.iterdir())
    if not entries:
        return TraceError(f"empty directory — {path}", hint=_RECORD_HINT)
    for entry in entries:
        if entry.suffix in _FOREIGN and entry.name != SYSTEM_SAMPLES:
            what, hint = _foreign(entry)
            return TraceError(
                f"no CTF trace in this directory, it holds {what} — {entry}", hint=hint
            )
    return TraceError(
        f"no CTF trace (no file `metadata`) in this directory or below — {path}",
        hint=metadata_frame.DIRECTORY_HINT,
    )


def _foreign(path: Path) -> tuple[str, str]:
    """Return what a file is that is no trace, and what to do."""
    kind, hint = _FOREIGN.get(
        path.suffix, ("a file of another kind", metadata_frame.DIRECTORY_HINT)
    )
    quoted = shlex.quote(str(path))
    return kind, f"msgflow ingest {quoted}" if is_archive(path) else hint.replace("{}", quoted)
