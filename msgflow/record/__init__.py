"""Recordings that are made now: LTTng sessions, from checks before to the last packet."""

from __future__ import annotations

from msgflow.record.event_cost import USUAL_NS, event_cost_ns
from msgflow.record.lttng import sessions
from msgflow.record.profile import read_rate
from msgflow.record.python_path import PYTHON_NODES
from msgflow.record.recording import BYTES_OF_EVENT, Recorded, Status, record
from msgflow.record.session import Channel, rotated, temporary_directory

__all__ = [
    "BYTES_OF_EVENT",
    "PYTHON_NODES",
    "USUAL_NS",
    "Channel",
    "Recorded",
    "Status",
    "event_cost_ns",
    "read_rate",
    "record",
    "rotated",
    "sessions",
    "temporary_directory",
]
