"""Headers of packets: their sizes, times, numbers and counters of lost events."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal
from uuid import UUID

from msgflow.trace.ctf.field_reader import FieldReader
from msgflow.trace.ctf.field_types import (
    BYTE,
    Array,
    FieldError,
    Integer,
    MetadataError,
    Role,
    Scope,
    Structure,
)
from msgflow.trace.ctf.fixed_layout import DynamicError, Leaf, lay_out

if TYPE_CHECKING:
    from msgflow.trace.ctf.declarations import StreamClass, TraceClass

MAGIC = 0xC1FC1FC1
_CPU = "cpu_id"
_LONGEST_HEADER = 1 << 16
_KNOWN_ROLES = set(Role) - {Role.EVENT_CLASS}


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
        """Compile the headers that a trace declares."""
        self._trace = trace
        self._uuid = None if trace.uuid is None else UUID(trace.uuid).bytes
        self._plans: dict[int, _Plan | None] = {}
        self._start = _plan(trace.packet_header, 0)
        contexts = [self._plan_of(stream) for stream in trace.streams.values()]
        ends = [_LONGEST_HEADER if plan is None else plan.end // BYTE + 1 for plan in contexts]
        # Number of bytes that hold any header, unless its size varies.
        self.size = max(ends, default=_LONGEST_HEADER)
        if self.size > _LONGEST_HEADER:
            raise MetadataError(f"the headers of packets have {self.size:,} bytes")

    def read(self, data: bytes) -> PacketHeader:
        """Read the header at the begin of `data`."""
        if self._start is None:
            return self._read_field_by_field(data)
        found = self._start.read(data)
        stream = self._check(found)
        plan = self._plans[stream.id]
        if plan is None:
            return self._read_field_by_field(data)
        found |= plan.read(data)
        return self._header(stream, found, plan.end, plan.discarded_bits)

    def pattern(self, uuid_text: str | None = None) -> bytes | None:
        """Return the bytes with which every packet begins, None if they are not always the same.

        `uuid_text` is the uuid in the packets, where it is not that of the metadata.
        """
        uuid_text = uuid_text or self._trace.uuid
        if self._start is None or uuid_text is None:
            return None
        places = self._start.places
        if Role.MAGIC not in places or Role.UUID not in places:
            return None
        magic, uuid = places[Role.MAGIC], places[Role.UUID]
        if (magic.first, magic.last, uuid.first) != (0, 4, 4):
            return None
        return MAGIC.to_bytes(4, magic.order) + bytes.fromhex(uuid_text.replace("-", ""))

    def _plan_of(self, stream: StreamClass) -> _Plan | None:
        plan = None if self._start is None else _plan(stream.packet_context, self._start.end)
        self._plans[stream.id] = plan
        return plan

    def _check(self, found: dict[str, Any]) -> StreamClass:
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

    def _read_field_by_field(self, data: bytes) -> PacketHeader:
        reader = FieldReader(data, len(data) * BYTE)
        reader.read_scope(Scope.PACKET_HEADER, self._trace.packet_header)
        stream = self._check(reader.found)
        context = reader.read_scope(Scope.PACKET_CONTEXT, stream.packet_context)
        found = dict(reader.found)
        if isinstance(context.get(_CPU), int):
            found[_CPU] = context[_CPU]
        return self._header(stream, found, reader.position, 64)

    def _header(
        self, stream: StreamClass, found: dict[str, Any], events_at: int, discarded_bits: int
    ) -> PacketHeader:
        uuid = found.get(Role.UUID)
        is_foreign = uuid is not None and self._uuid is not None and uuid != self._uuid
        return PacketHeader(
            stream=stream,
            instance=found.get(Role.STREAM),
            size_bits=found.get(Role.PACKET_SIZE),
            content_bits=found.get(Role.CONTENT_SIZE),
            events_at=events_at,
            begin=found.get(Role.TIME),
            end=found.get(Role.END),
            sequence=found.get(Role.SEQUENCE),
            discarded=found.get(Role.DISCARDED),
            discarded_bits=discarded_bits,
            cpu=found.get(_CPU),
            foreign=str(UUID(bytes=uuid)) if uuid is not None and is_foreign else None,
        )


@dataclass(frozen=True, slots=True)
class _Place:
    """Bytes that hold a value: a number, or an array of bytes."""

    first: int
    last: int
    shift: int
    mask: int
    order: Literal["little", "big"]
    is_number: bool

    def read(self, data: bytes) -> Any:
        content = data[self.first : self.last]
        if len(content) < self.last - self.first:
            raise FieldError("the file ends within the header of a packet")
        if not self.is_number:
            return content
        return int.from_bytes(content, self.order) >> self.shift & self.mask


@dataclass(frozen=True)
class _Plan:
    """Places of the values of a structure of fixed layout."""

    places: dict[str, _Place]  # by role (or name)
    end: int  # the bit at which the structure ends
    discarded_bits: int  # size of the counter of lost events

    def read(self, data: bytes) -> dict[str, Any]:
        return {name: place.read(data) for name, place in self.places.items()}


def _plan(structure: Structure, position: int) -> _Plan | None:
    leaves: list[Leaf] = []
    try:
        end = lay_out(structure, position, leaves)
    except DynamicError:
        return None
    places = {}
    discarded_bits = 64
    for leaf in leaves:
        roles = leaf.type.roles if isinstance(leaf.type, Integer | Array) else frozenset()
        for role in roles & _KNOWN_ROLES:
            places[role] = _place(leaf)
        if leaf.path == (_CPU,) and isinstance(leaf.type, Integer):
            places[_CPU] = _place(leaf)
        if Role.DISCARDED in roles and isinstance(leaf.type, Integer):
            discarded_bits = leaf.type.size
    return _Plan(places, end, discarded_bits)


def _place(leaf: Leaf) -> _Place:
    first = leaf.position // BYTE
    if isinstance(leaf.type, Array):
        return _Place(first, first + leaf.type.length, 0, 0, "little", False)
    end = leaf.position + leaf.type.size
    last = (end + BYTE - 1) // BYTE
    big = leaf.type.big_endian
    shift = last * BYTE - end if big else leaf.position - first * BYTE
    return _Place(first, last, shift, (1 << leaf.type.size) - 1, "big" if big else "little", True)
