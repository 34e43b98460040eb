"""Interrupts that wake threads: how long the CPUs of a host handle them.

Threads that run there meanwhile have the CPU, but do not compute.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from operator import attrgetter
from typing import TYPE_CHECKING

from msgflow_sim.kernel import INTERRUPT, SOFTIRQ

if TYPE_CHECKING:
    from msgflow_sim.kernel import Run

# From the begin until a thread is woken, and from there until the end.
_UNTIL_WAKING_NS = {INTERRUPT: 3_000, SOFTIRQ: 5_000}
_SINCE_WAKING_NS = 1_500
# The network card's interrupt takes less time than passes until the softirq that it leaves behind.
_UNTIL_SOFTIRQ_NS, _NETWORK_CARD_NS = 2_200, 2_000
_NEVER = 1 << 62


@dataclass(slots=True)
class Interrupt:
    """A CPU handles an interrupt, or what one left for later."""

    kind: str
    cpu: int
    start: int
    end: int


def interrupts(runs: Sequence[Sequence[Run]]) -> Iterator[Interrupt]:
    """Yield what the CPUs handle, given what each of them runs.

    No interrupt lasts longer than the run in which it comes. What wakes several threads within a
    short time is one.
    """
    wakings = [run.waking for run in chain(*runs) if run.waking is not None]
    wakings = [each for each in wakings if each.kind in _UNTIL_WAKING_NS]
    wakings.sort(key=attrgetter("time"))
    for cpu, of_cpu in enumerate(runs):
        starts, ends = [run.start for run in of_cpu], [run.end for run in of_cpu]
        latest = Interrupt("", cpu, -1, -1)
        for waking in wakings:
            if waking.cpu != cpu:
                continue
            time = waking.time
            # Of switches at one time, those to the idle thread come first, and others last.
            before, after = bisect_right(ends, time), bisect_left(starts, time)
            since = max(ends[before - 1] if before else 0, starts[after - 1] + 1 if after else 0)
            until = min(
                ends[before] - 1 if before < len(ends) else _NEVER,
                starts[after] if after < len(starts) else _NEVER,
            )
            end = min(time + _SINCE_WAKING_NS, until)
            if latest.end >= time and latest.kind == waking.kind:
                latest.end = end
                continue
            latest.end = max(min(latest.end, time - 1), latest.start)
            start = max(time - _UNTIL_WAKING_NS[waking.kind], since, latest.end + 1)
            if latest.kind:
                yield latest
            if waking.kind == SOFTIRQ and time - start > _UNTIL_SOFTIRQ_NS:
                yield Interrupt(INTERRUPT, cpu, start, start + _NETWORK_CARD_NS)
                start += _UNTIL_SOFTIRQ_NS
            latest = Interrupt(waking.kind, cpu, start, end)
        if latest.kind:
            yield latest
