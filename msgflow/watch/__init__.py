"""A system seen while it runs: chunks of a recording, windows over them, alarms."""

from __future__ import annotations

from msgflow.watch.chunk import finished_chunks
from msgflow.watch.watcher import Watcher, watch_finished
from msgflow.watch.window_report import WindowReport

__all__ = ["Watcher", "WindowReport", "finished_chunks", "watch_finished"]
