"""Writes small CTF 1.8 traces of any content, so that tests know every byte of their input.

Independent of `msgflow_sim`, whose traces look like LTTng's: these may look odd on purpose.
"""

from __future__ import annotations

import struct
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

UUID = uuid.UUID("11111111-2222-3333-4444-555555555555")
CLOCK_UUID = uuid.UUID("99999999-8888-7777-6666-555555555555")
CONTEXTS = {"vpid": "i32", "vtid": "i32", "procname": "text[17]"}

_NUMBERS = {
    **{f"u{bits}": code for bits, code in ((8, "B"), (16, "H"), (32, "I"), (64, "Q"))},
    **{f"i{bits}": code for bits, code in ((8, "b"), (16, "h"), (32, "i"), (64, "q"))},
    "x64": "Q",
    "f32": "f",
    "f64": "d",
}


@dataclass(frozen=True)
class Event:
    """One event: clock value, name, payload, contexts, contexts of this event class alone."""

    time: int
    name: str
    payload: Sequence[Any] = ()
    context: Sequence[Any] = (100, 101, b"main")
    specific: Sequence[Any] = ()


@dataclass(frozen=True)
class Packet:
    """One packet; `begin` and `end` default to the first and last event."""

    events: Sequence[Event] = ()
    begin: int | None = None
    end: int | None = None
    discarded: int = 0
    sequence: int = 0
    cpu: int = 0


@dataclass(frozen=True)
class TraceContent:
    """A trace: field types per event, and packets per stream instance.

    Types: u8 … u64, i8 … i64, x64 (u64 to be shown in base 16), f32, f64, str, text[N], TYPE[N],
    TYPE[] (its length is an extra u32 member `NAME_length` before it), and of an enumeration its
    integer and labels, u8{A, B = 2 ... 4}.
    """

    events: Mapping[str, Mapping[str, str]]
    streams: Mapping[int, Sequence[Packet]]
    contexts: Mapping[str, str] = field(default_factory=lambda: dict(CONTEXTS))
    specific: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    environment: Mapping[str, str | int] = field(
        default_factory=lambda: {
            "hostname": "robot",
            "domain": "ust",
            "tracer_name": "lttng-ust",
            "tracer_major": 2,
            "tracer_minor": 13,
        }
    )
    trace_uuid: uuid.UUID = UUID
    clock_uuid: uuid.UUID = CLOCK_UUID
    frequency: int = 1_000_000_000
    offset_seconds: int = 1_700_000_000
    offset_cycles: int = 0


def write_trace(directory: Path, content: TraceContent) -> Path:
    """Write the trace, one file per stream, and return the directory."""
    directory.mkdir(parents=True)
    (directory / "metadata").write_text(_metadata(content), encoding="utf-8")
    for instance, packets in content.streams.items():
        data = b"".join(_packet(content, instance, packet) for packet in packets)
        (directory / f"channel_{instance}").write_bytes(data)
    return directory


def write_index(directory: Path, instance: int, packets: Sequence[Packet]) -> None:
    """Write an LTTng index of the stream file, true in all that matters but sizes."""
    data = (directory / f"channel_{instance}").read_bytes()
    entries = []
    offset = 0
    for packet in packets:
        bits = struct.unpack_from("<Q", data, offset + 56)[0]
        begin, end = _span(packet)
        numbers = (offset, bits, bits, begin, end, packet.discarded, 0, instance, packet.sequence)
        entries.append(struct.pack(">9Q", *numbers))
        offset += bits // 8
    index = directory / "index"
    index.mkdir(exist_ok=True)
    header = struct.pack(">IIII", 0xC1F1DCC1, 1, 1, 72)
    (index / f"channel_{instance}.idx").write_bytes(header + b"".join(entries))


def _span(packet: Packet) -> tuple[int, int]:
    times = [event.time for event in packet.events]
    begin = packet.begin if packet.begin is not None else min(times, default=0)
    end = packet.end if packet.end is not None else max(times, default=begin)
    return begin, end


def _packet(content: TraceContent, instance: int, packet: Packet) -> bytes:
    body = b"".join(_event(content, event) for event in packet.events)
    begin, end = _span(packet)
    bits = (84 + len(body)) * 8
    header = struct.pack("<I16sIQ", 0xC1FC1FC1, content.trace_uuid.bytes, 0, instance)
    context = struct.pack(
        "<QQQQQQI", begin, end, bits, bits, packet.sequence, packet.discarded, packet.cpu
    )
    return header + context + body


def _event(content: TraceContent, event: Event) -> bytes:
    names = list(content.events)
    specific = content.specific.get(event.name, {})
    return (
        struct.pack("<HQ", names.index(event.name), event.time)
        + _values(content.contexts, event.context)
        + _values(specific, event.specific)
        + _values(content.events[event.name], event.payload)
    )


def _values(types: Mapping[str, str], values: Sequence[Any]) -> bytes:
    return b"".join(_value(*pair) for pair in zip(types.values(), values, strict=True))


def _value(kind: str, value: Any) -> bytes:
    before, brace, behind = kind.partition("{")
    if brace:
        kind = before + behind.rpartition("}")[2]
    if kind in _NUMBERS:
        return struct.pack("<" + _NUMBERS[kind], value)
    if kind == "str":
        return bytes(value) + b"\0"
    element, _, length = kind.rstrip("]").partition("[")
    if element == "text":
        return bytes(value).ljust(int(length), b"\0")
    count = b"" if length else struct.pack("<I", len(value))
    return count + b"".join(_value(element, item) for item in value)


def _metadata(content: TraceContent) -> str:
    environment = "".join(
        f"    {name} = {value if isinstance(value, int) else _quoted(value)};\n"
        for name, value in content.environment.items()
    )
    common = _struct(content.contexts)
    classes = "".join(
        f"event {{\n    name = {_quoted(name)};\n    id = {number};\n    stream_id = 0;\n"
        f"    context := {_struct(content.specific.get(name, {}))};\n"
        f"    fields := {_struct(fields)};\n}};\n"
        for number, (name, fields) in enumerate(content.events.items())
    )
    return f"""/* CTF 1.8 */
typealias integer {{ size = 8; align = 8; signed = false; }} := uint8_t;
typealias integer {{ size = 16; align = 8; signed = false; }} := uint16_t;
typealias integer {{ size = 32; align = 8; signed = false; }} := uint32_t;
typealias integer {{ size = 64; align = 8; signed = false; }} := uint64_t;
trace {{
    major = 1;
    minor = 8;
    uuid = "{content.trace_uuid}";
    byte_order = le;
    packet.header := struct {{
        uint32_t magic; uint8_t uuid[16]; uint32_t stream_id; uint64_t stream_instance_id;
    }};
}};
env {{
{environment}}};
clock {{
    name = "monotonic";
    uuid = "{content.clock_uuid}";
    freq = {content.frequency};
    offset_s = {content.offset_seconds};
    offset = {content.offset_cycles};
}};
typealias integer {{
    size = 64; align = 8; signed = false; map = clock.monotonic.value;
}} := clock_value_t;
stream {{
    id = 0;
    packet.context := struct {{
        clock_value_t timestamp_begin; clock_value_t timestamp_end; uint64_t content_size;
        uint64_t packet_size; uint64_t packet_seq_num; uint64_t events_discarded; uint32_t cpu_id;
    }};
    event.header := struct {{ uint16_t id; clock_value_t timestamp; }};
    event.context := {common};
}};
{classes}"""


def _quoted(text: str) -> str:
    return f'"{text}"'


def _struct(types: Mapping[str, str]) -> str:
    return "struct {\n" + "".join(_field(name, kind) for name, kind in types.items()) + "}"


def _field(name: str, kind: str) -> str:
    if kind == "str":
        return f"    string {{ encoding = UTF8; }} _{name};\n"
    element, bracket, length = kind.rstrip("]").partition("[")
    if not bracket:
        return f"    {_number(kind)} _{name};\n"
    if length:
        return f"    {_number(element)} _{name}[{length}];\n"
    return f"    uint32_t _{name}_length;\n    {_number(element)} _{name}[_{name}_length];\n"


def _number(kind: str) -> str:
    integer, brace, labels = kind.partition("{")
    if brace:
        return f"enum : {_number(integer)} {{{labels}"
    if kind == "text":
        return "integer { size = 8; align = 8; signed = true; encoding = UTF8; }"
    if kind in {"f32", "f64"}:
        exponent, mantissa = (8, 24) if kind == "f32" else (11, 53)
        return f"floating_point {{ exp_dig = {exponent}; mant_dig = {mantissa}; align = 8; }}"
    signed = "true" if kind.startswith("i") else "false"
    base = 16 if kind.startswith("x") else 10
    return f"integer {{ size = {kind[1:]}; align = 8; signed = {signed}; base = {base}; }}"
