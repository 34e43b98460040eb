"""Archives of traces, unpacked to a temporary directory while they are read."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
import weakref
from collections.abc import Iterator, Sequence
from pathlib import Path

from msgflow.errors import TraceError
from msgflow.trace.archive import is_archive
from msgflow.trace.extraction import unpack

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
