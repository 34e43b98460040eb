"""Threads that read a trace ahead of its use: none may be left behind."""

from __future__ import annotations

import threading


def reading_threads() -> int:
    """Return how many are running."""
    return sum(thread.name.startswith("msgflow-reader") for thread in threading.enumerate())
