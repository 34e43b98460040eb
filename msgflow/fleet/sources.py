"""Sources that users type: paths, addresses, patterns and manifests, resolved to recordings."""

from __future__ import annotations

import fnmatch
import glob
import os
from collections.abc import Mapping, Sequence

from msgflow.errors import UsageError
from msgflow.fleet.file_store import S3, Store, normal_url
from msgflow.fleet.manifest import is_manifest, read_manifest
from msgflow.fleet.recording import Recording


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
    return [
        recording
        for name in names
        for recording in (
            read_manifest(name) if is_manifest(name) else [Recording(normal_url(name))]
        )
    ]


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
            for name in _names(Store(url))
            if fnmatch.fnmatchcase(name, segment)
        ]
    return sorted(found)


def _names(store: Store) -> list[str]:
    return sorted({*store.folders(), *(e.path for e in store.entries(recursive=False))})
