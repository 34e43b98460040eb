"""Recordings that are made now: LTTng sessions, from checks before to the last packet."""

from __future__ import annotations

from msgflow.record.daemon import session_daemon
from msgflow.record.event_cost import USUAL_NS, event_cost_ns
from msgflow.record.lttng import sessions
from msgflow.record.profile import read_rate
from msgflow.record.python_path import PYTHON_NODES, with_python_nodes
from msgflow.record.recording import BYTES_OF_EVENT, Recorded, Status, record
from msgflow.record.session import (
    EVENTS,
    Channel,
    recording_session,
    rotated,
    temporary_directory,
)

__all__ = [
    "BYTES_OF_EVENT",
    "EVENTS",
    "PYTHON_NODES",
    "USUAL_NS",
    "Channel",
    "Recorded",
    "Status",
    "event_cost_ns",
    "read_rate",
    "record",
    "recording_session",
    "rotated",
    "session_daemon",
    "sessions",
    "temporary_directory",
    "with_python_nodes",
]
