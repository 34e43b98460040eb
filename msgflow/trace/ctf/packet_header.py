"""Headers of packets: their sizes, times, numbers and counters of lost events."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal
from uuid import UUID

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.declarations import StreamClass, TraceClass
from msgflow.trace.ctf.field_reader import FieldReader
from msgflow.trace.ctf.field_types import BYTE, FieldError, MetadataError, Role, Scope
from msgflow.trace.ctf.layout import DynamicError, Leaf, lay_out

MAGIC = 0xC1FC1FC1
_LONGEST_HEADER = 1 << 16


@dataclass(frozen=True, slots=True)
class PacketHeader:
    """Header and context of a packet; None for what they do not have."""

    stream: StreamClass
    instance: int | None  # which stream of the class (the buffer)
    size_bits: int | None  # of the packet
    content_bits: int | None  # of the part of it that is used, header and context included
    events_at: int  # the bit at which its events begin
    begin: int | None  # clock value at its begin
    end: int | None  # clock value at its end
    sequence: int | None  # its number in the stream
    discarded: int | None  # events lost in the stream so far
    discarded_bits: int  # size of that counter
    cpu: int | None  # the CPU it was written on
    foreign: str | None  # uuid of the packet's trace, if it differs from the uuid of the metadata


class HeaderReader:
    """Reads the packet headers of one trace."""

    def __init__(self, trace: TraceClass) -> None:
        """Find out how many bytes hold any header, unless its size varies."""
        self._trace = trace
        self._uuid = None if trace.uuid is None else UUID(trace.uuid).bytes
        sizes = [_size(trace.packet_header, each.packet_context) for each in trace.streams.values()]
        self.size = max(sizes, default=_LONGEST_HEADER)
        if self.size > _LONGEST_HEADER:
            raise MetadataError(f"the headers of packets have {self.size:,} bytes")

    def read(self, data: bytes) -> PacketHeader:
        """Read the header at the begin of `data`."""
        reader = FieldReader(data, len(data) * BYTE)
        self._read_scope(reader, len(data), Scope.PACKET_HEADER, self._trace.packet_header)
        found = reader.found
        stream = self._stream_of(found)
        context = self._read_scope(reader, len(data), Scope.PACKET_CONTEXT, stream.packet_context)
        uuid, cpu = found.get(Role.UUID), context.get("cpu_id")
        is_foreign = uuid is not None and self._uuid is not None and uuid != self._uuid
        return PacketHeader(
            stream=stream,
            instance=found.get(Role.STREAM),
            size_bits=found.get(Role.PACKET_SIZE),
            content_bits=found.get(Role.CONTENT_SIZE),
            events_at=reader.position,
            begin=found.get(Role.TIME) if stream.has_time else None,
            end=found.get(Role.END) if stream.has_time else None,
            sequence=found.get(Role.SEQUENCE),
            discarded=found.get(Role.DISCARDED),
            discarded_bits=reader.bits.get(Role.DISCARDED, 64),
            cpu=cpu if isinstance(cpu, int) else None,
            foreign=str(UUID(bytes=uuid)) if uuid is not None and is_foreign else None,
        )

    def pattern(self, uuid_text: str | None = None) -> bytes | None:
        """Return the bytes with which every packet begins, None if they are not always the same.

        `uuid_text` is the uuid in the packets, where it is not that of the metadata.
        """
        uuid_text = uuid_text or self._trace.uuid
        leaves: list[Leaf] = []
        with suppress(DynamicError):
            lay_out(self._trace.packet_header, 0, leaves)
        match leaves[:2]:
            case [
                Leaf(type=ctf.Integer(size=32, big_endian=big_endian) as magic),
                Leaf(type=ctf.Array() as uuid, position=32),
            ] if uuid_text and Role.MAGIC in magic.roles and Role.UUID in uuid.roles:
                order: Literal["big", "little"] = "big" if big_endian else "little"
                return MAGIC.to_bytes(4, order) + bytes.fromhex(uuid_text.replace("-", ""))
        return None

    def _read_scope(
        self, reader: FieldReader, available: int, scope: Scope, structure: ctf.Structure
    ) -> dict[str, Any]:
        try:
            return reader.read_scope(scope, structure)
        except FieldError as error:
            if available < self.size < _LONGEST_HEADER:
                raise FieldError("the file ends within the header of a packet") from error
            raise

    def _stream_of(self, found: dict[str, Any]) -> StreamClass:
        if found.get(Role.MAGIC, MAGIC) != MAGIC:
            raise FieldError("no packet begins here, the magic number is missing")
        streams = self._trace.streams
        class_id = found.get(Role.STREAM_CLASS)
        if class_id is None and len(streams) == 1:
            return next(iter(streams.values()))
        stream = streams.get(class_id or 0)
        if stream is None:
            raise FieldError(f"there is no stream class {class_id}")
        return stream


def _size(header: ctf.Structure, context: ctf.Structure) -> int:
    try:
        return lay_out(context, lay_out(header, 0)) // BYTE + 1
    except DynamicError:
        return _LONGEST_HEADER
