"""What is carried from one part of a recording to the next where they are read one by one."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from msgflow.trace.ctf.losses import LossCounter

if TYPE_CHECKING:
    from msgflow.trace.time_base import ClockName


@dataclass
class Continuation:
    """What was read so far of recordings whose parts are opened one after the other, each once."""

    # How far the clocks are from the epoch, see `on_one_base`.
    clock_offsets: dict[ClockName, int] = field(default_factory=dict)
    losses: LossCounter = field(default_factory=LossCounter)  # the counters in their packets
