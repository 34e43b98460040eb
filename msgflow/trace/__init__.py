"""Finds CTF traces and reads them into Arrow batches; the only part that knows CTF.

`discover` lists the traces below some paths, `open` reads all of them as one set in time order.
Nothing here imports pyarrow before a trace is opened.
"""

from msgflow.trace.ctf.losses import Continuation
from msgflow.trace.discovery import discover
from msgflow.trace.model import PACKET, Damage, EventBatch, Progress, TraceInfo, TraceLocation
from msgflow.trace.reader_choice import open
from msgflow.trace.trace_set import TraceSet

__all__ = [
    "PACKET",
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
