"""Finds CTF traces and reads them into Arrow batches; the only part that knows CTF.

`discover` lists the traces below some paths, `open` reads all of them as one set in time order.
Nothing here imports pyarrow before a trace is opened.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from msgflow.errors import UsageError
from msgflow.trace.archive import Unpacked
from msgflow.trace.ctf.losses import Continuation
from msgflow.trace.discovery import discover
from msgflow.trace.model import PACKET, Damage, EventBatch, Progress, TraceInfo, TraceLocation
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

READERS = ("auto", "msgflow", "bt2")


def open(
    paths: Sequence[str | Path],
    *,
    reader: str = "auto",
    strict: bool = False,
    after: Continuation | None = None,
) -> TraceSet:
    """Open all traces below `paths` as one set.

    Paths are CTF directories, directories above such, or archives of such (.tar, also with .gz, .xz
    or .zst, and .zip). Archives are unpacked to the temporary directory (TMPDIR) until the set is
    closed. The reader is 'msgflow' (its own decoder), 'bt2' (Babeltrace 2's Python bindings, which
    end at the first damage), or 'auto', which is 'msgflow'. `strict` ends at the first damage.
    `after` has the parts of the same recordings that were read before; it takes in these, which can
    be read only once then. Only msgflow's own decoder can go on like this.

    Raises:
        TraceError: there is no readable trace below a path, an archive cannot be unpacked, or
            the reader is not installed.
        UsageError: there is no reader of that name.
    """
    if reader not in READERS:
        raise UsageError(f"there is no reader {reader!r}", hint=f"use one of {', '.join(READERS)}")
    unpacked = Unpacked(paths)
    try:
        with unpacked.explained():
            locations = sorted(discover(unpacked.paths), key=lambda at: unpacked.shown(at.path))
            if reader == "bt2":
                from msgflow.trace.bt2_reader import Bt2TraceSet

                return Bt2TraceSet(locations, unpacked)
            from msgflow.trace.ctf.reader import CtfTraceSet

            return CtfTraceSet(locations, unpacked, strict=strict, after=after)
    except BaseException:
        unpacked.remove()
        raise
