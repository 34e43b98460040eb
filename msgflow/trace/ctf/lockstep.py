"""Finds where events begin in many places side by side: best for much data."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msgflow.trace.ctf.lanes import split
from msgflow.trace.ctf.scan import Scanned, scan, scan_until, whole
from msgflow.trace.ctf.steps import Steps
from msgflow.trace.ctf.walk import FieldError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from msgflow.trace.ctf.lanes import Lanes
    from msgflow.trace.ctf.layout import Span, StreamLayout
    from msgflow.trace.ctf.memory import Memory

NARROWEST = 48
"""Fewer lanes than this are faster one by one."""

_NOWHERE = -1


def scan_lockstep(
    layout: StreamLayout, memory: Memory, spans: Sequence[Span], narrowest: int = NARROWEST
) -> list[Scanned]:
    """Find the events of these packets, which lie in memory one after the other.

    Packets, the large ones in several lanes, take one step at a time together. An event whose size
    is not in the table stops its lane; only those are looked at. Positions come out mixed, and
    sorting them brings each packet's together.
    """
    header = layout.header
    assert header is not None
    if layout.step_table is not None:
        steps = Steps(layout, memory)
        lanes = split(steps, spans, header.align)
        if lanes.begins.size >= narrowest:
            return _Lockstep(layout, memory, spans, steps, lanes, narrowest).run()
    return scan(layout, memory, spans)


class _Lockstep:
    def __init__(
        self,
        layout: StreamLayout,
        memory: Memory,
        spans: Sequence[Span],
        steps: Steps,
        lanes: Lanes,
        narrowest: int,
    ) -> None:
        self._layout = layout
        self._memory = memory
        self._spans = spans
        self._steps = steps
        self._lanes = lanes
        self._narrowest = narrowest
        # Where each lane came to, at or behind its end.
        self._reached = np.full(lanes.begins.size, _NOWHERE)
        self._problems: dict[int, tuple[int, str]] = {}
        self._found: list[NDArray[np.int64]] = []

    def run(self) -> list[Scanned]:
        lanes = self._lanes
        self._walk(np.arange(lanes.begins.size), lanes.begins, lanes.ends)
        positions = np.sort(np.concatenate([*self._found, np.empty(0, np.int64)]))
        bounds = np.searchsorted(positions, lanes.begins)
        bounds = np.append(bounds, positions.size)
        numbers = np.arange(len(self._spans))
        first = np.searchsorted(lanes.spans, numbers).tolist()
        last = np.searchsorted(lanes.spans, numbers, side="right").tolist()
        is_off = self._reached != lanes.ends
        off = set(lanes.spans[is_off].tolist())
        return [
            self._packet(number, positions, bounds, range(first[number], last[number]))
            if number in off
            else whole(
                self._layout,
                self._memory,
                span,
                Scanned(positions[bounds[first[number]] : bounds[last[number]]]),
                span.end,
            )
            for number, span in enumerate(self._spans)
        ]

    def _packet(
        self, number: int, positions: NDArray[np.int64], bounds: NDArray[np.int64], lanes: range
    ) -> Scanned:
        """Return the events of a packet that is damaged, or of which a guess was wrong."""
        span = self._spans[number]
        at = span.begin
        parts = []
        problem = None
        for lane in lanes:
            end = int(self._lanes.ends[lane])
            if at == self._lanes.begins[lane]:
                parts.append(positions[bounds[lane] : bounds[lane + 1]])
                problem, at = self._problems.get(lane), int(self._reached[lane])
            else:
                found, at = scan_until(self._layout, self._memory, span, at, end)
                parts.append(found.positions)
                problem = found.problem
            if problem is not None:
                break
        found = Scanned(np.concatenate(parts), problem)
        return whole(self._layout, self._memory, span, found, at)

    def _walk(
        self, lanes: NDArray[np.int64], position: NDArray[np.int64], end: NDArray[np.int64]
    ) -> None:
        """Let all lanes take steps until few are left, which go on one by one."""
        while lanes.size >= self._narrowest:
            step = self._steps.sizes(position)
            if np.count_nonzero(step) < step.size:
                going = self._look_at_stopped(lanes, position, step)
                lanes, position, end, step = lanes[going], position[going], end[going], step[going]
            self._found.append(position)
            position = position + step
            is_there = position >= end
            if np.count_nonzero(is_there):
                self._reached[lanes[is_there]] = position[is_there]
                going = ~is_there
                lanes, position, end = lanes[going], position[going], end[going]
        for lane, at, until in zip(lanes.tolist(), position.tolist(), end.tolist(), strict=True):
            span = self._spans[self._lanes.spans[lane]]
            rest, at = scan_until(self._layout, self._memory, span, at, until)
            self._found.append(rest.positions)
            if rest.problem is None:
                self._reached[lane] = at
            else:
                self._problems[lane] = rest.problem

    def _look_at_stopped(
        self, lanes: NDArray[np.int64], position: NDArray[np.int64], step: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """Fill in the steps that are not in the table; return which lanes go on."""
        going = np.ones(lanes.size, np.bool_)
        for index in np.flatnonzero(step == 0).tolist():
            at, lane = int(position[index]), int(lanes[index])
            span = self._spans[self._lanes.spans[lane]]
            try:
                step[index] = self._layout.next_event(self._memory.data, at, span) - at
            except FieldError as error:
                self._problems[lane] = (at, str(error))
                going[index] = False
        return going
