"""Traces in archives: unpacked to a temporary directory, shown as if they lay in the archive."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.errors import TraceError
from msgflow.trace.archive import is_archive, shown
from msgflow.trace.extraction import unpack
from msgflow.trace.trace_set import TraceSet

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from msgflow.trace.trace_set import Batches, Report, Wanted

_PREFIX = "msgflow-"


class Unpacked:
    """Directories in place of archives, in the temporary directory (TMPDIR).

    They are removed by `remove`, or when this object is dropped.
    """

    def __init__(self, paths: Sequence[str | Path]) -> None:
        """Unpack all archives among `paths`."""
        self.archives: dict[Path, Path] = {}  # each of these directories, and its archive
        try:
            self._root = Path(tempfile.mkdtemp(prefix=_PREFIX)).resolve()
        except OSError as error:
            raise TraceError(
                f"no temporary directory to unpack the archive to — {error}",
                hint="TMPDIR=DIRECTORY msgflow … unpacks it elsewhere",
            ) from error
        self.remove = weakref.finalize(self, shutil.rmtree, self._root, ignore_errors=True)
        try:
            # The paths given, archives replaced by the directories they were unpacked to.
            self.paths = [self._unpacked(Path(path)) for path in paths]
        except BaseException:
            self.remove()
            raise

    def shown(self, path: Path) -> Path:
        """Return the path that a user knows: that of the archive, then that inside."""
        return shown(path, self.archives) or path

    @contextlib.contextmanager
    def explained(self) -> Iterator[None]:
        """Let errors name what the user knows."""
        try:
            yield
        except TraceError as error:
            hint = None if error.hint is None else self._translated(error.hint)
            raise TraceError(self._translated(error.message), hint) from error

    def _unpacked(self, path: Path) -> Path:
        if not is_archive(path):
            return path
        archive = Path(os.path.realpath(path))
        for directory, known in self.archives.items():
            if known == archive:
                return directory
        directory = self._root / str(len(self.archives))
        directory.mkdir()
        self.archives[directory] = archive
        unpack(archive, directory)
        return directory

    def _translated(self, text: str) -> str:
        for directory, archive in self.archives.items():
            text = text.replace(str(directory), str(archive))
        return text


class UnpackedTraceSet(TraceSet):
    """A trace set some of whose traces lie in archives."""

    def __init__(self, traces: TraceSet, unpacked: Unpacked) -> None:
        """Take over both; closing this set closes the other one and removes what was unpacked."""
        super().__init__()
        self._traces = traces
        self._unpacked = unpacked
        self.unpacked = unpacked.archives
        self.traces = tuple(
            dataclasses.replace(info, path=unpacked.shown(info.path)) for info in traces.traces
        )
        self._take_over()

    def close(self) -> None:
        """Close the set and remove what was unpacked."""
        super().close()
        self._traces.close()
        self._unpacked.remove()

    def _batches(self, wanted: Wanted, progress: Report | None, batch_rows: int) -> Batches:
        try:
            with self._unpacked.explained():
                yield from self._traces.batches(wanted, progress=progress, batch_rows=batch_rows)
        finally:
            self._take_over()

    def _take_over(self) -> None:
        self.event_counts = self._traces.event_counts
        self.duplicate_packet_count = self._traces.duplicate_packet_count
        self.repeated_packet_counts = self._traces.repeated_packet_counts
        self.damages = [
            dataclasses.replace(damage, file=self._unpacked.shown(damage.file))
            for damage in self._traces.damages
        ]
