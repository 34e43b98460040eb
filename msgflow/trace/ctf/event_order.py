"""Order of events: packets of all streams, merged into batches of events in order of time.

A packet of each CPU must be in memory at the same time, and packets may have many megabytes. So
large ones are cut into pieces that are read like packets.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from msgflow.trace.ctf.events import Events, events_of, joined, say_nothing
from msgflow.trace.ctf.packet_memory import Loader, Memory
from msgflow.trace.ctf.packet_order import Entry, OnDamage, PacketEvents
from msgflow.trace.ctf.stream_layout import GAP, StreamLayout
from msgflow.trace.numpy_arrow import Integers, Truths, distinct

_NEVER_NS = 1 << 64
MOST_EVENTS = 1 << 18
# Bytes of a piece. Pieces begin at multiples of `GAP`, as this one is: no two at the same.
PIECE = 1 << 19
LARGEST_WHOLE = 2 * PIECE


@dataclass(frozen=True)
class Batch:
    """What is in memory, and which of the events there follow those of the batch before."""

    memory: Memory
    entries: list[Entry]  # the packets in memory, in the order of their rows
    bases: list[int]  # where they lie in memory; `Entry.base` may already belong to a later batch
    is_new: Truths  # which of the packets were not there before
    cpus: NDArray[np.int32]  # the CPU of each packet
    has_cpu: Truths | None  # which packets have one; None if all have
    counts: Integers  # events of each packet
    events: Events  # those in these packets
    # Times to order the events by: none is before `Entry.order_ns`, where batches are cut. The
    # order would differ with their size.
    rank_ns: Integers
    rows: Integers = field(default_factory=lambda: np.empty(0, np.int64))  # events, in order
    # Summaries of the packets that were in no batch before.
    packets: list[PacketEvents] = field(default_factory=list)


def ordered_batches(
    entries: Sequence[Entry], size: int, report: OnDamage, whole: Collection[StreamLayout] = ()
) -> Generator[Batch, None, None]:
    """Read packets, about `size` bytes at once, and yield their events in order of time.

    An event at or after the begin of the next unread packet may have to wait for events of that
    one: its packet stays in memory for the next batch. Of large packets it is a piece that stays.
    So no more is held than a batch and a piece or so per stream.
    """
    loader = Loader()
    try:
        held: list[Entry] = []
        are_cut = True
        unread = [(entry.order_ns, entry.place, entry) for entry in entries]
        heapq.heapify(unread)
        since_ns = -_NEVER_NS
        while unread or held:
            budget = max(size, sum(entry.size for entry in held) // 2)
            new: list[Entry] = []
            packets: list[PacketEvents] = []
            while unread and budget > 0:
                _, _, entry = heapq.heappop(unread)
                found = None if entry.stream.layout in whole else cut(loader, entry, report)
                if found is not None:
                    packets.append(found[0])
                    for piece in found[1]:
                        heapq.heappush(unread, (piece.order_ns, piece.place, piece))
                    continue
                new.append(entry)
                budget -= entry.size
            until_ns = unread[0][0] if unread else _NEVER_NS
            loaded = _load(loader, held, new, report)
            packets += _packets(loaded)
            order = _order(loaded, are_cut, since_ns, until_ns)
            # In parts: columns of all events of large packets take much memory.
            for begin in range(0, max(order.size, 1), MOST_EVENTS):
                yield replace(loaded, rows=order[begin : begin + MOST_EVENTS], packets=packets)
                packets = []
            held, are_cut = _unfinished(loaded, until_ns)
            for entry in {*loaded.entries} - {*held}:
                entry.events = None
            since_ns = until_ns
            # Free its memory before the next packets are loaded.
            del loaded
    finally:
        loader.close()


def _load(loader: Loader, held: Sequence[Entry], new: Sequence[Entry], report: OnDamage) -> Batch:
    entries = sorted([*held, *new], key=lambda entry: entry.place)
    is_held = {*held}

    def report_once(entry: Entry, offset: int, message: str) -> None:
        if entry not in is_held:
            report(entry, offset, message)

    for entry in loader.load(entries):
        report(entry, 0, "the file has become shorter, the packet is gone")
        entry.events = np.empty(0, np.int64)
    parts: list[Events] = []
    number = 0
    for layout, group in groupby(entries, key=lambda entry: entry.stream.layout):
        of_layout = list(group)
        parts.append(events_of(layout, loader.memory, of_layout, report, report_once, first=number))
        number += len(of_layout)
    events = joined(parts)
    counts = np.diff(np.searchsorted(events.packets, np.arange(len(entries) + 1)))
    cpus = [entry.packet.header.cpu for entry in entries]
    return Batch(
        memory=loader.memory,
        entries=entries,
        bases=[entry.base for entry in entries],
        is_new=np.array([entry not in is_held for entry in entries]),
        cpus=np.array([cpu or 0 for cpu in cpus], np.uint64).astype(np.int32),
        has_cpu=np.array([cpu is not None for cpu in cpus]) if None in cpus else None,
        counts=counts,
        events=events,
        rank_ns=_ranks(entries, counts, events.ts_ns),
    )


def _ranks(entries: Sequence[Entry], counts: Integers, ts_ns: Integers) -> Integers:
    begins = np.array([entry.order_ns for entry in entries], np.int64)
    filled = np.flatnonzero(counts)
    first = (np.cumsum(counts) - counts)[filled]
    if not filled.size or (np.minimum.reduceat(ts_ns, first) >= begins[filled]).all():
        return ts_ns
    # A damaged packet has events that are earlier than its begin.
    return np.maximum(ts_ns, np.repeat(begins, counts))


def _order(loaded: Batch, are_cut: bool, since_ns: int, until_ns: int) -> Integers:
    """Return the rows of the events before `until_ns` in the total order.

    Unless `are_cut`, held packets have events that are done: those before `since_ns`.
    """
    rank_ns = loaded.rank_ns
    rows: Integers | None = None
    if not are_cut:
        waits = loaded.is_new[loaded.events.packets] | (rank_ns >= since_ns)
        rows = np.flatnonzero(waits)
    # Stable: at the same time, rows stay in the order of streams and of places in a stream.
    order = np.argsort(rank_ns if rows is None else rank_ns[rows], kind="stable")
    if rows is not None:
        order = rows[order]
    if until_ns < _NEVER_NS:
        order = order[: np.searchsorted(rank_ns[order], until_ns)]
    return order


def _packets(loaded: Batch) -> Iterator[PacketEvents]:
    """Yield summaries of the new packets; `cut` makes those of packets in pieces."""
    ts_ns, clock, owners = loaded.events.ts_ns, loaded.events.clock, loaded.events.packets
    falls = np.flatnonzero(ts_ns[1:] < ts_ns[:-1]) + 1
    backward = set(owners[falls][owners[falls] == owners[falls - 1]].tolist())
    ends = np.cumsum(loaded.counts).tolist()
    counts = loaded.counts.tolist()
    for place, (entry, new) in enumerate(zip(loaded.entries, loaded.is_new.tolist(), strict=True)):
        if not new or entry.until is not None:
            continue
        count, end = counts[place], ends[place]
        yield PacketEvents(
            entry,
            count,
            int(clock[end - count]) if count else None,
            int(clock[end - 1]) if count else None,
            int(ts_ns[end - 1]) if count else None,
            place in backward,
        )


def _unfinished(loaded: Batch, until_ns: int) -> tuple[list[Entry], bool]:
    """Return the packets with events at or after this time, and whether they have no others left.

    Others are left if time runs backward in a packet.
    """
    if until_ns >= _NEVER_NS:
        return [], True
    late = np.flatnonzero(loaded.rank_ns >= until_ns)
    packets, first, counts = np.unique(
        loaded.events.packets[late], return_index=True, return_counts=True
    )
    ends = np.cumsum(loaded.counts)[packets]
    begins = ends - loaded.counts[packets]
    held, are_cut = [], True
    columns = (packets, begins, late[first], ends, counts)
    for packet, begin, at, end, count in zip(*(c.tolist() for c in columns), strict=True):
        entry = loaded.entries[packet]
        held.append(entry)
        assert entry.events is not None
        if count == end - at and entry.events.size == end - begin:
            if at > begin:
                entry.events = entry.events[at - begin :]
                entry.clock_before = int(loaded.events.clock[at - 1])
        else:
            are_cut = False
    return held, are_cut


def cut(loader: Loader, entry: Entry, report: OnDamage) -> tuple[PacketEvents, list[Entry]] | None:
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
    layout = entry.stream.layout
    entry.base = 0
    events = events_of(layout, memory, [entry], report, say_nothing)
    entry.base = -1
    ts_ns, begins = events.ts_ns, events.positions
    assert entry.events is not None
    is_sound = 0 < begins.size == entry.events.size and (ts_ns[1:] >= ts_ns[:-1]).all()
    if not is_sound:
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
