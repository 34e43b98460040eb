"""Losses of events and packets, from the counters in the packets."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

if TYPE_CHECKING:
    from msgflow.trace.ctf.packets import Packet, Stream
    from msgflow.trace.time_base import ClockName

Recording = tuple[str, int, int]
"""Trace uuid (or path), stream class and stream instance: one counter, through all chunks."""

# More than any tracer can lose from one packet to the next: the counter itself is damaged.
_MOST_LOST = 1 << 48


@dataclass(frozen=True)
class Losses:
    """What was lost."""

    events: int | None  # in the packet; None: unknown
    packets: int  # right before it
    problem: str | None  # message about a counter that makes no sense, None if all is well


class LossCounter:
    """Losses of one packet after the other, as differences of its counters.

    A recording may be rotated into several directories, or be given as several snapshots: the
    counter of lost events and the numbers of the packets go on in the next one.
    """

    def __init__(self) -> None:
        self._counters: dict[Recording, int] = {}
        self._of_stream: WeakKeyDictionary[Stream, int] = WeakKeyDictionary()
        self._sequences: dict[Recording, int] = {}

    def losses(self, recording: Recording, stream: Stream, packet: Packet, counts: bool) -> Losses:
        """Return what was lost in a packet and before it.

        Packets must come in order of time. `counts` is false for a copy of a packet: its counter of
        lost events then only counts for the next packets of the same stream.
        """
        header = packet.header
        lost, problem = 0, None
        if header.sequence is not None:
            expected = self._sequences.get(recording, -1) + 1
            lost = max(header.sequence - expected, 0)
            self._sequences[recording] = header.sequence
            if lost > _MOST_LOST:
                lost, problem = 0, f"the number {header.sequence} of the packet makes no sense"
                self._sequences[recording] = expected
        if header.discarded is None:
            return Losses(None if packet.is_cut else 0, lost, problem)
        before = self._of_stream.get(stream, self._counters.get(recording, 0))
        discarded: int | None = _rise(before, header.discarded, header.discarded_bits)
        if discarded is not None and discarded > _MOST_LOST:
            problem = f"the counter of lost events makes no sense: {header.discarded}"
            return Losses(None, lost, problem)
        self._of_stream[stream] = header.discarded
        if counts:
            self._counters[recording] = header.discarded
        if packet.is_cut or (lost and discarded):
            # The events may have been lost in the missing packets or in this one.
            return Losses(None, lost, problem)
        return Losses(discarded, lost, problem)


@dataclass
class Continuation:
    """What was read so far of recordings whose parts are opened one after the other, each once."""

    # How far the clocks are from the epoch, see `on_one_base`.
    clock_offsets: dict[ClockName, int] = field(default_factory=dict)
    losses: LossCounter = field(default_factory=LossCounter)  # the counters in their packets


def _rise(before: int, counter: int, bits: int) -> int:
    if counter >= before:
        return counter - before
    # A narrow counter has wrapped round. A wide one cannot: it has started again.
    return counter if bits == 64 else counter - before + (1 << bits)
