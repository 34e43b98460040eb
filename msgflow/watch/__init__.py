"""A system seen while it runs: chunks of a recording, windows over them, alarms."""

from __future__ import annotations

from msgflow.watch.alarm import Alarm, violation_line
from msgflow.watch.chunk import finished_chunks, remove_chunk
from msgflow.watch.diagnostics import Diagnostics
from msgflow.watch.flight_recorder import FlightRecorder
from msgflow.watch.follow import watch_finished, watch_live
from msgflow.watch.prometheus import Exporter
from msgflow.watch.watched_sessions import WatchedSessions, watched_place
from msgflow.watch.watcher import Watcher
from msgflow.watch.window_database import WindowDatabase
from msgflow.watch.window_report import WindowReport

__all__ = [
    "Alarm",
    "Diagnostics",
    "Exporter",
    "FlightRecorder",
    "WatchedSessions",
    "Watcher",
    "WindowDatabase",
    "WindowReport",
    "finished_chunks",
    "remove_chunk",
    "violation_line",
    "watch_finished",
    "watch_live",
    "watched_place",
]
