"""One event class, ready to make records: large event header, thread context, payload."""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING

from msgflow.sim.layout import EventField, EventType, FieldKind

if TYPE_CHECKING:
    from collections.abc import Callable

_CONTEXT = Struct("<ii17s")
CONTEXT_SIZE = _CONTEXT.size
_HEADER_CODE = f"<HI{CONTEXT_SIZE}s"

COMPACT_HEADER_SIZE = 6
_EXTENDED_HEADER = Struct("<HIQ")
_EXTENDED_ID = 65535


def thread_context(pid: int, tid: int, name: str) -> bytes:
    """Event context of a thread (vpid, vtid, procname cut to 15 bytes), part of each record."""
    return _CONTEXT.pack(pid, tid, name.encode()[:15])


class Tracepoint:
    """Makes records of one event class and counts them.

    Attributes:
        id: number of the event class in the trace.
        name: full name.
        pack: (id, low 32 bits of the clock, thread context, field values…) → record. Strings are
            given as `str`, fixed arrays as `bytes`.
        count: records written so far; raised by the stream.
    """

    __slots__ = ("count", "id", "name", "pack")

    def __init__(self, event_type: EventType, event_id: int) -> None:
        self.id = event_id
        self.name = event_type.name
        self.pack = _packer(event_type.fields)
        self.count = 0


def extended(record: bytes, event_id: int, cycles: int) -> bytes:
    """The same record with the header that carries the whole clock value."""
    return _EXTENDED_HEADER.pack(_EXTENDED_ID, event_id, cycles) + record[COMPACT_HEADER_SIZE:]


def _packer(fields: tuple[EventField, ...]) -> Callable[..., bytes]:
    codes = [f"{field.length}s" if field.length else field.kind.code for field in fields]
    if all(field.kind is not FieldKind.STRING for field in fields):
        return Struct(_HEADER_CODE + "".join(codes)).pack
    header = Struct(_HEADER_CODE)
    parts = [Struct("<" + code) if code else None for code in codes]

    def pack(event_id: int, low: int, context: bytes, *values: object) -> bytes:
        chunks = [header.pack(event_id, low, context)]
        for part, value in zip(parts, values, strict=True):
            chunks.append(f"{value}\0".encode() if part is None else part.pack(value))
        return b"".join(chunks)

    return pack
