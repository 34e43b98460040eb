"""Cuts large packets into pieces, which are read like packets.

A packet of each CPU has to be at hand, and they may have many megabytes.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from msgflow.trace.ctf.entries import PacketEvents
from msgflow.trace.ctf.events import find_events, read_events, without_absurd
from msgflow.trace.ctf.layout import GAP
from msgflow.trace.numpy_arrow import distinct

if TYPE_CHECKING:
    from collections.abc import Callable

    from msgflow.trace.ctf.entries import Entry
    from msgflow.trace.ctf.loading import Loader

# A multiple of `GAP`: so no two pieces begin at the same.
_PIECE = 1 << 19
_LARGEST_WHOLE = 2 * _PIECE


def cut(
    loader: Loader, entry: Entry, report: Callable[[Entry, int, str], None]
) -> tuple[PacketEvents, list[Entry]] | None:
    """Return what the events of a packet say of it, and its pieces in order of time.

    Its events are found once, for all pieces; `report` is called for what is damaged.

    Returns:
        None if it is better read as a whole: it is small, a piece already, empty, or its times
        make no sense.
    """
    if entry.size <= _LARGEST_WHOLE or entry.until is not None:
        return None
    memory = loader.alone(entry)
    if memory is None:
        return None
    layout, clock_class = entry.stream.layout, entry.stream.layout.stream.clock
    assert clock_class is not None
    entry.base = 0
    find_events(layout, memory, [entry], report)
    events = read_events(layout, memory, [entry])
    is_sound = without_absurd(layout, [entry], events, _say_nothing) is events
    entry.base = -1
    ts_ns = clock_class.to_ns_array(events.clock)
    begins = events.positions
    if not (is_sound and begins.size and (ts_ns[1:] >= ts_ns[:-1]).all()):
        return None
    entry.events = None
    first = distinct(np.searchsorted(begins, np.arange(0, begins[-1] + 1, _PIECE)))
    pieces = []
    for at, end in pairwise([*first.tolist(), begins.size]):
        # Positions are laid out alike that differ by a multiple of it.
        skipped = int(begins[at]) // GAP * GAP
        piece = replace(
            entry,
            order_ns=max(entry.order_ns, int(ts_ns[at])),
            skipped=skipped,
            until=int(begins[end]) if end < begins.size else entry.size,
            events=(begins[at:end] - skipped).astype(np.int32),
        )
        if at:
            piece.clock_before = int(events.clock[at - 1])
        pieces.append(piece)
    clock = events.clock
    told = PacketEvents(
        entry, begins.size, int(clock[0]), int(clock[-1]), int(ts_ns[-1]), falls_back=False
    )
    return told, pieces


def _say_nothing(entry: Entry, offset: int, message: str) -> None:
    pass
