"""Events and packets that were lost, from the counters in the packets."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from msgflow.trace.ctf.packets import Packet
    from msgflow.trace.ctf.streams import Stream

Recording = tuple[str, int, int]
"""Trace uuid (or path), stream class and stream instance: one counter, through all chunks."""

_LARGEST = (1 << 63) - 1


class LossCounter:
    """Turns the counters of one packet after the other into what each lost.

    A recording may be rotated into several directories, or be given as several snapshots: the
    counter of lost events and the numbers of the packets go on in the next one.
    """

    def __init__(self) -> None:
        self._counters: dict[Recording, int] = {}
        self._previous: dict[int, Packet] = {}
        self._sequences: dict[Recording, int] = {}

    def losses(
        self, recording: Recording, stream: Stream, packet: Packet, counts: bool
    ) -> tuple[int | None, int]:
        """Return the events lost in a packet (None: unknown), and the packets lost before it.

        Args:
            recording: what the counters count for.
            stream: the packet's stream.
            packet: must come in order of time.
            counts: False for a copy of a packet, which only serves to be compared with.
        """
        previous = self._previous.get(id(stream))
        self._previous[id(stream)] = packet
        lost = 0
        header = packet.header
        if header.sequence is not None:
            expected = self._sequences.get(recording, -1) + 1
            lost = min(max(header.sequence - expected, 0), _LARGEST)
            self._sequences[recording] = header.sequence
        if header.discarded is None:
            return None if packet.is_cut else 0, lost
        before = self._counters.get(recording, 0)
        if previous is not None and previous.header.discarded is not None:
            before = previous.header.discarded
        if counts:
            self._counters[recording] = header.discarded
        if packet.is_cut:
            return None, lost
        return min(_rise(before, header.discarded, header.discarded_bits), _LARGEST), lost


def recording_of(stream: Stream, uuid: str | None, path: str) -> Recording:
    """Return what a stream's counter of lost events counts for."""
    return uuid or path, stream.class_id, stream.instance


def _rise(before: int, counter: int, bits: int) -> int:
    if counter >= before:
        return counter - before
    # A narrow counter has wrapped round; a wide one cannot, it has started again.
    return counter if bits == 64 else counter - before + (1 << bits)
