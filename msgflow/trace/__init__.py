"""Finds CTF traces and reads them into Arrow batches; the only part that knows CTF.

`discover` lists the traces below some paths, `open` reads all of them as one set in time order.
Nothing here imports pyarrow before a trace is opened.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgflow.trace.ctf.losses import Continuation
from msgflow.trace.discovery import discover
from msgflow.trace.model import Damage, EventBatch, Progress, TraceInfo, TraceLocation
from msgflow.trace.reader_choice import open
from msgflow.trace.trace_set import TraceSet

if TYPE_CHECKING:
    from msgflow.trace.schemas import COMMON_SCHEMA, PACKET, PACKET_SCHEMA

__all__ = [
    "COMMON_SCHEMA",
    "PACKET",
    "PACKET_SCHEMA",
    "Continuation",
    "Damage",
    "EventBatch",
    "Progress",
    "TraceInfo",
    "TraceLocation",
    "TraceSet",
    "discover",
    "open",
]


def __getattr__(name: str) -> Any:
    """Deliver the schemas, whose definition needs pyarrow, at their first use."""
    if name in {"COMMON_SCHEMA", "PACKET", "PACKET_SCHEMA"}:
        from msgflow.trace import schemas

        return getattr(schemas, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
