"""Archives of traces, recognised by their names, unpacked to a directory while they are read."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
import weakref
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from msgflow.errors import TraceError

SUFFIXES = (".tar", ".tar.gz", ".tgz", ".tar.zst", ".tzst", ".tar.xz", ".txz", ".zip")
"""How the names of archives end that can be read."""

_PREFIX = "msgflow-"


def is_archive(path: Path) -> bool:
    """Tell whether this is a file with the name of an archive that can be read."""
    return path.name.lower().endswith(SUFFIXES) and path.is_file()


def stem(path: Path) -> str:
    """Return the name of an archive without its suffix, that of anything else as it is."""
    if not is_archive(path):
        return path.name
    suffix = max((end for end in SUFFIXES if path.name.lower().endswith(end)), key=len)
    return path.name[: -len(suffix)]


class Unpacked:
    """Paths to read, with directories in place of archives, in the temporary directory (TMPDIR).

    The directories are removed by `remove`, or when this object is dropped.
    """

    def __init__(self, paths: Sequence[str | Path]) -> None:
        """Unpack all archives among `paths`."""
        self.archives: dict[Path, Path] = {}  # each of the directories, and its archive
        self.remove = weakref.finalize(self, _remove, self.archives)
        try:
            self.paths = [self._unpacked(Path(path)) for path in paths]
        except BaseException:
            self.remove()
            raise

    def shown(self, path: Path) -> Path:
        """Return a path as the user knows it: within an archive, that of the archive first."""
        for directory, archive in self.archives.items():
            if path.is_relative_to(directory):
                return archive / path.relative_to(directory)
        return path

    @contextlib.contextmanager
    def explained(self) -> Iterator[None]:
        """Let errors name what the user knows."""
        try:
            yield
        except TraceError as error:
            error.message = self._translated(error.message)
            error.hint = error.hint and self._translated(error.hint)
            raise

    def _unpacked(self, path: Path) -> Path:
        if not is_archive(path):
            return path
        archive = Path(os.path.realpath(path))
        for directory, known in self.archives.items():
            if known == archive:
                return directory
        try:
            directory = Path(tempfile.mkdtemp(prefix=_PREFIX)).resolve()
        except OSError as error:
            raise TraceError(
                f"no temporary directory to unpack the archive to — {error}",
                hint="TMPDIR=DIRECTORY msgflow … unpacks it elsewhere",
            ) from error
        self.archives[directory] = archive
        # Its libraries are loaded only where there is an archive.
        from msgflow.trace.extraction import unpack

        unpack(archive, directory)
        return directory

    def _translated(self, text: str) -> str:
        for directory, archive in self.archives.items():
            text = text.replace(str(directory), str(archive))
        return text


def _remove(directories: Iterable[Path]) -> None:
    for directory in directories:
        shutil.rmtree(directory, ignore_errors=True)
