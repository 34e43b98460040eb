"""What is carried from one part of a recording to the next where they are read one by one."""

from __future__ import annotations

from dataclasses import dataclass, field

from msgflow.trace.ctf.losses import LossCounter
from msgflow.trace.time_base import TimeBase


@dataclass
class Continuation:
    """What was read so far of recordings whose parts are opened one after the other, each once.

    Attributes:
        time_base: the clocks of the traces.
        losses: the counters in their packets.
    """

    time_base: TimeBase = field(default_factory=TimeBase)
    losses: LossCounter = field(default_factory=LossCounter)
