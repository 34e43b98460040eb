"""Declarations of a trace's metadata: its clocks, the trace class, stream and event classes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.field_types import MetadataError
from msgflow.trace.numpy_arrow import Integers

GIGA = 1_000_000_000
LATEST_NS = 1 << 62
"""Limit of times on both sides of the epoch, 146 years: all differences fit into 64 bits."""

_HIGHEST_FREQUENCY = 1 << 63
# Up to this frequency, sums and products in `Clock.to_ns_array` fit into 64 bits.
_HIGHEST_FAST_FREQUENCY = 9 * GIGA
_SMALLEST_ID, _LARGEST_ID = -(1 << 63), (1 << 64) - 1


@dataclass(frozen=True)
class Clock:
    """A clock of the metadata."""

    frequency: int = GIGA  # in hertz
    offset_seconds: int = 0  # from the epoch to its origin, whole seconds
    offset_cycles: int = 0  # the rest of that offset, in cycles; may well be more than a second
    name: str | None = None
    uuid: str | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.frequency < _HIGHEST_FREQUENCY:
            raise MetadataError(f"a clock of {self.frequency} Hz makes no sense")

    def plausible(self, notes: list[str]) -> Clock:
        """Return the clock; without its offset, and with a note, if the offset makes no sense."""
        if abs(self.to_ns(0)) < LATEST_NS:
            return self
        name = "" if self.name is None else f" {self.name!r}"
        notes.append(f"the offset of the clock{name} makes no sense: its times count from 0")
        return replace(self, offset_seconds=0, offset_cycles=0)

    @cached_property
    def limits(self) -> tuple[int, int]:
        """The first and last value whose times make sense."""
        first = -((LATEST_NS - 1 + self.offset_seconds * GIGA) * self.frequency // GIGA)
        last = (LATEST_NS - 1 - self.offset_seconds * GIGA) * self.frequency // GIGA
        return max(first - self.offset_cycles, 0), min(last - self.offset_cycles, (1 << 64) - 1)

    def to_ns(self, value: int) -> int:
        """Return the time of a clock value in epoch nanoseconds, rounded down."""
        cycles = value + self.offset_cycles
        return cycles * GIGA // self.frequency + self.offset_seconds * GIGA

    def to_ns_array(self, values: NDArray[np.uint64]) -> Integers:
        """Return the times of many values; those beyond 64 bits wrap round."""
        origin = self.offset_seconds * GIGA
        if self.frequency == GIGA:
            return (values + np.uint64((origin + self.offset_cycles) % 2**64)).view(np.int64)
        if self.frequency > _HIGHEST_FAST_FREQUENCY:
            cycles_of = values.astype(object) + self.offset_cycles
            wrapped = (cycles_of * GIGA // self.frequency + origin) % 2**64
            return wrapped.astype(np.uint64).view(np.int64)
        seconds, cycles = divmod(self.offset_cycles, self.frequency)
        whole, part = np.divmod(values, np.uint64(self.frequency))
        # Both parts are below one second. Their sum times a billion fits for any clock of up to
        # nine gigahertz.
        part_ns = (part + np.uint64(cycles)) * np.uint64(GIGA) // np.uint64(self.frequency)
        origin_ns = np.uint64((origin + seconds * GIGA) % 2**64)
        return (whole * np.uint64(GIGA) + part_ns + origin_ns).view(np.int64)


@dataclass(eq=False)
class EventClass:
    """One kind of event."""

    id: int
    name: str
    specific_context: ctf.Structure = field(default_factory=ctf.Structure)
    payload: ctf.Structure = field(default_factory=ctf.Structure)


@dataclass(eq=False)
class StreamClass:
    """One kind of stream (LTTng: channel) and its events."""

    id: int
    packet_context: ctf.Structure = field(default_factory=ctf.Structure)
    event_header: ctf.Structure = field(default_factory=ctf.Structure)
    event_context: ctf.Structure = field(default_factory=ctf.Structure)
    clock: Clock | None = None
    events: dict[int, EventClass] = field(default_factory=dict)
    has_time: bool = True  # its events have times; if not, `clock` only counts packets


@dataclass(eq=False)
class TraceClass:
    """All of a trace's metadata."""

    uuid: str | None = None
    environment: dict[str, int | str] = field(default_factory=dict)
    packet_header: ctf.Structure = field(default_factory=ctf.Structure)
    streams: dict[int, StreamClass] = field(default_factory=dict)
    # Messages about declarations left out because they make no sense.
    notes: list[str] = field(default_factory=list)

    def add_event(self, stream: StreamClass, event: EventClass) -> None:
        """Add an event class to a stream class."""
        if not _SMALLEST_ID <= event.id <= _LARGEST_ID:
            self.notes.append(f"no event can have the id {event.id} of {event.name!r}: left out")
            return
        if event.id in stream.events:
            raise MetadataError(f"there are two events {event.id} in stream {stream.id}")
        stream.events[event.id] = event
