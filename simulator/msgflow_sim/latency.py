"""Latency between two processes: of messages, and of discovery."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow_sim.entity import MICROSECOND, MILLISECOND

if TYPE_CHECKING:
    from msgflow_sim.machine import RunningProcess


@dataclass(frozen=True, slots=True)
class Latency:
    """How long messages travel and how long discovery takes between two processes."""

    base: int
    tail: int
    discovery: int
    discovery_spread: int


_SAME_PROCESS = Latency(12 * MICROSECOND, 3 * MICROSECOND, 0, 0)
# The publishing thread itself puts the message into the queue.
AT_ONCE = Latency(0, 0, 0, 0)
_SAME_HOST = Latency(35 * MICROSECOND, 15 * MICROSECOND, 4 * MILLISECOND, 12 * MILLISECOND)
AGNOCAST = Latency(4 * MICROSECOND, 3 * MICROSECOND, 0, 0)
_OTHER_HOST = Latency(220 * MICROSECOND, 90 * MICROSECOND, 12 * MILLISECOND, 25 * MILLISECOND)


def latency_between(one: RunningProcess, other: RunningProcess) -> Latency:
    """The latency that applies between two processes."""
    if one is other:
        return _SAME_PROCESS
    return _SAME_HOST if one.machine is other.machine else _OTHER_HOST
