"""Positions of events in a packet: the only step that goes from event to event."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msgflow.trace.ctf.walk import FieldError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from msgflow.trace.ctf.layout import Span, StreamLayout
    from msgflow.trace.ctf.memory import Memory

_CODES = {1: "B", 2: "H", 4: "I", 8: "Q"}
BEYOND_END = "an event goes beyond the end of the packet"


@dataclass
class Scanned:
    """The events of a packet, up to its damage if it has any.

    Attributes:
        positions: bytes of memory at which event headers begin, ascending.
        problem: where it cannot be read further and why, None if all is well.
    """

    positions: NDArray[np.int64]
    problem: tuple[int, str] | None = None


def scan(layout: StreamLayout, memory: Memory, span: Span) -> Scanned:
    """Find the events of a packet; `layout.header` must be known."""
    header = layout.header
    assert header is not None
    place = header.selector
    read = struct.Struct((">" if place.big_endian else "<") + _CODES[place.width]).unpack_from
    offset, mask = place.offsets[0], place.mask << place.shift
    sizes, last_residue = layout.sizes_by_selector, layout.residues - 1
    data, end = memory.data, span.end
    positions: list[int] = []
    append = positions.append
    problem = None
    position = span.begin
    while position < end:
        try:
            while position < end:
                append(position)
                position += sizes[position & last_residue][read(data, position + offset)[0] & mask]
        except KeyError:  # the size of this event varies, or no event begins here
            try:
                position = layout.next_event(data, position, span)
            except FieldError as error:
                problem = (positions.pop(), str(error))
                break
    if problem is None and positions:
        problem = _problem_of_last(layout, memory, span, positions[-1], position)
        if problem is not None:
            positions.pop()
    return Scanned(np.array(positions, np.int64), problem)


def _problem_of_last(
    layout: StreamLayout, memory: Memory, span: Span, last: int, following: int
) -> tuple[int, str] | None:
    """Return where and why the last event is damaged, None if it fits into the packet.

    `following` is where the next event would begin. A size goes from header to header, with the
    padding in between: where a packet ends within padding, the last event must be looked at.
    """
    if following > span.end:
        return last, BEYOND_END
    if span.limit < span.end:
        try:
            layout.next_event(memory.data, last, span)
        except FieldError as error:
            return last, str(error)
    return None
