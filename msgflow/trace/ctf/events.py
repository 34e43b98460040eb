"""Events of packets in memory: where they begin, their classes and times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from msgflow.trace.ctf.declarations import Clock
from msgflow.trace.ctf.event_header import Form, Place
from msgflow.trace.ctf.event_positions import find_positions
from msgflow.trace.ctf.field_reader import EventReader
from msgflow.trace.ctf.field_types import BYTE, FieldError
from msgflow.trace.ctf.packet_memory import Memory
from msgflow.trace.ctf.packet_order import Entry, OnDamage
from msgflow.trace.ctf.stream_layout import StreamLayout
from msgflow.trace.numpy_arrow import Integers, Values, distinct

# Some tracers end packets too early, but not by a day.
_SLACK_SECONDS = 86_400


@dataclass(frozen=True)
class Events:
    """Events of some packets, packet after packet, or any of them; a row each."""

    packets: NDArray[np.int32]  # which packet each is in
    classes: NDArray[np.uint32]  # numbers of their classes
    clock: NDArray[np.uint64]  # values of the clock
    ts_ns: Integers
    bodies: Integers  # where contexts and payload begin: bytes of memory
    # Where headers begin: bytes of memory, or bits of the packet in streams whose headers are read
    # field by field.
    positions: Integers

    def take(self, rows: Values) -> Events:
        """Return these rows, or those that are true."""
        return Events(*(column[rows] for column in vars(self).values()))


def joined(parts: list[Events]) -> Events:
    """Return the events of all parts, one part after the other."""
    if len(parts) == 1:
        return parts[0]
    return Events(*map(np.concatenate, zip(*(vars(part).values() for part in parts), strict=True)))


def events_of(
    layout: StreamLayout,
    memory: Memory,
    entries: Sequence[Entry],
    report: OnDamage,
    report_absurd: OnDamage,
    first: int = 0,
) -> Events:
    """Find the events of packets of one stream class, which lie in memory in this order.

    The packets are numbered from `first`. `Entry.events` is filled in, unless they were found
    before. What follows damage in a packet is left out, and events whose times are far from their
    packet. Both are reported, with the packet, a byte of it and a message.
    """
    _find_events(layout, memory, [entry for entry in entries if entry.events is None], report)
    events = _read_events(layout, memory, entries, first)
    return _without_absurd(layout, entries, events, first, report_absurd)


def _find_events(
    layout: StreamLayout, memory: Memory, entries: Sequence[Entry], report: OnDamage
) -> None:
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


def _read_events(
    layout: StreamLayout, memory: Memory, entries: Sequence[Entry], first: int
) -> Events:
    begins = [_begins(entry) for entry in entries]
    counts = np.array([each.size for each in begins], np.int64)
    packets = np.repeat(np.arange(first, first + counts.size, dtype=np.int32), counts)
    positions = np.concatenate(begins, dtype=np.int64)
    if layout.header is None:
        classes, clock = _read_field_by_field(layout, memory, entries)
        bodies = np.zeros_like(positions)
    else:
        positions += np.repeat(np.array([entry.base for entry in entries], np.int64), counts)
        befores = np.array([entry.clock_before for entry in entries], np.uint64)
        classes, clock, bodies = _read_headers(layout, memory, positions, counts, befores)
    ts_ns = layout.clock.to_ns_array(clock)
    return Events(packets, classes, clock, ts_ns, bodies, positions)


def _without_absurd(
    layout: StreamLayout, entries: Sequence[Entry], events: Events, first: int, report: OnDamage
) -> Events:
    if not events.packets.size:
        return events
    limits = np.array([_limits(entry, layout.clock) for entry in entries], np.uint64)
    counts = np.array([_begins(entry).size for entry in entries])
    begins = (np.cumsum(counts) - counts)[counts > 0]
    earliest, latest = limits[counts > 0].T
    is_early = np.minimum.reduceat(events.clock, begins) < earliest
    is_late = np.maximum.reduceat(events.clock, begins) > latest
    if not (is_early | is_late).any():
        return events
    packets = events.packets - first
    good = (events.clock >= limits[packets, 0]) & (events.clock <= limits[packets, 1])
    for place in distinct(packets[~good]).tolist():
        entry = entries[place]
        rows = np.flatnonzero((packets == place) & ~good)
        at = int(events.positions[rows[0]])
        offset = at // BYTE if layout.header is None else at - entry.base
        number = f"{rows.size} events" if rows.size > 1 else "an event"
        report(entry, offset, f"{number} with a time that makes no sense: left out")
    return events.take(good)


def say_nothing(entry: Entry, offset: int, message: str) -> None:
    """Leave it to a later reading to report the damage of a packet."""


def event_reader_of(layout: StreamLayout, memory: Memory, entry: Entry, base: int) -> EventReader:
    """Return what reads events of a packet at the byte `base` field by field."""
    content = memoryview(memory.data)[base : base + entry.size]
    return EventReader(layout.trace, layout.stream, content, entry.packet.content_bits)


def _find_field_by_field(
    layout: StreamLayout, memory: Memory, entry: Entry
) -> tuple[Integers, tuple[int, str] | None]:
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
    layout: StreamLayout, memory: Memory, entries: Sequence[Entry]
) -> tuple[NDArray[np.uint32], NDArray[np.uint64]]:
    classes = []
    values = []
    for entry in entries:
        reader = event_reader_of(layout, memory, entry, entry.base)
        clock = entry.clock_before
        for position in _begins(entry).tolist():
            event, clock = reader.header(position, clock)
            classes.append(layout.classes[event.id].number)
            values.append(clock % (1 << 64))
    return np.array(classes, np.uint32), np.array(values, np.uint64)


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


def _begins(entry: Entry) -> Integers:
    assert entry.events is not None
    return entry.events


def _read_headers(
    layout: StreamLayout,
    memory: Memory,
    positions: Integers,
    counts: Integers,
    befores: NDArray[np.uint64],
) -> tuple[NDArray[np.uint32], NDArray[np.uint64], Integers]:
    """Return class, clock and body of the events at these positions, as `Events` has them.

    `positions` are the bytes of memory at which events begin, packet after packet. `counts` are the
    events of each packet, `befores` the values of the clock before the first event of each.
    """
    reader = _HeaderColumns(layout, memory, positions)
    owner_befores = befores[counts > 0]
    firsts = (np.cumsum(counts) - counts)[counts > 0]
    header = layout.known_header
    selector = reader.gather(header.selector, slice(None))
    classes = np.empty(positions.size, np.uint32)
    values = np.empty(positions.size, np.uint64)
    bodies = np.empty(positions.size, np.int64)
    whole = []
    for form, rows in reader.rows_of_forms(selector):
        classes[rows] = reader.classes(form, selector, rows)
        bodies[rows] = positions[rows] + reader.by_residue(form.sizes, rows)
        if form.time is not None:
            values[rows] = reader.gather(form.time, rows)
            if form.time.bits == 64:
                whole.append(np.arange(positions.size)[rows])
        else:
            values[rows] = np.repeat(befores, counts)[rows]
    if header.narrow_bits is None:
        return classes, values, bodies
    whole_rows = np.sort(np.concatenate([*whole, np.empty(0, np.int64)]))
    clock = _unwrapped(values, header.narrow_bits, firsts, owner_befores, whole_rows)
    return classes, clock, bodies


class _HeaderColumns:
    def __init__(self, layout: StreamLayout, memory: Memory, positions: Integers) -> None:
        self._layout = layout
        self._memory = memory
        self._positions = positions

    def by_residue(self, values: tuple[int, ...], rows: Any) -> Any:
        """Return for each row the value that belongs to the residue of its position."""
        if len(set(values)) == 1:
            return values[0]
        residue = self._positions[rows] & (self._layout.residues - 1)
        return np.array(values, np.int64)[residue]

    def gather(self, place: Place, rows: Any) -> Values:
        at = self._positions[rows] + self.by_residue(place.offsets, rows)
        values: Values = self._memory.view(place.dtype)[at]
        values = values.astype(f"u{place.width}", copy=False)
        if place.shift:
            values = values >> place.shift
        if place.bits < place.width * 8:
            values = values & place.mask
        return values

    def rows_of_forms(self, selector: Values) -> Iterator[tuple[Form, Any]]:
        """Yield the forms that headers have, and the rows of each."""
        header = self._layout.known_header
        if len(header.forms) == 1:
            yield header.forms[0], slice(None)
            return
        remaining = np.arange(selector.size)
        for form in header.forms:
            matches = np.zeros(remaining.size, np.bool_)
            for first, last in form.choice.ranges if form.choice else ():
                if last < 0 or first > header.selector.mask:
                    continue
                low, high = max(first, 0), min(last, header.selector.mask)
                matches |= (selector[remaining] >= low) & (selector[remaining] <= high)
            if remaining.size == selector.size and matches.all():
                # The usual case: all events of a batch have the short form.
                yield form, slice(None)
                return
            if matches.any():
                yield form, remaining[matches]
            remaining = remaining[~matches]

    def classes(self, form: Form, selector: Values, rows: Any) -> Any:
        layout = self._layout
        if form.id is None:
            return layout.classes[layout.only_id].number
        is_selector = form.id == layout.known_header.selector
        ids = selector[rows] if is_selector else self.gather(form.id, rows)
        possible = range(form.id.mask + 1)
        known = np.array(sorted(i for i in layout.classes if i in possible), np.uint64)
        numbers = np.array([layout.classes[int(i)].number for i in known], np.uint32)
        return numbers[np.searchsorted(known, ids)]


def _unwrapped(
    values: NDArray[np.uint64],
    bits: int,
    firsts: Integers,
    befores: NDArray[np.uint64],
    whole: Integers,
) -> NDArray[np.uint64]:
    """Turn the low bits of a clock into its values.

    A time stamp is the first value at or after the previous one with these low bits, and the
    previous one of a packet's first event is that before it, or the packet's begin. So the
    distances are known from the low bits alone, and their sum from a whole value on is the clock.

    `values` are low bits of `bits` bits, but whole values at the rows `whole`. Packets begin at the
    rows `firsts`; `befores` are the values of the clock before these.
    """
    if not values.size:
        return values
    distance = np.empty_like(values)
    np.subtract(values[1:], values[:-1], out=distance[1:])
    distance[firsts] = values[firsts] - befores
    distance &= np.uint64((1 << bits) - 1)
    known = np.zeros(values.size, np.bool_)
    known[firsts] = True
    known[whole] = True
    clock = np.cumsum(distance, dtype=np.uint64)
    starts = np.flatnonzero(known)
    start_values = np.empty(values.size, np.uint64)
    start_values[firsts] = befores + distance[firsts]
    start_values[whole] = values[whole]
    shifts = start_values[starts] - clock[starts]
    clock += np.repeat(shifts, np.diff(starts, append=values.size))
    return clock
