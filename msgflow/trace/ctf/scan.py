"""Finds where events begin, packet after packet: best for little data."""

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
    scanned = []
    for span in spans:
        found, position = scan_until(layout, memory, span, span.begin, span.end)
        scanned.append(whole(layout, memory, span, found, position))
    return scanned


def scan_until(
    layout: StreamLayout, memory: Memory, span: Span, position: int, until: int
) -> tuple[Scanned, int]:
    """Find the events of a packet that begin in front of the byte `until`, from this one on.

    Returns:
        the events, and where the one after them begins: not before `until`, unless there is a
        problem.
    """
    header = layout.header
    assert header is not None
    place = header.selector
    read = struct.Struct((">" if place.big_endian else "<") + _CODES[place.width]).unpack_from
    data = memory.data
    step_of = layout.steps.get
    residues, last_residue = layout.residues, layout.residues - 1
    offsets, shift, mask = place.offsets, place.shift, place.mask
    positions: list[int] = []
    append = positions.append
    problem = None
    while position < until:
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
    return Scanned(np.array(positions, np.int64), problem), position


def whole(
    layout: StreamLayout, memory: Memory, span: Span, found: Scanned, following: int
) -> Scanned:
    """Return the events of a packet without a last one that reaches beyond its content.

    `following` is where the event after the last one begins. Sizes that are known beforehand go
    from header to header, with the padding in between: where padding is cut off, the end of the
    last event may be, too.
    """
    if found.problem is not None or not found.positions.size:
        return found
    last = int(found.positions[-1])
    if following > span.end:
        return Scanned(found.positions[:-1], (last, BEYOND_END))
    if span.limit == span.end:
        return found
    try:
        layout.next_event(memory.data, last, span)
    except FieldError as error:
        return Scanned(found.positions[:-1], (last, str(error)))
    return found
