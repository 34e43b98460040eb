"""Clocks of several hosts: brought together from messages, from a file, or left as they are."""

from __future__ import annotations

from msgflow.clocks.correction import apply_clocks, set_clocks
from msgflow.clocks.file import ClockSync, read_clock_sync

__all__ = ["ClockSync", "apply_clocks", "read_clock_sync", "set_clocks"]
