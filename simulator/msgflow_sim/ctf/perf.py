"""Writer of CTF as `perf data convert --to-ctf` makes it: one packet for each CPU, no index."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from struct import Struct
from typing import TYPE_CHECKING
from uuid import UUID

from msgflow_sim.ctf.stream import PAGE_BYTES
from msgflow_sim.ctf.tracepoint import Tracepoint
from msgflow_sim.events import FieldKind

if TYPE_CHECKING:
    from msgflow_sim.ctf.trace import TraceIdentity
    from msgflow_sim.events import EventField

_MAGIC = 0xC1FC_1FC1
_HEADER = Struct("<I16sI" + "QQQQQI")
# Instruction pointer, thread, process, id, period, type, flags, preemptions, thread once more.
_COMMON = Struct("<QiiQQIIIi")
_IP = 0xFFFF_FFFF_813A_89C4
_FIRST_ID, _FIRST_TYPE, _FLAGS = 2_999, 372, 1

_UNSIGNED = "integer {{ size = {}; align = {}; signed = false; encoding = none; base = {}; \
byte_order = le; }}"
_SIGNED = _UNSIGNED.replace("false", "true")
_TYPES = {
    FieldKind.POINTER: _UNSIGNED.format(64, 1, "hexadecimal"),
    FieldKind.UNSIGNED: _UNSIGNED.format(64, 1, "decimal"),
    FieldKind.SIGNED: _SIGNED.format(64, 1, "decimal"),
    FieldKind.SIGNED_32: _SIGNED.format(32, 1, "decimal"),
    FieldKind.UNSIGNED_32: _UNSIGNED.format(32, 1, "decimal"),
    FieldKind.STRING: "string { encoding = UTF8; }",
}
_NUMBER, _COUNT = _TYPES[FieldKind.UNSIGNED_32], _UNSIGNED.format(64, 8, "decimal")
_COMMON_FIELDS = {
    "perf_ip": _TYPES[FieldKind.POINTER],
    "perf_tid": _TYPES[FieldKind.SIGNED_32],
    "perf_pid": _TYPES[FieldKind.SIGNED_32],
    "perf_id": _TYPES[FieldKind.UNSIGNED],
    "perf_period": _TYPES[FieldKind.UNSIGNED],
    "common_type": _NUMBER,
    "common_flags": _NUMBER,
    "common_preempt_count": _NUMBER,
    "common_pid": _TYPES[FieldKind.SIGNED_32],
}
_PREAMBLE = """\
/* CTF 1.8 */

trace {{
	major = 1;
	minor = 8;
	uuid = "{uuid}";
	byte_order = le;
	packet.header := struct {{
		{word} magic;
		{byte} uuid[16];
		{word} stream_id;
	}} align(8);
}};

env {{
	host = "{hostname}";
	sysname = "Linux";
	release = "6.8.0-45-generic";
	version = "6.8.12";
	machine = "x86_64";
	domain = "kernel";
	tracer_name = "perf";
}};

clock {{
	name = perf_clock;
	uuid = "{clock_uuid}";
	description = "perf clock";
	freq = 1000000000;
	precision = 10;
	offset_s = 0;
	offset = 0;
	absolute = FALSE;
}};

stream {{
	id = 0;
	event.header := struct {{
		{word} id;
		{time} timestamp;
	}} align(8);

	packet.context := struct {{
		{count} timestamp_begin;
		{count} timestamp_end;
		{count} content_size;
		{count} packet_size;
		{count} events_discarded;
		{number} cpu_id;
	}} align(8);
}};
"""
_EVENT = """
event {{
	id = {id};
	name = "{name}";
	stream_id = 0;
	fields := struct {{
{fields}	}} align({alignment});
}};
"""


class PerfWriter:
    """Writes one trace, a stream for each CPU, once it is complete."""

    def __init__(
        self,
        directory: Path,
        events: Mapping[str, Sequence[EventField]],
        identity: TraceIdentity,
        cpu_count: int,
    ) -> None:
        """Make the directory; `events` are the fields of each event by its name."""
        self._directory = directory
        self._identity = identity
        self._tracepoints = {
            name: Tracepoint(name, number, fields, fields, f"<IQ{_COMMON.size}s")
            for number, (name, fields) in enumerate(events.items())
        }
        self._records: list[list[bytes]] = [[] for _ in range(cpu_count)]
        self._times: list[list[int]] = [[] for _ in range(cpu_count)]
        directory.mkdir(parents=True)
        (directory / "metadata").write_text(_metadata(events, identity), encoding="utf-8")

    def emit(
        self, name: str, cpu: int, time: int, tid: int, pid: int, values: Sequence[object]
    ) -> None:
        """Append one event at `time` (ns since time 0), during which a thread ran on the CPU."""
        tracepoint = self._tracepoints[name]
        assert tracepoint.pack is not None
        number = tracepoint.id
        common = _COMMON.pack(
            _IP, tid, pid, _FIRST_ID + number, 1, _FIRST_TYPE + number, _FLAGS, 0, tid
        )
        cycles = time + self._identity.uptime_ns
        self._records[cpu].append(tracepoint.pack(number, cycles, common, *values))
        self._times[cpu].append(cycles)

    def close(self) -> None:
        """Write the streams; a CPU without events has none."""
        for cpu, (records, times) in enumerate(zip(self._records, self._times, strict=True)):
            if not records:
                continue
            size = _HEADER.size + sum(map(len, records))
            pages = -(-size // PAGE_BYTES)
            header = _HEADER.pack(
                _MAGIC,
                self._identity.uuid.bytes,
                0,
                times[0],
                times[-1],
                size * 8,
                pages * PAGE_BYTES * 8,
                0,
                cpu,
            )
            content = b"".join((header, *records))
            (self._directory / f"perf_stream_{cpu}").write_bytes(
                content.ljust(pages * PAGE_BYTES, b"\0")
            )


def _metadata(events: Mapping[str, Sequence[EventField]], identity: TraceIdentity) -> str:
    """TSDL of the trace. Nothing names the clock: its uuid is of this trace only."""
    clock = sha256(f"{identity.uuid}/clock".encode()).digest()
    text = _PREAMBLE.format(
        uuid=identity.uuid,
        clock_uuid=UUID(bytes=clock[:16], version=4),
        hostname=identity.hostname,
        byte=_UNSIGNED.format(8, 8, "decimal"),
        word=_UNSIGNED.format(32, 8, "decimal"),
        number=_NUMBER,
        count=_COUNT,
        time=_COUNT.replace("le; }", "le; map = clock.perf_clock.value; }"),
    )
    for number, (name, fields) in enumerate(events.items()):
        types = _COMMON_FIELDS | {field.name: _TYPES[field.kind] for field in fields}
        lines = "".join(f"\t\t{tsdl} {field};\n" for field, tsdl in types.items())
        has_text = any(field.kind is FieldKind.STRING for field in fields)
        text += _EVENT.format(id=number, name=name, fields=lines, alignment=8 if has_text else 1)
    return text
