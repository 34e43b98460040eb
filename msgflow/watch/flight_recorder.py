"""Flight recorder: keeps the chunks around a violation, and a database of them."""

from __future__ import annotations

import os
import shutil
import stat
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import KW_ONLY, dataclass
from itertools import count
from pathlib import Path

from msgflow.errors import MsgflowError
from msgflow.ingest import ingest
from msgflow.links.links_file import LinksFile
from msgflow.watch.kept_chunk import KeptTraces
from msgflow.watch.learned_answers import LEARNED_FILE

_DATABASE = "msgflow.duckdb"
# A directory is ours, and may be removed, if this file is in it. It holds the end of the violation.
_MARK = ".msgflow-violation"


@dataclass
class FlightRecorder:
    """Directories of violations, also of earlier watchers; the oldest are removed.

    A violation that goes on is kept once per window. Its database is written beside the view, which
    goes on meanwhile.
    """

    directory: Path  # it gets a copy per violation
    _: KW_ONLY
    most: int  # how many of them it keeps, the last ones
    window_ns: int
    earlier_ns: int  # how much of what came before the window of a violation is kept, too
    clock_sync: str  # as `ingest` takes it
    note: Callable[[str], None]  # gets a sentence about what was kept, or why not

    def __post_init__(self) -> None:
        self._until_ns = 0
        self._beside = ThreadPoolExecutor(1)
        self._writing: Future[None] | None = None

    def keep(
        self,
        end_ns: int,
        traces: KeptTraces,
        chunks: Sequence[Path],
        links: LinksFile | None,
        learned: str | None,
    ) -> None:
        """Keep the last chunks, unless a violation in the same window has kept them.

        They were recorded until `end_ns`. Of directories that are gone only the events, in
        `traces`, are kept. `links` has all links that are declared. Those of them that were learned
        are in the file `learned`, which is kept, too.
        """
        if end_ns < self._until_ns:
            return
        self._until_ns = end_ns + self.window_ns
        # Several at once would take the memory of the system that is watched.
        self._finish()
        moment = time.strftime("%Y%m%d-%H%M%S", time.gmtime(end_ns // 1_000_000_000))
        target = self.directory / f"violation-{moment}"
        is_ours = False
        # Whatever fails must not end the view.
        try:
            # A directory of a session has `archives`, and is below that of its host.
            common = os.path.commonpath([chunk.parents[2] for chunk in chunks])
            target = _made(target)
            is_ours = True
            (target / _MARK).write_text(f"{end_ns}\n", encoding="utf-8")
            for chunk in chunks:
                if chunk.is_dir():
                    session = chunk.parents[1].relative_to(common)
                    copy = target / "archives" / session / chunk.name
                    shutil.copytree(chunk, copy, ignore=_no_files)
            if learned is not None:
                (target / LEARNED_FILE).write_text(learned, encoding="utf-8")
            self._writing = self._beside.submit(self._write, target, traces, links)
        except Exception as error:
            if is_ours:
                shutil.rmtree(target, ignore_errors=True)
            self._note_failure(target, error)

    def close(self) -> None:
        """Wait for the last database."""
        with self._beside:
            self._finish()

    def _finish(self) -> None:
        if self._writing is not None:
            self._writing.result()
        self._writing = None

    def _write(self, target: Path, traces: KeptTraces, links: LinksFile | None) -> None:
        try:
            ingest(
                [target],
                target / _DATABASE,
                name=target.name,
                links=links,
                clock_sync=self.clock_sync,
                traces=traces,
            )
        except Exception as error:
            shutil.rmtree(target, ignore_errors=True)
            self._note_failure(target, error)
            return
        kept = {path: _end_ns(path) for path in self.directory.glob("violation-*")}
        # A violation that another watcher keeps just now may be older.
        others = sorted(
            (end_ns, path) for path, end_ns in kept.items() if end_ns is not None and path != target
        )
        for _, oldest in others[: max(len(others) + 1 - self.most, 0)]:
            shutil.rmtree(oldest, ignore_errors=True)
        self.note(f"kept: msgflow why --db {target / _DATABASE}")

    def _note_failure(self, target: Path, error: Exception) -> None:
        self.note(f"the violation is not kept in {target}: {_reason(error)}")


def _made(path: Path) -> Path:
    """Make a directory with this name, or with the first free number behind it."""
    # It fails where a link leads nowhere: no number would be free.
    path.parent.mkdir(parents=True, exist_ok=True)
    for number in count(1):
        made = path if number == 1 else path.with_name(f"{path.name}-{number}")
        try:
            made.mkdir()
        except FileExistsError:
            continue
        return made
    raise AssertionError("numbers do not end")


def _no_files(directory: str, names: list[str]) -> list[str]:
    """Return what is not to be copied: links may lead anywhere, and pipes never end."""
    modes = {name: os.lstat(os.path.join(directory, name)).st_mode for name in names}
    return [name for name, mode in modes.items() if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))]


def _end_ns(directory: Path) -> int | None:
    """Return the end of the violation that is kept in a directory, None if it is not ours."""
    try:
        mark = os.lstat(directory / _MARK)
        if directory.is_symlink() or not stat.S_ISREG(mark.st_mode):
            return None
        return int((directory / _MARK).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def _reason(error: Exception) -> str:
    """Return what went wrong, with the remedy where there is one."""
    if isinstance(error, MsgflowError):
        reason = error.message
    elif isinstance(error, shutil.Error):
        # Of the first file that was not copied: its source, its target, and the reason.
        reason = str(error.args[0][0][2])
    elif isinstance(error, OSError):
        reason = (error.strerror or str(error)).lower()
    else:
        return f"{type(error).__name__}: {error}"
    return f"{reason}; remove files, or name another directory with --keep-on-violation"
