"""Flight recorder: keeps the chunks around a violation, and a database of them."""

from __future__ import annotations

import os
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from typing import TYPE_CHECKING

from msgflow.errors import MsgflowError
from msgflow.ingest import ingest
from msgflow.watch.learned_answers import LEARNED_FILE

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from concurrent.futures import Future
    from pathlib import Path

    from msgflow.links import LinksFile
    from msgflow.watch.kept_traces import KeptTraces

_DATABASE = "msgflow.duckdb"


class FlightRecorder:
    """Directories of violations, also of earlier watchers; the oldest are removed.

    A violation that goes on is kept once per window. Its database is written beside the view, which
    goes on meanwhile.

    Attributes:
        earlier_ns: how much of what came before the window of a violation is kept, too.
    """

    def __init__(
        self,
        directory: Path,
        *,
        most: int,
        window_ns: int,
        earlier_ns: int,
        clock_sync: str,
        note: Callable[[str], None],
    ) -> None:
        """Keep nothing yet.

        Args:
            directory: gets a directory per violation.
            most: how many of them stay.
            window_ns: length of a window.
            earlier_ns: how much of what came before the window of a violation is kept, too.
            clock_sync: how clocks of several hosts are brought together, as `ingest` takes it.
            note: gets a sentence about what was kept, or why not.
        """
        self._directory = directory
        self._most = most
        self._window_ns = window_ns
        self.earlier_ns = earlier_ns
        self._clock_sync = clock_sync
        self._note = note
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

        Args:
            end_ns: until when they were recorded.
            traces: their events, with the names of all objects.
            chunks: their directories; of those that are gone only the events are kept.
            links: all that are declared, with those that were learned.
            learned: a file of the latter, which is kept, too; None if there are none.
        """
        if end_ns < self._until_ns:
            return
        self._until_ns = end_ns + self._window_ns
        # Several at once would take the memory of the system that is watched.
        self._finish()
        moment = time.strftime("%Y%m%d-%H%M%S", time.gmtime(end_ns // 1_000_000_000))
        names = (f"violation-{moment}" + (f"-{n}" if n > 1 else "") for n in count(1))
        target = next(path for path in map(self._directory.joinpath, names) if not path.exists())
        # Whatever fails must not end the view.
        try:
            # A directory of a session has `archives`, and is below that of its host.
            common = os.path.commonpath([chunk.parents[2] for chunk in chunks])
            target.mkdir(parents=True)
            for chunk in chunks:
                if chunk.is_dir():
                    session = chunk.parents[1].relative_to(common)
                    shutil.copytree(chunk, target / "archives" / session / chunk.name)
            if learned is not None:
                (target / LEARNED_FILE).write_text(learned, encoding="utf-8")
            self._writing = self._beside.submit(self._write, target, traces, links)
        except Exception as error:
            self._give_up(target, error)

    def close(self) -> None:
        """Wait for the last database."""
        with self._beside:
            self._finish()

    def _finish(self) -> None:
        if self._writing is not None:
            self._writing.result()
        self._writing = None

    def _write(self, target: Path, traces: KeptTraces, links: LinksFile | None) -> None:
        """Write the database of a violation, and remove the oldest ones."""
        try:
            ingest(
                [target],
                target / _DATABASE,
                name=target.name,
                links=links,
                clock_sync=self._clock_sync,
                traces=traces,
            )
        except Exception as error:
            self._give_up(target, error)
            return
        others = sorted(set(self._directory.glob("violation-*")) - {target})
        for oldest in others[: max(len(others) + 1 - self._most, 0)]:
            shutil.rmtree(oldest, ignore_errors=True)
        self._note(f"kept: msgflow why --db {target / _DATABASE}")

    def _give_up(self, target: Path, error: Exception) -> None:
        """Remove what was kept, and say why."""
        shutil.rmtree(target, ignore_errors=True)
        self._note(f"the violation is not kept in {target}: {_reason(error)}")


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
