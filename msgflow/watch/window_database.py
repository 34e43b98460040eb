"""The last window as a database, for pages that follow a recording."""

from __future__ import annotations

import os
import time
from pathlib import Path
from threading import Lock

from msgflow.db import empty_database
from msgflow.ingest import ingest
from msgflow.links.links_file import LinksFile
from msgflow.watch.kept_chunk import KeptTraces


class WindowDatabase:
    """A database that has the last window once somebody asks for it; nothing is written before.

    To prepare a window takes long, to show it no time. So a page can change its mind meanwhile, and
    goes on with the window that it shows.
    """

    def __init__(self, path: Path, *, clock_sync: str) -> None:
        """Write a database without a run; `clock_sync` is as `ingest` takes it."""
        self.path = path
        self._prepared = path.with_name(f"next-{path.name}")
        self._clock_sync = clock_sync
        # Of the last window that is not prepared yet: when it ended, its events, declared links.
        self._last: tuple[int, KeptTraces, LinksFile | None] | None = None
        # The watcher has another thread than the pages.
        self._lock = Lock()
        empty_database.write_empty(path)

    def offer(self, end_ns: int, traces: KeptTraces, links: LinksFile | None) -> None:
        """Take over a window: its end, its events and those around it, and all links."""
        with self._lock:
            self._last = (end_ns, traces, links)

    def prepare(self) -> None:
        """Write the last window beside the database, unless that was done before."""
        with self._lock:
            last, self._last = self._last, None
        if last is None:
            return
        end_ns, traces, links = last
        name = time.strftime("window-%Y%m%d-%H%M%S", time.gmtime(end_ns // 1_000_000_000))
        self._prepared.unlink(missing_ok=True)
        ingest(
            [name],
            self._prepared,
            name=name,
            links=links,
            clock_sync=self._clock_sync,
            traces=traces,
        )

    def show(self) -> None:
        """Put the window that was prepared last in place of the database."""
        if self._prepared.exists():
            os.replace(self._prepared, self.path)
