"""The packets of a set of traces in the order in which they are read."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from msgflow.trace.ctf.losses import LossCounter, recording_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from msgflow.trace.ctf.packets import Packet
    from msgflow.trace.ctf.streams import Stream
    from msgflow.trace.model import TraceInfo


@dataclass(slots=True, eq=False)
class Entry:
    """A packet that is to be read.

    Attributes:
        stream: its stream.
        packet: where it lies.
        position: its place in the stream, copies left out.
        begin: value of the clock at its begin.
        order_ns: no event of it is earlier.
        discarded: events lost in it.
        lost: packets lost right before it.
        base: where it lies in memory, in bytes.
        events: begins of its events as found by the scan, relative to `base`; None before.
    """

    stream: Stream
    packet: Packet
    position: int
    begin: int
    order_ns: int
    discarded: int | None
    lost: int
    base: int = -1
    events: NDArray[np.int64] | None = field(default=None)

    @property
    def size(self) -> int:
        """Bytes of content."""
        return (self.packet.content_bits + 7) // 8

    @property
    def place(self) -> tuple[int, int]:
        """What orders events of the same time: rank of the stream, place in it."""
        return self.stream.rank, self.position


def entries_of(
    streams: Sequence[Stream],
    traces: Sequence[TraceInfo],
    begins: Mapping[Packet, tuple[int, int]],
) -> tuple[list[Entry], int]:
    """Return what to read in order of time, and how many packets are left out as copies.

    The same packet may be given twice (a copied directory, overlapping snapshots): same trace
    uuid, stream class, stream instance and begin. The one of the first trace is read.

    Args:
        streams: of all traces.
        traces: what they declare.
        begins: for packets that do not say when they begin, the clock's value and the time.
    """
    candidates = []
    for stream in streams:
        clock = stream.layout.stream.clock
        for packet in stream.packets:
            if packet in begins:
                begin, order_ns = begins[packet]
            else:
                begin = packet.header.begin or 0
                order_ns = clock.to_ns(begin) if clock is not None else begin
            candidates.append((order_ns, stream.rank, begin, stream, packet))
    candidates.sort(key=lambda candidate: candidate[:2])

    owners: dict[tuple[str, int, int, int], int] = {}
    for _, _, begin, stream, packet in candidates:
        uuid = traces[stream.trace_index].uuid
        if uuid is not None and packet.header.begin is not None:
            owners.setdefault((uuid, stream.class_id, stream.instance, begin), stream.trace_index)

    entries = []
    counter = LossCounter()
    copies = 0
    positions: dict[int, int] = {}
    for order_ns, rank, begin, stream, packet in candidates:
        info = traces[stream.trace_index]
        owner = owners.get((info.uuid or "", stream.class_id, stream.instance, begin))
        is_copy = owner is not None and owner != stream.trace_index
        recording = recording_of(stream, info.uuid, str(info.path))
        discarded, lost = counter.losses(recording, stream, packet, not is_copy)
        if is_copy:
            copies += 1
            continue
        position = positions.get(rank, 0)
        positions[rank] = position + 1
        entries.append(Entry(stream, packet, position, begin, order_ns, discarded, lost))
    return entries, copies
