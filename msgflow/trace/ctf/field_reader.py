"""Reader of fields of any type, one field at a time: slow, but right for every layout."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import Any

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.declarations import EventClass, StreamClass, TraceClass
from msgflow.trace.ctf.field_types import BYTE, FieldError, Reference, Role, Scope, aligned

_MOST_EMPTY_ELEMENTS = 1 << 16
_MOST_VARIABLE_BYTES = 10
_USUAL_TEXT = 64


class FieldReader:
    """Reads the fields of one packet."""

    def __init__(self, data: bytes | memoryview, end: int) -> None:
        """Read from `data`, which begins with the packet, up to the bit `end`."""
        self.position = 0  # of the next field, in bits from the begin of the packet
        self.found: dict[str, Any] = {}  # role to the value found last, for fields that have a role
        self.bits: dict[str, int] = {}  # role to the size of that value, if it is an integer
        self._data = data
        self._end = min(end, len(data) * BYTE)
        self._scopes: dict[Scope, dict[str, Any]] = {}
        self._frames: list[dict[str, Any]] = []
        self._empty_elements = 0

    def read_scope(self, scope: Scope, structure: ctf.Structure) -> dict[str, Any]:
        """Read one of the structures of a packet or event."""
        if scope is Scope.EVENT_HEADER:
            self._empty_elements = 0
            for inner in (Scope.EVENT_CONTEXT, Scope.SPECIFIC_CONTEXT, Scope.PAYLOAD):
                self._scopes.pop(inner, None)
        values: dict[str, Any] = {}
        self._scopes[scope] = values
        self._frames = [self._scopes[outer] for outer in sorted(self._scopes) if outer < scope]
        self._fill(structure, values)
        return values

    def _read(self, field_type: ctf.Type) -> Any:
        match field_type:
            case ctf.Integer():
                return self._integer(field_type)
            case ctf.VariableInteger():
                return self._variable_integer(field_type)
            case ctf.Real():
                bits = self._bits(field_type.size, field_type.align, field_type.big_endian)
                codes = ("<I", "<f") if field_type.size == 32 else ("<Q", "<d")
                return float(struct.unpack(codes[1], struct.pack(codes[0], bits))[0])
            case ctf.String():
                return self._string(field_type)
            case ctf.Array():
                return self._elements(field_type, field_type.length)
            case ctf.Sequence():
                length = self._look_up(field_type.length)
                if length < 0:
                    raise FieldError("the length of a sequence is no length")
                return self._elements(field_type, length)
            case ctf.Structure():
                values: dict[str, Any] = {}
                self._fill(field_type, values)
                return values
            case ctf.Variant():
                value = self._look_up(field_type.selector)
                for choice in field_type.choices:
                    if choice.holds(value):
                        return {choice.name: self._read(choice.type)}
                raise FieldError(f"a variant has no option for the value {value}")
            case ctf.Optional():
                value = self._look_up(field_type.selector)
                is_there = any(first <= value <= last for first, last in field_type.ranges)
                return self._read(field_type.content) if is_there else None

    def _take(self, size: int, align: int = 1) -> int:
        """Return the position of so many bits and go on behind them."""
        begin = aligned(self.position, align)
        if begin + size > self._end:
            raise FieldError("a field goes beyond the end of the packet")
        self.position = begin + size
        return begin

    def _bits(self, size: int, align: int, big_endian: bool) -> int:
        begin = self._take(size, align)
        first, last = begin // BYTE, (begin + size + BYTE - 1) // BYTE
        content = bytes(self._data[first:last])
        if big_endian:
            shift = last * BYTE - begin - size
            return int.from_bytes(content, "big") >> shift & ((1 << size) - 1)
        return int.from_bytes(content, "little") >> (begin - first * BYTE) & ((1 << size) - 1)

    def _integer(self, field_type: ctf.Integer) -> int | bool:
        size = field_type.size
        value = self._bits(size, field_type.align, field_type.big_endian)
        if field_type.signed and value >> (size - 1):
            value -= 1 << size
        for role in field_type.roles:
            self.found[role], self.bits[role] = value, size
        return bool(value) if field_type.arrow == "bool" else value

    def _variable_integer(self, field_type: ctf.VariableInteger) -> int:
        value = 0
        for number in range(_MOST_VARIABLE_BYTES):
            byte = self._bits(BYTE, BYTE, False)
            value |= (byte & 0x7F) << (7 * number)
            if not byte & 0x80:
                break
        else:
            raise FieldError("an integer of variable length does not end")
        if field_type.signed and byte & 0x40:
            value -= 1 << (7 * (number + 1))
        for role in field_type.roles:
            self.found[role], self.bits[role] = value, 64
        return value

    def _string(self, field_type: ctf.String) -> str:
        begin = self._take(0, field_type.align) // BYTE
        end = self._end // BYTE
        size = _USUAL_TEXT
        # The rest of a packet may have megabytes: too much to copy for each text.
        while True:
            content = bytes(self._data[begin : min(begin + size, end)])
            length = content.find(b"\0")
            if length >= 0:
                break
            if begin + size >= end:
                raise FieldError("a text does not end within the packet")
            size *= 2
        self.position = (begin + length + 1) * BYTE
        return content[:length].decode("utf-8", "replace")

    def _elements(self, field_type: ctf.Array | ctf.Sequence, length: int) -> Any:
        element = field_type.element
        begin = self._take(0, field_type.align)
        smallest = _smallest_size(element)
        if smallest:
            room = (self._end - begin) // smallest
        else:
            # The size of the packet does not limit how many there are: elements take no bits.
            room = _MOST_EMPTY_ELEMENTS - self._empty_elements
            self._empty_elements += length
        if length > room:
            raise FieldError(f"{length} elements do not fit into the packet")
        roles = field_type.roles if isinstance(field_type, ctf.Array) else ()
        if not roles and not field_type.is_text:
            return [self._read(element) for _ in range(length)]
        self.position = begin + length * BYTE
        content = bytes(self._data[begin // BYTE : self.position // BYTE])
        if field_type.is_text:
            return content.partition(b"\0")[0].decode("utf-8", "replace")
        # Only a uuid: bytes.
        self.found |= dict.fromkeys(roles, content)
        return list(content)

    def _fill(self, field_type: ctf.Structure, values: dict[str, Any]) -> None:
        """Read a structure into `values`, in which later members look up lengths and selectors."""
        self._take(0, field_type.align)
        self._frames.append(values)
        for member in field_type.members:
            if isinstance(member.type, ctf.Structure):
                inner: dict[str, Any] = {}
                values[member.name] = inner
                self._fill(member.type, inner)
            else:
                values[member.name] = self._read(member.type)
        self._frames.pop()

    def _look_up(self, reference: Reference) -> int:
        value = None
        if reference.scope is not None:
            value = _follow(self._scopes.get(reference.scope), reference.path)
        if value is None:
            path = list(reference.path)
            level = len(self._frames) - 1
            while path and path[0] is None:
                level -= 1
                path.pop(0)
            for frame in reversed(self._frames[: level + 1]):
                # An absolute path through an array ends in the element that is being read.
                value = _follow(frame, path if reference.scope is None else path[-1:])
                if value is not None:
                    break
        if not isinstance(value, int):
            raise FieldError(f"there is no field {'.'.join(map(str, reference.path))}")
        return value


def _follow(value: Any, path: Iterable[str | None]) -> Any:
    for name in path:
        value = _member_of(value, name)
    return value


def _member_of(value: Any, name: str | None) -> Any:
    """Return a member of a structure, or of the one that a variant holds."""
    if not isinstance(value, dict):
        return None
    if name in value:
        return value[name]
    for inner in value.values():
        if isinstance(inner, dict) and name in inner:
            return inner[name]
    return None


def _smallest_size(field_type: ctf.Type) -> int:
    """Return the fewest bits that a field of this type takes."""
    match field_type:
        case ctf.Integer(size=size) | ctf.Real(size=size):
            return size
        case ctf.String() | ctf.VariableInteger():
            return BYTE
        case ctf.Array(element=element, length=length):
            return length * _smallest_size(element)
        case ctf.Structure(members=members):
            return sum(_smallest_size(member.type) for member in members)
        case _:
            return 0


class EventReader:
    """Reader of the events of one packet, which may begin at any bit."""

    def __init__(self, trace: TraceClass, stream: StreamClass, data: memoryview, end: int) -> None:
        """Read the packet's own header, which fields of events may refer to.

        `data` begins with the packet. `end` is the bit at which its content ends.
        """
        self._stream = stream
        self._reader = FieldReader(data, end)
        self._end = end
        self._reader.read_scope(Scope.PACKET_HEADER, trace.packet_header)
        self._reader.read_scope(Scope.PACKET_CONTEXT, stream.packet_context)

    def begin(self, position: int) -> int:
        """Return the aligned begin of the event at or behind this bit; the end if none is left."""
        begin = aligned(position, self._stream.event_header.align)
        return min(begin, self._end) if position < self._end else self._end

    def header(self, position: int, clock: int = 0) -> tuple[EventClass, int]:
        """Return the class of the event that begins at this bit, and the clock's value there.

        `clock` is its value before: a time stamp may be only the low bits.
        """
        reader = self._reader
        reader.position = position
        reader.found.pop(Role.TIME, None)
        reader.found[Role.EVENT_CLASS] = 0
        reader.read_scope(Scope.EVENT_HEADER, self._stream.event_header)
        event = self._stream.events.get(reader.found[Role.EVENT_CLASS])
        if event is None:
            raise FieldError(f"there is no event class {reader.found[Role.EVENT_CLASS]}")
        if not self._stream.has_time:
            return event, clock
        time, bits = reader.found.get(Role.TIME, clock), reader.bits.get(Role.TIME, 64)
        return event, time if bits == 64 else clock + (time - clock) % (1 << bits)

    def event(self, position: int) -> dict[Scope, dict[str, Any]]:
        """Read the contexts and payload of the event that begins at this bit."""
        event, _ = self.header(position)
        read = self._reader.read_scope
        return {
            Scope.EVENT_CONTEXT: read(Scope.EVENT_CONTEXT, self._stream.event_context),
            Scope.SPECIFIC_CONTEXT: read(Scope.SPECIFIC_CONTEXT, event.specific_context),
            Scope.PAYLOAD: read(Scope.PAYLOAD, event.payload),
        }

    def event_end(self, position: int) -> int:
        """Return the bit at which the event ends that begins at this bit."""
        self.event(position)
        return self._reader.position
