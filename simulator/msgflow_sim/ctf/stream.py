"""Streams: the events of one CPU in packets, with their index files."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from struct import Struct
from typing import Protocol
from uuid import UUID

from msgflow_sim.ctf.tracepoint import Tracepoint, extended

PAGE_BYTES = 4096

_LOW = 0xFFFF_FFFF
_MAGIC = 0xC1FC_1FC1
_STREAM_ID = 0
_HEADER = Struct("<I16sIQ" + "QQQQQQI")
_INDEX_HEADER = Struct(">IIII")
_INDEX_MAGIC = 0xC1F1_DCC1
_INDEX_ENTRY = Struct(">QQQQQQQQQ")
_FOR_EVER = 1 << 62
# How long before the first packet of the next chunk the last ones of a chunk end.
_ROTATION_NS = 10_000

Entry = tuple[Tracepoint, int, bytes]
"""Tracepoint, time and context of an event."""

PacketNumbers = tuple[int, int, int, int, int, int]
"""Begin, end, bits of content, bits in all, sequence number, discarded events."""


@dataclass(frozen=True, slots=True)
class Break:
    """Packets end at `begin`, the next ones begin at `end`; what happens between is not recorded.

    One that takes no time ends only packets with events. With a `directory`, files are continued
    there; if that `is_missing`, to be deleted. Where packets are only kept in memory, those that
    are there are written to the directory instead.
    """

    begin: int
    end: int
    directory: Path | None = None
    is_missing: bool = False
    is_rotation: bool = False


class Faults(Protocol):
    """What goes wrong while a stream is recorded."""

    def lost_events(self, cpu: int) -> int:
        """How many events are lost behind the packet of a CPU that is now full."""

    def is_filled(self) -> bool:
        """Whether no byte of that packet is left over, so that it ends with its last event."""

    def is_packet_lost(self) -> bool:
        """Whether the packet that is now full is lost."""

    def is_losing(self, time: int) -> bool:
        """Whether what happens at `time` is lost."""

    def emitted(self, cpu: int, time: int, context: bytes) -> None:
        """An event is in the buffers of the trace."""

    def unrecorded(
        self, cpu: int, tracepoint: Tracepoint, time: int, context: bytes, cause: str
    ) -> None:
        """An event is not in the trace."""

    def missing_packet(self, trace: bytes, cpu: int, since: int, end: int, cause: str) -> None:
        """A packet without events is missing from the trace of this uuid.

        The one before it, which ends at `since`, and the end of the others show it.
        """


@dataclass(frozen=True, slots=True)
class Ending:
    """How a stream ends: complete, without its last packet, or in the middle of it."""

    is_last_packet_missing: bool = False
    is_last_packet_cut: bool = False


@dataclass(slots=True)
class _Kept:
    """A packet in memory."""

    content: bytes
    numbers: PacketNumbers
    events: list[Entry]
    is_written: bool = False


class PacketMemory:
    """The newest packets of one stream."""

    def __init__(self, capacity: int, overwritten: Callable[[list[Entry]], None]) -> None:
        """Keep `capacity` packets; `overwritten` gets the events of those that no file has."""
        self._capacity = capacity
        self._overwritten = overwritten
        self._packets: deque[_Kept] = deque()

    def keep(self, content: bytes, numbers: PacketNumbers, events: list[Entry]) -> None:
        """Add a packet, in the place of the oldest one if there is no room."""
        if len(self._packets) == self._capacity:
            self._forget()
        self._packets.append(_Kept(content, numbers, events))

    def write(self, write: Callable[[bytes, PacketNumbers], None]) -> None:
        """Write all packets that are there, which stay there: they may be in several snapshots."""
        for packet in self._packets:
            write(packet.content, packet.numbers)
            packet.is_written = True

    def close(self) -> None:
        """Give up what no snapshot has."""
        while self._packets:
            self._forget()

    def _forget(self) -> None:
        packet = self._packets.popleft()
        if not packet.is_written:
            self._overwritten(packet.events)


class StreamWriter:
    """Writes the events of one CPU. Packets go to disk as they fill up.

    Events must come in the order of time. As LTTng does it, a packet ends at the time of the
    event that did not fit, which is where the next one begins; but behind one that was ended for
    another reason, or is filled to the last byte, the next one begins with its first event. Losses
    are counted in the packet that is ended next. A further chunk of the archive begins with an
    empty packet.
    """

    def __init__(
        self,
        directory: Path,
        channel: str,
        uuid: UUID,
        cpu: int,
        origin: int,
        packet_bytes: int,
        *,
        begin: int = 0,
        breaks: Iterable[Break] = (),
        faults: Faults | None = None,
        ending: Ending | None = None,
        kept_packets: int = 0,
    ) -> None:
        """Open the files.

        Args:
            directory: of the trace; its folder `index` exists.
            channel: its name, with which those of files begin.
            uuid: of the trace.
            cpu: number of the CPU.
            origin: clock value (cycles) at time 0.
            packet_bytes: size of a full packet.
            begin: time of the begin of the first packet.
            breaks: in the order of time.
            faults: what goes wrong; nothing if None.
            ending: how the last file ends; completely if None.
            kept_packets: so many are kept in memory, older ones are overwritten, and only breaks
                write them; 0: each is written once it is full.
        """
        self._name = f"{channel}_{cpu}"
        self._uuid = uuid.bytes
        self._cpu = cpu
        self._origin = origin
        self._packet_bytes = packet_bytes
        # None: the packet begins with its first event.
        self._begin: int | None = begin + origin
        self._ended = begin + origin
        self._breaks = deque(breaks)
        self._next_break = self._breaks[0].begin if self._breaks else _FOR_EVER
        self._silent_until = 0
        self._is_missing = False
        self._faults = faults
        self._ending = ending
        # Nothing was written before, so that the first event carries the whole clock value.
        self._last = 0
        self._records: list[bytes] = []
        self._entries: list[Entry] = []
        self._size = _HEADER.size
        self._sequence = 0
        self._discarded = 0
        self._to_lose = 0
        self._is_full = False
        self._memory = PacketMemory(kept_packets, self._overwritten) if kept_packets else None
        if self._memory is None:
            self._open(directory)

    def emit(self, tracepoint: Tracepoint, time: int, context: bytes, *values: object) -> None:
        """Append one event at `time` (ns since time 0), if the trace has such events."""
        pack = tracepoint.pack
        if pack is None:
            return
        if time >= self._next_break:
            self._pass_breaks(time)
        if time < self._silent_until:
            self._lose(tracepoint, time, context, "pause")
            return
        is_losing = self._faults is not None and self._faults.is_losing(time)
        if is_losing or self._to_lose:
            self._to_lose = 0 if is_losing else self._to_lose - 1
            self._is_full = True
            self._discarded += 1
            self._lose(tracepoint, time, context, "loss")
            return
        cycles = time + self._origin
        record = pack(tracepoint.id, cycles & _LOW, context, *values)
        if cycles - self._last > _LOW:
            record = extended(record, tracepoint.id, cycles)
        size = self._size + len(record)
        if size > self._packet_bytes or self._is_full:
            if self._faults is not None and not self._is_full:
                self._is_full = True
                self._to_lose = self._faults.lost_events(self._cpu)
                if self._to_lose:
                    if self._faults.is_filled():
                        self._write_packet(self._last, self._packet_bytes, is_full=True)
                        self._begin = None
                        self._is_full = False
                    self.emit(tracepoint, time, context, *values)
                    return
            self._is_full = False
            self._write_packet(cycles, self._packet_bytes, is_full=True)
            size = _HEADER.size + len(record)
        if self._begin is None:
            self._begin = cycles
        tracepoint.count += 1
        self._records.append(record)
        if self._faults is not None:
            self._entries.append((tracepoint, time, context))
            self._faults.emitted(self._cpu, time, context)
        self._size = size
        self._last = cycles

    def close(self, end: int) -> None:
        """Write what is left as a last packet, which ends at time `end` (empty or not)."""
        self._pass_breaks(end)
        if self._memory is not None:
            self._end_packet(end)
            self._memory.close()
            return
        if end > self._silent_until:
            self._end_packet(end, self._ending)
        self._close()

    def _pass_breaks(self, time: int) -> None:
        """Do what is due at `time` or before it."""
        while self._breaks and self._breaks[0].begin <= time:
            due = self._breaks.popleft()
            if due.directory is None and due.end == due.begin:
                if not self._records:
                    continue
                self._end_packet(due.begin)
            elif due.directory is None:
                self._end_packet(due.begin)
            elif self._memory is not None:
                self._flush(due.begin)
                if not due.is_missing:
                    self._open(due.directory)
                    self._memory.write(self._write)
                    self._close()
            else:
                # The buffers are ended one after the other before any is opened again.
                if due.end > due.begin:
                    self._end_packet(due.begin)
                else:
                    self._flush(due.begin - _ROTATION_NS // (self._cpu + 1))
                self._close()
                self._open(due.directory)
                self._is_missing = due.is_missing
                self._begin = due.end + self._origin
                self._write_packet(self._begin, PAGE_BYTES)
            self._begin = None
            self._silent_until = due.end
        self._next_break = self._breaks[0].begin if self._breaks else _FOR_EVER

    def _flush(self, end: int) -> None:
        """End the packet at `end`, or with its last event after that, if there is any in it."""
        if self._records or self._begin is not None:
            self._end_packet(max(end, self._last - self._origin))

    def _end_packet(self, end: int, ending: Ending | None = None) -> None:
        self._is_full = False
        self._to_lose = 0
        pages = -(-self._size // PAGE_BYTES)
        self._write_packet(end + self._origin, pages * PAGE_BYTES, ending)

    def _write_packet(
        self, end: int, size: int, ending: Ending | None = None, *, is_full: bool = False
    ) -> None:
        content_bits, packet_bits = self._size * 8, size * 8
        begin = end if self._begin is None else self._begin
        numbers = (begin, end, content_bits, packet_bits, self._sequence, self._discarded)
        header = _HEADER.pack(_MAGIC, self._uuid, _STREAM_ID, self._cpu, *numbers, self._cpu)
        kept = self._kept(ending, is_full=is_full)
        if kept is None:
            cause = "packets" if ending is None else "truncation"
            self._withdraw(self._entries, cause)
            if self._faults is not None and self._sequence and not self._entries:
                since = self._ended - self._origin
                self._faults.missing_packet(self._uuid, self._cpu, since, end - self._origin, cause)
        elif ending is not None and ending.is_last_packet_cut:
            self._withdraw(self._entries[kept:], "truncation")
            self._file.write(header)
            self._file.writelines(self._records[:kept])
            self._file.writelines(record[:-1] for record in self._records[kept : kept + 1])
        else:
            content = b"".join((header, *self._records, bytes(size - self._size)))
            if self._memory is None:
                self._write(content, numbers)
            else:
                self._memory.keep(content, numbers, self._entries)
                self._entries = []
        self._records.clear()
        self._entries.clear()
        self._size = _HEADER.size
        self._begin = self._ended = end
        self._sequence += 1

    def _kept(self, ending: Ending | None, *, is_full: bool) -> int | None:
        """How many events of the packet are recorded; None if the whole packet is missing."""
        if self._is_missing or (ending is not None and ending.is_last_packet_missing):
            return None
        if ending is not None and ending.is_last_packet_cut:
            return len(self._records) // 2
        if is_full and self._faults is not None and self._faults.is_packet_lost():
            return None
        return len(self._records)

    def _write(self, content: bytes, numbers: PacketNumbers) -> None:
        """Append a packet to the files."""
        begin, end, content_bits, packet_bits, sequence, discarded = numbers
        self._file.write(content)
        self._index.write(
            _INDEX_ENTRY.pack(
                self._offset,
                packet_bits,
                content_bits,
                begin,
                end,
                discarded,
                _STREAM_ID,
                self._cpu,
                sequence,
            )
        )
        self._offset += len(content)

    def _overwritten(self, events: Iterable[Entry]) -> None:
        """The events of a packet are not recorded: others took its place in memory."""
        self._withdraw(events, "packets")

    def _withdraw(self, events: Iterable[Entry], cause: str) -> None:
        """Events that were emitted are not recorded."""
        for tracepoint, time, context in events:
            tracepoint.count -= 1
            self._lose(tracepoint, time, context, cause)

    def _lose(self, tracepoint: Tracepoint, time: int, context: bytes, cause: str) -> None:
        if self._faults is not None:
            self._faults.unrecorded(self._cpu, tracepoint, time, context, cause)

    def _open(self, directory: Path) -> None:
        self._file = (directory / self._name).open("wb")
        self._index = (directory / "index" / f"{self._name}.idx").open("wb")
        self._index.write(_INDEX_HEADER.pack(_INDEX_MAGIC, 1, 1, _INDEX_ENTRY.size))
        self._offset = 0

    def _close(self) -> None:
        self._file.close()
        self._index.close()
