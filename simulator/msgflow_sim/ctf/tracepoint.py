"""Tracepoints: event classes that make records of header, thread context and payload."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import itemgetter
from struct import Struct

from msgflow_sim.events import EventField, FieldKind

_CONTEXT = Struct("<ii17s")
CONTEXT_SIZE = _CONTEXT.size

COMPACT_HEADER_SIZE = 6
_EXTENDED_HEADER = Struct("<HIQ")
_EXTENDED_ID = 65535
_LENGTH = Struct("<Q")
_NUMBER = Struct("<i")


def thread_context(pid: int, tid: int, name: str) -> bytes:
    """Event context of a thread (vpid, vtid, procname cut to 15 bytes), part of each record."""
    return _CONTEXT.pack(pid, tid, name.encode()[:15])


def thread_of(context: bytes) -> tuple[int, int, str]:
    """What `thread_context` was made from: pid, tid, name."""
    pid, tid, name = _CONTEXT.unpack(context)
    return pid, tid, name.rstrip(b"\0").decode()


class Tracepoint:
    """Makes records of one event class and counts them.

    Attributes:
        id: number of the event class in the trace.
        name: full name.
        pack: (id, clock, thread context, values of the signature…) → record. Of the clock, LTTng
            has the low 32 bits. Strings are given as `str`, arrays of bytes as `bytes`, sequences
            as such. None if the trace does not have this event class.
        count: records written so far; raised by the stream.
    """

    __slots__ = ("count", "id", "name", "pack")

    def __init__(
        self,
        name: str,
        event_id: int,
        signature: Sequence[EventField],
        fields: Sequence[EventField] | None,
        header: str = f"<HI{CONTEXT_SIZE}s",
    ) -> None:
        """Prepare the records.

        Args:
            name: full name.
            event_id: number of the event class.
            signature: the values that are given.
            fields: those of them that are recorded, by name; None if the event is not recorded.
            header: `struct` codes of id, clock and context.
        """
        self.id = event_id
        self.name = name
        self.pack = None if fields is None else _chosen(signature, fields, header)
        self.count = 0


def extended(record: bytes, event_id: int, cycles: int) -> bytes:
    """The same record with the header that carries the whole clock value."""
    return _EXTENDED_HEADER.pack(_EXTENDED_ID, event_id, cycles) + record[COMPACT_HEADER_SIZE:]


def _chosen(
    signature: Sequence[EventField], fields: Sequence[EventField], header: str
) -> Callable[..., bytes]:
    """A packer that takes the values of the signature and records the fields."""
    pack = _packer(fields, header)
    given = [field.name for field in signature]
    positions = [given.index(field.name) for field in fields]
    if positions == list(range(len(given))):
        return pack
    if len(positions) == 1:
        (only,) = positions
        return lambda event_id, low, context, *values: pack(event_id, low, context, values[only])
    choose = itemgetter(*positions)
    return lambda event_id, low, context, *values: pack(event_id, low, context, *choose(values))


def _packer(fields: Sequence[EventField], header_code: str) -> Callable[..., bytes]:
    codes = [_code(field) for field in fields]
    known = [code for code in codes if code is not None]
    if len(known) == len(codes):
        return Struct(header_code + "".join(known)).pack
    header = Struct(header_code)
    parts = [
        _VARIABLE[field.kind] if code is None else Struct("<" + code).pack
        for field, code in zip(fields, codes, strict=True)
    ]

    def pack(event_id: int, low: int, context: bytes, *values: object) -> bytes:
        chunks = [header.pack(event_id, low, context)]
        chunks.extend(part(value) for part, value in zip(parts, values, strict=True))
        return b"".join(chunks)

    return pack


def _code(field: EventField) -> str | None:
    if field.kind in {FieldKind.BYTES, FieldKind.NAME}:
        return f"{field.length}s"
    return field.kind.code


def _text(value: str) -> bytes:
    return f"{value}\0".encode()


def _sequence(values: Sequence[int]) -> bytes:
    return _LENGTH.pack(len(values)) + b"".join(map(_LENGTH.pack, values))


def _numbers(values: Sequence[int]) -> bytes:
    return _LENGTH.pack(len(values)) + b"".join(map(_NUMBER.pack, values))


_VARIABLE: dict[FieldKind, Callable[..., bytes]] = {
    FieldKind.STRING: _text,
    FieldKind.SEQUENCE: _sequence,
    FieldKind.NUMBERS: _numbers,
}
