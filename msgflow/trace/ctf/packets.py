"""Packets of streams, found by hopping from one to the next; damaged ones are reported."""

from __future__ import annotations

import os
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from msgflow.trace.ctf import packet_index
from msgflow.trace.ctf.field_types import BYTE, FieldError
from msgflow.trace.ctf.packet_header import HeaderReader, PacketHeader
from msgflow.trace.ctf.stream_layout import StreamLayout
from msgflow.trace.regular_file import UnsuitableFileError

_CHUNK = 1 << 20
# Buffers of tracers are far smaller; a packet is loaded as a whole.
_LARGEST_CONTENT = 1 << 30
# Smaller holes may be zeros that a copying program left out.
_SMALLEST_HOLE = 1 << 16
_LARGEST_CPU = (1 << 31) - 1
_HOLE = "the file has a hole within this packet, it was not copied whole"
_BLOCK = 512
_CUT = "the file ends within this packet, it was cut off or is still being written"


@dataclass(frozen=True, slots=True, eq=False)
class Packet:
    """A packet whose header makes sense."""

    path: Path
    number: int  # its place in the file
    offset: int  # its place in the file, in bytes
    size: int  # in bytes, from `offset`
    content_bits: int  # how much of that is used
    header: PacketHeader  # what it says of itself
    is_cut: bool = False  # the file ends before the packet does


OnFileDamage = Callable[[Path, int, int, str], None]
"""What hears of damage: the file, the number of the packet, where in the file, and a message."""


def packets_of(path: Path, reader: HeaderReader, report: OnFileDamage) -> list[Packet]:
    """Return the packets of a file in its order; `report` gets all that is wrong."""
    with path.open("rb", buffering=0) as file:
        packets = list(_PacketFinder(path, file.fileno(), reader, report).run())
    early = misplaced([packet.header.begin or 0 for packet in packets])
    for place in sorted(early):
        packet = packets[place]
        message = "the packet begins earlier or later than its neighbours"
        report(path, packet.number, packet.offset, message)
    return [packet for place, packet in enumerate(packets) if place not in early]


class _PacketFinder:
    def __init__(
        self, path: Path, descriptor: int, reader: HeaderReader, report: OnFileDamage
    ) -> None:
        self._path = path
        self._descriptor = descriptor
        self._reader = reader
        self._report = report
        status = os.fstat(descriptor)
        self._file_size = status.st_size
        self._is_sparse = status.st_blocks * _BLOCK < status.st_size
        self._number = self._offset = 0  # of the packet that is looked at
        self._foreign: set[str] = set()
        self._patterns = [pattern for pattern in [reader.pattern()] if pattern is not None]
        try:
            self._index = packet_index.entries(path)
        except UnsuitableFileError as error:
            self._index = {}
            report(packet_index.path_of(path), 0, 0, f"the index is not used: {error.strerror}")

    def run(self) -> Iterator[Packet]:
        while self._offset < self._file_size:
            try:
                packet = self._packet()
            except FieldError as error:
                self._say(str(error))
                self._offset = self._next_begin()
            else:
                if not packet.is_cut:
                    self._compare_with_index(packet)
                yield packet
                self._offset += packet.size
            self._number += 1
        if max(self._index, default=-1) >= self._file_size:
            self._offset = self._file_size
            self._say("the file ends before packets of its index")

    def _say(self, message: str) -> None:
        self._report(self._path, self._number, self._offset, message)

    def _packet(self) -> Packet:
        number, offset = self._number, self._offset
        header = self._reader.read(os.pread(self._descriptor, self._reader.size, offset))
        rest = self._file_size - offset
        size_bits = rest * BYTE if header.size_bits is None else header.size_bits
        content_bits = size_bits if header.content_bits is None else header.content_bits
        size = size_bits // BYTE
        if size_bits % BYTE or not header.events_at <= content_bits <= size_bits:
            raise FieldError(
                f"a packet of {size_bits} bits with {content_bits} used bits makes no sense"
            )
        if content_bits > _LARGEST_CONTENT * BYTE:
            raise FieldError(f"a packet of {content_bits // BYTE:,} bytes is too large to be read")
        self._check_times(header)
        self._check_uuid(header)
        if header.cpu is not None and not 0 <= header.cpu <= _LARGEST_CPU:
            self._say(f"there is no CPU {header.cpu}: left out")
            header = replace(header, cpu=None)
        if size > rest:
            is_last = self._next_begin() == self._file_size
            if not is_last or header.events_at > rest * BYTE:
                raise FieldError(_CUT)
            self._say(f"{_CUT}; what is there of it is read")
            there = min(content_bits, rest * BYTE)
            return Packet(self._path, number, offset, rest, there, header, is_cut=True)
        size = self._without_swallowed(size, content_bits)
        there = self._bits_before_hole(content_bits)
        if there < content_bits:
            if there < header.events_at:
                raise FieldError(_HOLE)
            self._say(f"{_HOLE}; what is in front of it is read")
            return Packet(self._path, number, offset, size, there, header, is_cut=True)
        return Packet(self._path, number, offset, size, content_bits, header)

    def _check_times(self, header: PacketHeader) -> None:
        clock = header.stream.clock
        if clock is None:
            return
        first, last = clock.limits
        for value in (header.begin, header.end or None):
            if value is not None and not first <= value <= last:
                raise FieldError("the time of the packet makes no sense")
        if header.begin is not None and header.end and header.end < header.begin:
            raise FieldError("the packet ends before it begins")

    def _check_uuid(self, header: PacketHeader) -> None:
        """Report once a uuid that is not that of the metadata; read on, as Babeltrace does."""
        if header.foreign is None or header.foreign in self._foreign:
            return
        pattern = self._reader.pattern(header.foreign)
        if pattern is not None and not self._foreign:
            self._patterns.append(pattern)
        self._foreign.add(header.foreign)
        self._say(
            f"the packet belongs to another trace, {header.foreign}: read nevertheless, as this "
            "metadata says",
        )

    def _bits_before_hole(self, content_bits: int) -> int:
        """Return how many bits of a packet lie in front of the first large hole of the file."""
        if not self._is_sparse:
            return content_bits
        at = offset = self._offset
        end = offset + (content_bits + BYTE - 1) // BYTE
        while at < end:
            hole = os.lseek(self._descriptor, at, os.SEEK_HOLE)
            at = self._next_data(hole)
            if min(at, end) - hole >= _SMALLEST_HOLE:
                return min((hole - offset) * BYTE, content_bits)
        return content_bits

    def _next_data(self, offset: int) -> int:
        """Return the first offset outside of holes from this one on, or the file's end."""
        try:
            return os.lseek(self._descriptor, offset, os.SEEK_DATA)
        except OSError:
            return self._file_size

    def _without_swallowed(self, size: int, content_bits: int) -> int:
        """Return the size of a packet, cut where another packet lies in its unused end."""
        used = (content_bits + BYTE - 1) // BYTE
        if not self._patterns or size - used < len(self._patterns[0]):
            return size
        found = self._find(self._offset + used, self._offset + size)
        if found is None:
            return size
        self._say("another packet lies where this one says to be unused")
        return found - self._offset

    def _next_begin(self) -> int:
        """Return where the next packet begins after an unreadable one."""
        known = [begin for begin in self._index if self._offset < begin < self._file_size]
        if known:
            return min(known)
        found = self._find(self._offset + 1, self._file_size) if self._patterns else None
        return self._file_size if found is None else found

    def _find(self, begin: int, end: int) -> int | None:
        """Return the first offset in a part of the file at which a packet seems to begin."""
        overlap = len(self._patterns[0]) - 1
        while begin + overlap < end:
            if self._is_sparse:
                # No packet begins with zeros.
                begin = self._next_data(begin)
            content = os.pread(self._descriptor, max(min(_CHUNK, end - begin), 0), begin)
            found = [at for pattern in self._patterns if (at := content.find(pattern)) >= 0]
            if found:
                return begin + min(found)
            if len(content) <= overlap:
                break
            begin += len(content) - overlap
        return None

    def _compare_with_index(self, packet: Packet) -> None:
        entry = self._index.get(packet.offset)
        header = packet.header
        if self._index and entry is None and packet.offset < max(self._index):
            self._say("the packet is not in the index")
        if entry is None:
            return
        for found, expected, what in (
            (packet.size * BYTE, entry.size_bits, "size"),
            (packet.content_bits, entry.content_bits, "used size"),
            (header.begin, entry.begin, "begin"),
            (header.end, entry.end, "end"),
        ):
            if found is not None and found != expected:
                self._say(
                    f"the index says that the packet's {what} is {expected}, the packet {found}"
                )


def misplaced(values: Sequence[int]) -> set[int]:
    """Return the places of the fewest values without which the rest never falls."""
    ends: list[int] = []
    places_of_ends: list[int] = []
    previous: list[int] = []
    for place, value in enumerate(values):
        # The longest series that this value can end.
        length = bisect_right(ends, value)
        previous.append(places_of_ends[length - 1] if length else -1)
        if length == len(ends):
            ends.append(value)
            places_of_ends.append(place)
        else:
            ends[length] = value
            places_of_ends[length] = place
    kept = set()
    place = places_of_ends[-1] if places_of_ends else -1
    while place >= 0:
        kept.add(place)
        place = previous[place]
    return set(range(len(values))) - kept


@dataclass(eq=False)
class Stream:
    """One data stream: the packets of one buffer, from all its files."""

    layout: StreamLayout
    instance: int  # its number in its class
    packets: list[Packet] = field(default_factory=list)  # in order of time
    index: int = -1  # its place among the streams of the trace, by class and instance
    rank: int = -1  # its place among the streams of all traces

    @property
    def class_id(self) -> int:
        """Id of its stream class."""
        return self.layout.stream.id

    @property
    def has_time(self) -> bool:
        """Its events have times."""
        return self.layout.stream.has_time

    @property
    def trace_index(self) -> int:
        """Place of its trace in the set."""
        return self.layout.trace_index


def streams_of(
    files: Sequence[Path],
    reader: HeaderReader,
    layouts: dict[int, StreamLayout],
    report: OnFileDamage,
) -> list[Stream]:
    """Return the streams of a trace, in order of class and instance.

    A stream may have several files (rotated or limited in size). Packets that do not name their
    stream belong to a stream of their file alone, numbered in order of the file names.
    """
    streams: dict[tuple[int, int | None, Path | None], Stream] = {}
    for path in files:
        for packet in packets_of(path, reader, report):
            header = packet.header
            own_file = path if header.instance is None else None
            key = (header.stream.id, header.instance, own_file)
            if key not in streams:
                unnamed = sum(known[2] is not None for known in streams)
                instance = unnamed if header.instance is None else header.instance
                streams[key] = Stream(layouts[header.stream.id], instance)
            streams[key].packets.append(packet)
    for stream in streams.values():
        if all(packet.header.begin is not None for packet in stream.packets):
            stream.packets.sort(
                key=lambda packet: (packet.header.begin, packet.header.sequence or 0)
            )
    ordered = sorted(streams.values(), key=lambda stream: (stream.class_id, stream.instance))
    for index, stream in enumerate(ordered):
        stream.index = index
    return ordered
