"""Traces without any clock: their events have an order, but no times."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow.trace.ctf.clock import Clock
from msgflow.trace.ctf.types import (
    END_ROLE,
    TIME_ROLE,
    Array,
    Choice,
    Integer,
    Member,
    Structure,
    Type,
    VariableInteger,
    Variant,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from msgflow.trace.ctf.declarations import StreamClass, TraceClass
    from msgflow.trace.ctf.packets import Packet
    from msgflow.trace.ctf.streams import Stream

_TIMES = {TIME_ROLE, END_ROLE}


def is_timeless(trace: TraceClass) -> bool:
    """Tell whether no stream class of a trace has a clock."""
    return bool(trace.streams) and all(stream.clock is None for stream in trace.streams.values())


def give_order(stream: StreamClass) -> None:
    """Let the packets of a stream class be ordered by numbers in place of times."""
    stream.clock, stream.has_time = Clock(), False
    stream.packet_context = _structure(stream.packet_context)
    stream.event_header = _structure(stream.event_header)


def numbers_of(streams: Iterable[Stream]) -> dict[Packet, tuple[int, int]]:
    """Number all packets, stream after stream: in place of the clock's value and the time."""
    packets = (packet for stream in streams for packet in stream.packets)
    return {packet: (number, number) for number, packet in enumerate(packets)}


def _structure(declared: Structure) -> Structure:
    members = tuple(Member(member.name, _type(member.type)) for member in declared.members)
    return Structure(members, declared.minimum_align)


def _type(declared: Type) -> Type:
    """Return the type without what says that a field is a time: it is one of no clock."""
    match declared:
        case Structure():
            return _structure(declared)
        case Variant():
            choices = (Choice(c.name, _type(c.type), c.ranges) for c in declared.choices)
            return replace(declared, choices=tuple(choices))
        case Integer() | VariableInteger() | Array():
            return replace(declared, roles=declared.roles - _TIMES)
        case _:
            return declared
