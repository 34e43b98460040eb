"""One stream file (one CPU) in packets, and its index file."""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING

from msgflow.sim.ctf.tracepoint import Tracepoint, extended

if TYPE_CHECKING:
    from pathlib import Path
    from uuid import UUID

PACKET_BYTES = 32 * 1024
PAGE_BYTES = 4096

_LOW = 0xFFFF_FFFF
_MAGIC = 0xC1FC_1FC1
_STREAM_ID = 0
_HEADER = Struct("<I16sIQ" + "QQQQQQI")
_INDEX_HEADER = Struct(">IIII")
_INDEX_MAGIC = 0xC1F1_DCC1
_INDEX_ENTRY = Struct(">QQQQQQQQQ")


class StreamWriter:
    """Writes the events of one CPU. Packets go to disk as they fill up.

    Events must come in the order of time. A packet ends at the time of the event that did not
    fit, which is where the next one begins, as LTTng does it.
    """

    def __init__(
        self, path: Path, index_path: Path, uuid: UUID, cpu: int, origin: int, begin: int
    ) -> None:
        """Open the files.

        Args:
            path: stream file.
            index_path: its index.
            uuid: of the trace.
            cpu: number of the CPU.
            origin: clock value (cycles) at time 0.
            begin: time of the begin of the first packet.
        """
        self._file = path.open("wb")
        self._index = index_path.open("wb")
        self._index.write(_INDEX_HEADER.pack(_INDEX_MAGIC, 1, 1, _INDEX_ENTRY.size))
        self._uuid = uuid.bytes
        self._cpu = cpu
        self._origin = origin
        self._begin = begin + origin
        # Nothing was written before, so that the first event carries the whole clock value.
        self._last = 0
        self._records: list[bytes] = []
        self._size = _HEADER.size
        self._sequence = 0
        self._offset = 0

    def emit(self, tracepoint: Tracepoint, time: int, context: bytes, *values: object) -> None:
        """Append one event at `time` (ns since time 0)."""
        cycles = time + self._origin
        record = tracepoint.pack(tracepoint.id, cycles & _LOW, context, *values)
        if cycles - self._last > _LOW:
            record = extended(record, tracepoint.id, cycles)
        tracepoint.count += 1
        size = self._size + len(record)
        if size > PACKET_BYTES:
            self._write_packet(cycles, PACKET_BYTES)
            size = _HEADER.size + len(record)
        self._records.append(record)
        self._size = size
        self._last = cycles

    def close(self, end: int) -> None:
        """Write what is left as a last packet, which ends at time `end` (empty or not)."""
        pages = -(-self._size // PAGE_BYTES)
        self._write_packet(end + self._origin, pages * PAGE_BYTES)
        self._file.close()
        self._index.close()

    def _write_packet(self, end: int, size: int) -> None:
        content_bits, packet_bits = self._size * 8, size * 8
        header = _HEADER.pack(
            _MAGIC, self._uuid, _STREAM_ID, self._cpu,
            self._begin, end, content_bits, packet_bits, self._sequence, 0, self._cpu,
        )  # fmt: skip
        self._file.write(header)
        self._file.writelines(self._records)
        self._file.write(bytes(size - self._size))
        self._index.write(
            _INDEX_ENTRY.pack(
                self._offset, packet_bits, content_bits, self._begin, end,
                0, _STREAM_ID, self._cpu, self._sequence,
            )
        )  # fmt: skip
        self._records.clear()
        self._size = _HEADER.size
        self._begin = end
        self._offset += size
        self._sequence += 1
