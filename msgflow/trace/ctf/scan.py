"""Finds where events begin, packet after packet: best for few packets."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msgflow.trace.ctf.walk import FieldError

if TYPE_CHECKING:
    from collections.abc import Sequence

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


def scan(layout: StreamLayout, memory: Memory, spans: Sequence[Span]) -> list[Scanned]:
    """Find the events of these packets; `layout.header` must be known."""
    return [scan_packet(layout, memory, span, span.begin) for span in spans]


def scan_packet(layout: StreamLayout, memory: Memory, span: Span, position: int) -> Scanned:
    """Find the events of a packet from this position on."""
    header = layout.header
    assert header is not None
    place = header.selector
    read = struct.Struct((">" if place.big_endian else "<") + _CODES[place.width]).unpack_from
    data = memory.data
    step_of = layout.steps.get
    residues, last_residue = layout.residues, layout.residues - 1
    offsets, shift, mask = place.offsets, place.shift, place.mask
    end = span.end
    positions: list[int] = []
    append = positions.append
    problem = None
    while position < end:
        residue = position & last_residue
        selector = read(data, position + offsets[residue])[0] >> shift & mask
        step = step_of(selector * residues + residue)
        if step is None:
            try:
                following = layout.next_event(data, position, span)
            except FieldError as error:
                problem = (position, str(error))
                break
            append(position)
            position = following
        else:
            append(position)
            position += step
    if position > end:
        problem = (positions.pop(), BEYOND_END)
    return whole(layout, memory, span, Scanned(np.array(positions, np.int64), problem))


def whole(layout: StreamLayout, memory: Memory, span: Span, found: Scanned) -> Scanned:
    """Return the events of a packet without a last one that reaches beyond its content.

    Sizes that are known beforehand go from header to header, with the padding in between: where
    padding is cut off, the end of the last event may be, too.
    """
    if span.limit == span.end or found.problem is not None or not found.positions.size:
        return found
    last = int(found.positions[-1])
    try:
        layout.next_event(memory.data, last, span)
    except FieldError as error:
        return Scanned(found.positions[:-1], (last, str(error)))
    return found
