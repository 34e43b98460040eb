"""Corrections of a clock that its messages allow, computed by bisection.

A correction is a line with an offset and a drift. A message from the reference to the clock puts a
point below the line. A message back puts a point above it. Clocks drift apart by at most 200 ppm.
msgflow solves this linear programme in SQL with convex hulls. This module solves it again by other
means, so that neither can hide a mistake of the other: a drift is possible if the highest point
below does not exceed the lowest point above, and that room is a concave function of the drift.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

GREATEST_DRIFT = 200e-6
_STEPS = 80


class PossibleLines:
    """The lines above all points of one kind and below all of another.

    Args:
        below: points that the line is not below: time [ns], correction [ns].
        above: points that it is not above, likewise.

    Attributes:
        offset_ns: what the corrections below are counted from, so that they stay exact.
        is_possible: whether there is any.
        lowest_drift: of those that are possible; likewise highest_drift.
    """

    def __init__(self, below: Sequence[tuple[int, int]], above: Sequence[tuple[int, int]]) -> None:
        # Differences are small enough to be exact as floating point numbers.
        self._origin_ns, self.offset_ns = below[0]
        self._below = self._points(below)
        self._above = self._points(above)
        best = _argmax(self._room, -GREATEST_DRIFT, GREATEST_DRIFT)
        self.is_possible = self._room(best) >= 0
        self.lowest_drift = self._edge(best, -GREATEST_DRIFT)
        self.highest_drift = self._edge(best, GREATEST_DRIFT)

    def range_at(self, time_ns: int) -> tuple[float, float]:
        """Return the lowest and the highest possible correction at a time [ns from offset_ns]."""
        moment = float(time_ns - self._origin_ns)

        def highest(drift: float) -> float:
            times, values = self._above
            return float((values + drift * (moment - times)).min())

        def lowest(drift: float) -> float:
            times, values = self._below
            return float((values + drift * (moment - times)).max())

        span = (self.lowest_drift, self.highest_drift)
        return (
            lowest(_argmax(lambda drift: -lowest(drift), *span)),
            highest(_argmax(highest, *span)),
        )

    def _points(self, points: Sequence[tuple[int, int]]) -> tuple[np.ndarray, np.ndarray]:
        times = np.array([time - self._origin_ns for time, _ in points], np.float64)
        return times, np.array([value - self.offset_ns for _, value in points], np.float64)

    def _room(self, drift: float) -> float:
        """How far the two kinds of points are apart, seen along a drift [ns]."""
        (below_at, below), (above_at, above) = self._below, self._above
        return float((above - drift * above_at).min() - (below - drift * below_at).max())

    def _edge(self, inside: float, outside: float) -> float:
        """Bisect to the last possible drift from `inside` to `outside`."""
        if self._room(outside) >= 0:
            return outside
        for _ in range(_STEPS):
            middle = (inside + outside) / 2
            if self._room(middle) >= 0:
                inside = middle
            else:
                outside = middle
        return inside


class Bound:
    """What msgflow states: the bound of the error at some moments, lines in between.

    Args:
        knots: time [ns] and bound [ns], in any order.
    """

    def __init__(self, knots: Sequence[tuple[int, int]]) -> None:
        ordered = sorted(knots)
        self.begin_ns, self.end_ns = ordered[0][0], ordered[-1][0]
        self._times = np.array([time - self.begin_ns for time, _ in ordered], np.float64)
        self._bounds = np.array([bound for _, bound in ordered], np.float64)

    def at(self, time_ns: int) -> float:
        """Return the bound at a time between the first and the last moment [ns]."""
        return float(np.interp(float(time_ns - self.begin_ns), self._times, self._bounds))


def _argmax(concave: Callable[[float], float], low: float, high: float) -> float:
    """Where a concave function is greatest, by dividing into three."""
    for _ in range(2 * _STEPS):
        third = (high - low) / 3
        if concave(low + third) < concave(high - third):
            low += third
        else:
            high -= third
    return (low + high) / 2
