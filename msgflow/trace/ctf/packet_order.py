"""Order of the packets of all traces: in time, without copies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from msgflow.trace.ctf.losses import LossCounter
from msgflow.trace.ctf.packets import Packet, Stream
from msgflow.trace.model import TraceInfo
from msgflow.trace.numpy_arrow import Integers

_CHUNK = 1 << 20


@dataclass(slots=True, eq=False)
class Entry:
    """A packet that is to be read."""

    stream: Stream
    packet: Packet  # where it lies in its file
    position: int  # its place in the stream, copies not counted
    begin: int  # value of the clock at its begin
    # Time of the first event at the earliest. Events that are earlier, in a damaged packet, are put
    # there.
    order_ns: int
    discarded: int | None  # events lost in it
    lost: int  # packets lost right before it
    base: int = -1  # where it lies in memory, in bytes
    # Begins of its events relative to `base`, without those that are done; None until they are
    # found.
    events: Integers | None = field(default=None)
    # Value of the clock at the event before these, or at the begin.
    clock_before: int = field(init=False)
    skipped: int = 0  # of a piece of a packet, bytes in front of it, which are read before
    until: int | None = None  # where the piece ends; None: what is read is the whole packet

    def __post_init__(self) -> None:
        self.clock_before = self.begin

    @property
    def size(self) -> int:
        """Bytes of content to read."""
        content = (self.packet.content_bits + 7) // 8
        return (content if self.until is None else self.until) - self.skipped

    @property
    def place(self) -> tuple[int, int, int]:
        """Order of events of the same time: rank of the stream, places in stream and packet."""
        return self.stream.rank, self.position, self.skipped


OnDamage = Callable[[Entry, int, str], None]
"""What hears of damage: the packet, where in it (in bytes), and a message."""


@dataclass(frozen=True)
class PacketEvents:
    """Summary of the events of a packet."""

    entry: Entry
    count: int  # of its events
    first: int | None  # value of the clock at the first event; None without events
    last: int | None  # value at the last event
    last_ns: int | None  # time of the last
    falls_back: bool  # time runs backward in it


def entries_of(
    streams: Sequence[Stream],
    traces: Sequence[TraceInfo],
    begins: Mapping[Packet, tuple[int, int]],
    counter: LossCounter,
    report: OnDamage,
) -> tuple[list[Entry], int, Mapping[int, int]]:
    """Return the packets to read, in order of time and without copies.

    Also return how many packets were left out because another trace holds them, too, and of each
    trace, by its index, how many because it holds them twice.

    The same packet may be given twice (a copied directory, overlapping snapshots): same trace
    uuid, stream class, stream instance and begin. The one of the first trace is read. In one
    trace, where packets may well begin at the same time, it has to be the same byte for byte.

    `begins` has packets that do not say when they begin: the clock's value and the time. `counter`
    has counted up to the first of these packets. `report` gets packet, byte and message for
    counters that make no sense.
    """
    candidates = []
    for stream in streams:
        for packet in stream.packets:
            if packet in begins:
                begin, order_ns = begins[packet]
            else:
                begin = packet.header.begin or 0
                order_ns = stream.layout.clock.to_ns(begin)
            candidates.append((order_ns, stream.rank, begin, stream, packet))
    candidates.sort(key=lambda candidate: candidate[:2])

    owners: dict[tuple[str, int, int, int], int] = {}
    for _, _, begin, stream, packet in candidates:
        uuid = traces[stream.trace_index].uuid
        if uuid is not None and packet.header.begin is not None:
            owners.setdefault((uuid, stream.class_id, stream.instance, begin), stream.trace_index)

    entries = []
    copies = 0
    seen: dict[tuple[object, ...], Packet] = {}
    repeated: dict[int, int] = {}
    positions: dict[int, int] = {}
    for order_ns, rank, begin, stream, packet in candidates:
        info = traces[stream.trace_index]
        owner = owners.get((info.uuid or "", stream.class_id, stream.instance, begin))
        is_copy = owner is not None and owner != stream.trace_index
        recording = info.identity, stream.class_id, stream.instance
        losses = counter.losses(recording, stream, packet, not is_copy)
        if is_copy:
            copies += 1
            continue
        first = seen.setdefault(_identity(stream, packet), packet)
        if first is not packet and _are_equal(first, packet):
            repeated[stream.trace_index] = repeated.get(stream.trace_index, 0) + 1
            continue
        position = positions.get(rank, 0)
        positions[rank] = position + 1
        entry = Entry(stream, packet, position, begin, order_ns, losses.events, losses.packets)
        entries.append(entry)
        if losses.problem is not None:
            report(entry, 0, losses.problem)
        if first is not packet and _is_numbered(packet):
            report(entry, 0, "another packet has its stream, number and begin: both were read")
    return entries, copies, repeated


def _is_numbered(packet: Packet) -> bool:
    return packet.header.instance is not None and packet.header.sequence is not None


def _identity(stream: Stream, packet: Packet) -> tuple[object, ...]:
    """Return what no two sound packets of a trace share, if they have numbers.

    Those without numbers, or without the names of their streams, may well share it.
    """
    header = packet.header
    key = (stream.trace_index, stream.class_id, header.begin)
    if _is_numbered(packet):
        # Rotation leaves an empty packet in front of the first one with events.
        is_empty = packet.content_bits <= header.events_at
        return (*key, header.instance, header.sequence, is_empty)
    return (*key, header.end, header.cpu, header.events_at, packet.content_bits)


def _are_equal(one: Packet, other: Packet) -> bool:
    if one.content_bits != other.content_bits:
        return False
    left = (one.content_bits + 7) // 8
    try:
        with one.path.open("rb") as first, other.path.open("rb") as second:
            first.seek(one.offset)
            second.seek(other.offset)
            while left > 0:
                size = min(left, _CHUNK)
                if first.read(size) != second.read(size):
                    return False
                left -= size
    except OSError:  # reading the packet will report it
        return False
    return True
