"""Merges packets of all streams into batches whose events follow each other in time."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from msgflow.trace.ctf.events import Events, find_events, read_events, without_absurd
from msgflow.trace.ctf.loading import Loader

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from msgflow.trace.ctf.entries import Entry
    from msgflow.trace.ctf.memory import Memory

_NEVER_NS = 1 << 64
_MOST_EVENTS = 1 << 18


@dataclass(frozen=True)
class Batch:
    """Events that follow those of the batch before in the total order.

    The arrays have a row per event in memory; `order` picks those of the batch.

    Attributes:
        memory: where the packets lie.
        entries: the packets in memory, in the order of their rows.
        bases: where they lie in memory; `Entry.base` may be of a later batch already.
        new: which of them were not in the batch before.
        counts: rows of each packet.
        packets: which packet each row is in.
        classes: numbers of the event classes.
        clock: values of the clock.
        ts_ns: times.
        bodies: where contexts and payload begin.
        positions: where headers begin.
        cpus: the CPU of each packet.
        has_cpu: which packets have one; None if all have.
        order: rows of the events, in the total order.
    """

    memory: Memory
    entries: list[Entry]
    bases: list[int]
    new: list[bool]
    counts: NDArray[np.int64]
    packets: NDArray[np.int64]
    classes: NDArray[np.uint32]
    clock: NDArray[np.uint64]
    ts_ns: NDArray[np.int64]
    bodies: NDArray[np.int64]
    positions: NDArray[np.int64]
    cpus: NDArray[np.int32]
    has_cpu: NDArray[np.bool_] | None
    order: NDArray[np.int64]


def ordered_batches(
    entries: Sequence[Entry],
    size: int,
    report: Callable[[Entry, int, str], None],
) -> Iterator[Batch]:
    """Read packets, given in order of time, about `size` bytes of them at once.

    An event at or after the begin of the next unread packet may have to wait for events of that
    one: its packet stays in memory for the next batch. So no more is held than a batch and a packet
    or so per stream.

    `report` is called with a packet, the byte of it and a message for everything damaged.
    """
    loader = Loader()
    try:
        held: list[Entry] = []
        are_cut = True
        done = 0
        since_ns = -_NEVER_NS
        while done < len(entries) or held:
            budget = max(size, sum(entry.size for entry in held) // 2)
            first = done
            while done < len(entries) and budget > 0:
                budget -= entries[done].size
                done += 1
            until_ns = entries[done].order_ns if done < len(entries) else _NEVER_NS
            batch = _load(loader, held, entries[first:done], report)
            yield from _parts(_cut(batch, are_cut, since_ns, until_ns))
            held, are_cut = _unfinished(batch, until_ns)
            _forget(batch, held)
            since_ns = until_ns
    finally:
        loader.close()


def _load(
    loader: Loader,
    held: Sequence[Entry],
    new: Sequence[Entry],
    report: Callable[[Entry, int, str], None],
) -> Batch:
    entries = sorted([*held, *new], key=lambda entry: entry.place)
    is_held = set(map(id, held))

    def report_once(entry: Entry, offset: int, message: str) -> None:
        if id(entry) not in is_held:
            report(entry, offset, message)

    for entry in loader.load(entries):
        report(entry, 0, "the file has become shorter, the packet is gone")
        entry.events = np.empty(0, np.int64)
    memory = loader.memory
    parts: list[Events] = []
    times = []
    for layout, group in groupby(entries, key=lambda entry: entry.stream.layout):
        of_layout = list(group)
        find_events(layout, memory, [e for e in of_layout if e.events is None], report)
        events = read_events(layout, memory, of_layout)
        events = without_absurd(layout, of_layout, events, report_once)
        parts.append(events)
        clock = layout.stream.clock
        assert clock is not None
        times.append(clock.to_ns_array(events.clock))
    counts = np.concatenate([part.counts for part in parts])
    cpus = [entry.packet.header.cpu for entry in entries]
    return Batch(
        memory=memory,
        entries=entries,
        bases=[entry.base for entry in entries],
        new=[id(entry) not in is_held for entry in entries],
        counts=counts,
        packets=np.repeat(np.arange(counts.size), counts),
        classes=np.concatenate([part.classes for part in parts]),
        clock=np.concatenate([part.clock for part in parts]),
        ts_ns=np.concatenate(times),
        bodies=np.concatenate([part.bodies for part in parts]),
        positions=np.concatenate([part.positions for part in parts]),
        cpus=np.array([cpu or 0 for cpu in cpus], np.uint64).astype(np.int32),
        has_cpu=np.array([cpu is not None for cpu in cpus]) if None in cpus else None,
        order=np.empty(0, np.int64),
    )


def _cut(batch: Batch, are_cut: bool, since_ns: int, until_ns: int) -> Batch:
    """Pick the events before `until_ns`.

    Unless `are_cut`, held packets have events that are done: those before `since_ns`.
    """
    ts_ns = batch.ts_ns
    rows: NDArray[np.int64] | None = None
    if not are_cut:
        waits = np.repeat(np.array(batch.new), batch.counts) | (ts_ns >= since_ns)
        rows = np.flatnonzero(waits)
    # Stable: at the same time, rows stay in the order of streams and of places in a stream.
    order = np.argsort(ts_ns if rows is None else ts_ns[rows], kind="stable")
    if rows is not None:
        order = rows[order]
    if until_ns < _NEVER_NS:
        order = order[: np.searchsorted(ts_ns[order], until_ns)]
    return Batch(**{**vars(batch), "order": order})


def _parts(batch: Batch) -> Iterator[Batch]:
    """Yield the batch in parts, as large packets make it large: columns of it take memory."""
    new = batch.new
    for begin in range(0, max(batch.order.size, 1), _MOST_EVENTS):
        order = batch.order[begin : begin + _MOST_EVENTS]
        yield Batch(**{**vars(batch), "order": order, "new": new})
        new = [False] * len(new)


def _unfinished(batch: Batch, until_ns: int) -> tuple[list[Entry], bool]:
    """Return the packets that have events at or after this time, and whether only these are left.

    That is so unless time runs backward in one of them.
    """
    if until_ns >= _NEVER_NS:
        return [], True
    late = np.flatnonzero(batch.ts_ns >= until_ns)
    packets, first, counts = np.unique(batch.packets[late], return_index=True, return_counts=True)
    ends = np.cumsum(batch.counts)[packets]
    begins = ends - batch.counts[packets]
    held, are_cut = [], True
    for packet, begin, at, end, count in zip(
        packets.tolist(),
        begins.tolist(),
        late[first].tolist(),
        ends.tolist(),
        counts.tolist(),
        strict=True,
    ):
        entry = batch.entries[packet]
        held.append(entry)
        assert entry.events is not None
        if count == end - at and entry.events.size == end - begin:
            if at > begin:
                entry.events = entry.events[at - begin :]
                entry.clock_before = int(batch.clock[at - 1])
        else:
            are_cut = False
    return held, are_cut


def _forget(batch: Batch, held: Sequence[Entry]) -> None:
    """Drop what was found in packets that are done."""
    kept = set(map(id, held))
    for entry in batch.entries:
        if id(entry) not in kept:
            entry.events = None
