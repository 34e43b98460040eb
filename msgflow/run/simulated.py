"""Time of a simulation: it runs evenly between two moments at which a run knows it.

Before the first and after the last moment it runs as fast as beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from msgflow.errors import UsageError

if TYPE_CHECKING:
    from msgflow.run.choice import Run


def known_moments(runs: Sequence[Run]) -> tuple[tuple[int, int], ...]:
    """Return the moments of the only run, (epoch ns, simulated ns); not all simulated are equal."""
    if len(runs) != 1:
        raise UsageError("simulated time is that of one run", "choose one with --run")
    if len({then for _, then in runs[0].simulated}) < 2:
        raise UsageError(
            f"nothing tells the simulated time — {runs[0].title}",
            "record CARET's clock recorder (ros2_caret:sim_time) while the simulation runs",
        )
    return runs[0].simulated


def recorded_ns(runs: Sequence[Run], simulated_ns: int) -> int:
    """Return when it was so late in the simulation for the first time, epoch ns."""
    moments = known_moments(runs)
    times = [then for _, then in moments]
    pieces = list(pairwise(moments))
    if min(times) <= simulated_ns <= max(times):
        around = [(a, b) for a, b in pieces if a[1] <= simulated_ns <= b[1]]
    else:
        around = [pieces[0 if simulated_ns < min(times) else -1]]
    # It may have stood still, or begun anew.
    running = [(a, b) for a, b in around if a[1] < b[1]]
    if not running:
        raise UsageError(
            f"the simulation never had this time — {simulated_ns / 1e9:g} s",
            f"its time is known from {min(times) / 1e9:g} s to {max(times) / 1e9:g} s",
        )
    ((begin, end), *_) = running
    return begin[0] + (simulated_ns - begin[1]) * (end[0] - begin[0]) // (end[1] - begin[1])
