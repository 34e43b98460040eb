"""Large packets, cut into pieces that are read like packets.

A packet of each CPU must be in memory at the same time, and packets may have many megabytes.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from msgflow.trace.ctf.events import find_events, read_events, say_nothing, without_absurd
from msgflow.trace.ctf.packet_order import PacketEvents
from msgflow.trace.ctf.stream_layout import GAP
from msgflow.trace.numpy_arrow import distinct

if TYPE_CHECKING:
    from collections.abc import Callable

    from msgflow.trace.ctf.packet_memory import Loader
    from msgflow.trace.ctf.packet_order import Entry

# Bytes of a piece. Pieces begin at multiples of `GAP`, as this one is: no two at the same.
PIECE = 1 << 19
LARGEST_WHOLE = 2 * PIECE


def cut(
    loader: Loader, entry: Entry, report: Callable[[Entry, int, str], None]
) -> tuple[PacketEvents, list[Entry]] | None:
    """Return a packet's times and counts, and its pieces in order of time.

    Its events are found once, for all pieces; `report` is called for damage. None says that the
    packet is better read as a whole: it is small, a piece already, empty, or its times make no
    sense.
    """
    if entry.size <= LARGEST_WHOLE or entry.until is not None:
        return None
    memory = loader.alone(entry)
    if memory is None:
        return None
    layout, clock_class = entry.stream.layout, entry.stream.layout.stream.clock
    assert clock_class is not None
    entry.base = 0
    find_events(layout, memory, [entry], report)
    events = read_events(layout, memory, [entry])
    is_sound = without_absurd(layout, [entry], events, say_nothing) is events
    entry.base = -1
    ts_ns = clock_class.to_ns_array(events.clock)
    begins = events.positions
    if not (is_sound and begins.size and (ts_ns[1:] >= ts_ns[:-1]).all()):
        return None
    entry.events = None
    first = distinct(np.searchsorted(begins, np.arange(0, begins[-1] + 1, PIECE)))
    pieces = []
    for at, end in pairwise([*first.tolist(), begins.size]):
        # Events have the same layout at positions that differ by a multiple of `GAP`.
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
    summary = PacketEvents(
        entry, begins.size, int(clock[0]), int(clock[-1]), int(ts_ns[-1]), falls_back=False
    )
    return summary, pieces
