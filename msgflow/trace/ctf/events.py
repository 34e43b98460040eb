"""Events of packets in memory: where they begin, their classes and times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msgflow.trace.ctf.event_header import read_headers
from msgflow.trace.ctf.event_positions import find_positions
from msgflow.trace.ctf.field_reader import EventReader
from msgflow.trace.ctf.field_types import BYTE, FieldError
from msgflow.trace.numpy_arrow import distinct

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from msgflow.trace.ctf.clock import Clock
    from msgflow.trace.ctf.packet_memory import Memory
    from msgflow.trace.ctf.packet_order import Entry
    from msgflow.trace.ctf.stream_layout import StreamLayout

# Some tracers end packets too early, but not by a day.
_SLACK_SECONDS = 86_400


@dataclass(frozen=True)
class Events:
    """Events of some packets, packet after packet."""

    counts: NDArray[np.int64]  # how many each packet has
    classes: NDArray[np.uint32]  # numbers of their classes
    clock: NDArray[np.uint64]  # values of the clock
    bodies: NDArray[np.int64]  # where contexts and payload begin: bytes of memory
    # Where headers begin: bytes of memory, or bits of the packet in streams whose headers are read
    # field by field.
    positions: NDArray[np.int64]


def find_events(
    layout: StreamLayout,
    memory: Memory,
    entries: Sequence[Entry],
    report: Callable[[Entry, int, str], None],
) -> None:
    """Fill in `Entry.events` of packets of one stream class, which lie in memory in this order.

    What follows damage in a packet is left out.
    """
    if layout.header is None:
        for entry in entries:
            entry.events, damage = _find_field_by_field(layout, memory, entry)
            if damage is not None:
                report(entry, *damage)
        return
    spans = [
        layout.span(entry.base, entry.packet.header.events_at, entry.packet.content_bits)
        for entry in entries
    ]
    for entry, found in zip(entries, find_positions(layout, memory, spans), strict=True):
        entry.events = found.positions - entry.base
        if found.problem is not None:
            position, message = found.problem
            report(entry, position - entry.base, message)


def read_events(layout: StreamLayout, memory: Memory, entries: Sequence[Entry]) -> Events:
    """Read the headers of all events that were found in these packets of one stream class."""
    counts = np.array([_begins(entry).size for entry in entries], np.int64)
    if layout.header is None:
        return _read_field_by_field(layout, memory, entries, counts)
    bases = np.array([entry.base for entry in entries], np.int64)
    positions = np.concatenate([_begins(entry) for entry in entries], dtype=np.int64)
    positions += np.repeat(bases, counts)
    befores = np.array([entry.clock_before for entry in entries], np.uint64)
    return Events(counts, *read_headers(layout, memory, positions, counts, befores), positions)


def without_absurd(
    layout: StreamLayout,
    entries: Sequence[Entry],
    events: Events,
    report: Callable[[Entry, int, str], None],
) -> Events:
    """Return the events without those whose times are far from their packets.

    `report` is called with the packet, the byte of the first of them, and a message.
    """
    limits = np.array([_limits(entry, layout.clock) for entry in entries], np.uint64).reshape(-1, 2)
    filled = np.flatnonzero(events.counts)
    if not filled.size:
        return events
    first = (np.cumsum(events.counts) - events.counts)[filled]
    is_early = np.minimum.reduceat(events.clock, first) < limits[filled, 0]
    is_late = np.maximum.reduceat(events.clock, first) > limits[filled, 1]
    if not (is_early | is_late).any():
        return events
    packets = np.repeat(np.arange(events.counts.size), events.counts)
    good = (events.clock >= limits[packets, 0]) & (events.clock <= limits[packets, 1])
    for place in distinct(packets[~good]).tolist():
        entry = entries[place]
        rows = np.flatnonzero((packets == place) & ~good)
        at = int(events.positions[rows[0]])
        offset = at // BYTE if layout.header is None else at - entry.base
        number = f"{rows.size} events" if rows.size > 1 else "an event"
        report(entry, offset, f"{number} with a time that makes no sense: left out")
    return Events(
        np.bincount(packets[good], minlength=events.counts.size),
        *(
            values[good]
            for values in (events.classes, events.clock, events.bodies, events.positions)
        ),
    )


def say_nothing(entry: Entry, offset: int, message: str) -> None:
    """Leave it to a later reading to report the damage of a packet."""


def event_reader_of(layout: StreamLayout, memory: Memory, entry: Entry, base: int) -> EventReader:
    """Return what reads events of a packet at the byte `base` field by field."""
    content = memoryview(memory.data)[base : base + entry.size]
    return EventReader(layout.trace, layout.stream, content, entry.packet.content_bits)


def _find_field_by_field(
    layout: StreamLayout, memory: Memory, entry: Entry
) -> tuple[NDArray[np.int64], tuple[int, str] | None]:
    """Return at which bits of a packet its events begin, and its damage: a byte, and why."""
    reader = event_reader_of(layout, memory, entry, entry.base)
    end = entry.packet.content_bits
    begins = []
    problem = None
    position = reader.begin(entry.packet.header.events_at)
    while position < end:
        try:
            following = reader.event_end(position)
            if following == position:
                raise FieldError("an event has no size")
        except FieldError as error:
            problem = (position // BYTE, str(error))
            break
        begins.append(position)
        position = reader.begin(following)
    return np.array(begins, np.int64), problem


def _read_field_by_field(
    layout: StreamLayout, memory: Memory, entries: Sequence[Entry], counts: NDArray[np.int64]
) -> Events:
    classes = []
    values = []
    for entry in entries:
        reader = event_reader_of(layout, memory, entry, entry.base)
        clock = entry.clock_before
        for position in _begins(entry).tolist():
            event, clock = reader.header(position, clock)
            classes.append(layout.classes[event.id].number)
            values.append(clock % (1 << 64))
    positions = np.concatenate([_begins(entry) for entry in entries])
    return Events(
        counts,
        np.array(classes, np.uint32),
        np.array(values, np.uint64),
        np.zeros(positions.size, np.int64),
        positions,
    )


def _limits(entry: Entry, clock: Clock) -> tuple[int, int]:
    """Return the first and last value of the clock that an event of a packet may have."""
    header = entry.packet.header
    first, last = clock.limits
    slack = _SLACK_SECONDS * clock.frequency
    if header.begin is not None:
        first = max(first, header.begin - slack)
    if header.end:
        last = min(last, max(header.end, entry.begin) + slack)
    return first, last


def _begins(entry: Entry) -> NDArray[np.int64]:
    assert entry.events is not None
    return entry.events
