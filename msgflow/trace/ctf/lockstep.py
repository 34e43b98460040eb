"""Finds where events begin in many packets side by side: best for many packets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msgflow.trace.ctf.scan import Scanned, scan, scan_packet, whole
from msgflow.trace.ctf.walk import FieldError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from msgflow.trace.ctf.layout import Span, StreamLayout
    from msgflow.trace.ctf.memory import Memory

NARROWEST = 48
"""Fewer packets than this are faster one by one."""

_STEPS_BETWEEN_CHECKS = 64


class _OverrunError(Exception):
    """A step led out of its packet, so that steps into others may have been taken."""


def scan_lockstep(
    layout: StreamLayout, memory: Memory, spans: Sequence[Span], narrowest: int = NARROWEST
) -> list[Scanned]:
    """Find the events of these packets, which lie in memory one after the other.

    The packets take one step at a time together. An event whose size is not in the table stops
    its packet, and so do the ones that follow a packet's content; only those are looked at.
    Positions come out mixed, and sorting them brings each packet's together.
    """
    if layout.step_table is None or len(spans) < narrowest:
        return scan(layout, memory, spans)
    try:
        return _Lockstep(layout, memory, spans, narrowest).run()
    except (_OverrunError, IndexError):
        # Damage: found again, and its packet with it, when they are read one by one.
        return scan(layout, memory, spans)


class _Lockstep:
    def __init__(
        self, layout: StreamLayout, memory: Memory, spans: Sequence[Span], narrowest: int
    ) -> None:
        self._layout = layout
        self._memory = memory
        self._spans = spans
        self._narrowest = narrowest
        assert layout.header is not None
        assert layout.step_table is not None
        assert layout.selector_limit is not None
        self._place = layout.header.selector
        self._offsets = np.array(self._place.offsets, np.int64)
        self._selectors = memory.view(self._place.dtype)
        self._residues = layout.residues
        self._limit = layout.selector_limit
        self._table = layout.step_table
        self._problems: dict[int, tuple[int, str]] = {}
        self._steps: list[NDArray[np.int64]] = []

    def run(self) -> list[Scanned]:
        begins = np.array([span.begin for span in self._spans], np.int64)
        ends = np.array([span.end for span in self._spans], np.int64)
        lanes = np.flatnonzero(begins < ends)
        self._walk(lanes, begins[lanes], ends[lanes])
        positions = np.sort(np.concatenate([*self._steps, np.empty(0, np.int64)]))
        first = np.searchsorted(positions, begins).tolist()
        last = np.searchsorted(positions, ends).tolist()
        return [
            whole(
                self._layout,
                self._memory,
                span,
                Scanned(positions[first[lane] : last[lane]], self._problems.get(lane)),
            )
            for lane, span in enumerate(self._spans)
        ]

    def _walk(
        self, lanes: NDArray[np.int64], position: NDArray[np.int64], end: NDArray[np.int64]
    ) -> None:
        """Let all lanes take steps until few are left, which go on one by one."""
        count = 0
        while lanes.size >= self._narrowest:
            step = self._step_sizes(position)
            if np.count_nonzero(step) == step.size:
                self._steps.append(position)
                position = position + step
            else:
                going = self._look_at_stopped(lanes, position, end, step)
                lanes, position, end, step = lanes[going], position[going], end[going], step[going]
                self._steps.append(position)
                position = position + step
            count += 1
            if count % _STEPS_BETWEEN_CHECKS == 0 and (position > end).any():
                raise _OverrunError
        for lane, at in zip(lanes.tolist(), position.tolist(), strict=True):
            if at > self._spans[lane].end:
                raise _OverrunError
            rest = scan_packet(self._layout, self._memory, self._spans[lane], at)
            self._steps.append(rest.positions)
            if rest.problem is not None:
                self._problems[lane] = rest.problem

    def _step_sizes(self, position: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the sizes of the events at these positions, 0 where they are not always equal."""
        place = self._place
        residue = position & (self._residues - 1) if self._residues > 1 else None
        at = position
        if residue is not None:
            at = position + self._offsets[residue]
        elif place.offsets[0]:
            at = position + place.offsets[0]
        selector = self._selectors[at]
        if place.shift:
            selector = selector >> place.shift
        if place.bits < place.width * 8:
            selector = selector & place.mask
        if self._limit < place.mask:
            selector = np.minimum(selector, self._limit).astype(np.int64)
        if residue is not None:
            selector = selector.astype(np.int64) * self._residues + residue
        sizes: NDArray[np.int64] = self._table[selector]
        return sizes

    def _look_at_stopped(
        self,
        lanes: NDArray[np.int64],
        position: NDArray[np.int64],
        end: NDArray[np.int64],
        step: NDArray[np.int64],
    ) -> NDArray[np.bool_]:
        """Fill in the steps that are not in the table; return which packets go on."""
        going = np.ones(lanes.size, np.bool_)
        for index in np.flatnonzero(step == 0).tolist():
            at, lane = int(position[index]), int(lanes[index])
            if at > end[index]:
                raise _OverrunError
            going[index] = False
            if at < end[index]:
                try:
                    following = self._layout.next_event(self._memory.data, at, self._spans[lane])
                except FieldError as error:
                    self._problems[lane] = (at, str(error))
                else:
                    going[index] = True
                    step[index] = following - at
        return going
