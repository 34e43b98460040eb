"""Clocks of several hosts: corrected by messages, by a file, or not at all."""

from __future__ import annotations

from msgflow.clocks.clocks_file import ClockSync, read_clock_sync
from msgflow.clocks.correction import apply_clocks, set_clocks

__all__ = ["ClockSync", "apply_clocks", "read_clock_sync", "set_clocks"]
