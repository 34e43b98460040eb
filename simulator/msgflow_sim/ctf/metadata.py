"""Metadata file: TSDL 1.8 text in packets.

The text declares what LTTng declares, the unused compact event header included, so that readers of
our traces meet what they meet in recorded ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from struct import Struct
from typing import TYPE_CHECKING
from uuid import UUID

from msgflow_sim.events import EventField, FieldKind

if TYPE_CHECKING:
    from msgflow_sim.layout import EventType, Layout

_PACKET_BYTES = 4096
_MAGIC = 0x75D1_1D57
_HEADER = Struct("<I16sIIIBBBBB")

_PREAMBLE = """\
/* CTF 1.8 */

typealias integer {{ size = 8; align = 8; signed = false; }} := uint8_t;
typealias integer {{ size = 16; align = 8; signed = false; }} := uint16_t;
typealias integer {{ size = 32; align = 8; signed = false; }} := uint32_t;
typealias integer {{ size = 64; align = 8; signed = false; }} := uint64_t;
typealias integer {{ size = 64; align = 8; signed = false; }} := unsigned long;
typealias integer {{ size = 5; align = 1; signed = false; }} := uint5_t;
typealias integer {{ size = 27; align = 1; signed = false; }} := uint27_t;

trace {{
	major = 1;
	minor = 8;
	uuid = "{uuid}";
	byte_order = le;
	packet.header := struct {{
		uint32_t magic;
		uint8_t  uuid[16];
		uint32_t stream_id;
		uint64_t stream_instance_id;
	}};
}};

env {{
{environment}
}};

clock {{
	name = "monotonic";
	uuid = "{clock_uuid}";
	description = "Monotonic Clock";
	freq = 1000000000; /* Frequency, in Hz */
	/* clock value offset from Epoch is: offset * (1/freq) */
	offset = {clock_offset};
}};

typealias integer {{
	size = 27; align = 1; signed = false;
	map = clock.monotonic.value;
}} := uint27_clock_monotonic_t;

typealias integer {{
	size = 32; align = 8; signed = false;
	map = clock.monotonic.value;
}} := uint32_clock_monotonic_t;

typealias integer {{
	size = 64; align = 8; signed = false;
	map = clock.monotonic.value;
}} := uint64_clock_monotonic_t;

struct packet_context {{
	uint64_clock_monotonic_t timestamp_begin;
	uint64_clock_monotonic_t timestamp_end;
	uint64_t content_size;
	uint64_t packet_size;
	uint64_t packet_seq_num;
	unsigned long events_discarded;
	uint32_t cpu_id;
}};

struct event_header_compact {{
	enum : uint5_t {{ compact = 0 ... 30, extended = 31 }} id;
	variant <id> {{
		struct {{
			uint27_clock_monotonic_t timestamp;
		}} compact;
		struct {{
			uint32_t id;
			uint64_clock_monotonic_t timestamp;
		}} extended;
	}} v;
}} align(8);

struct event_header_large {{
	enum : uint16_t {{ compact = 0 ... 65534, extended = 65535 }} id;
	variant <id> {{
		struct {{
			uint32_clock_monotonic_t timestamp;
		}} compact;
		struct {{
			uint32_t id;
			uint64_clock_monotonic_t timestamp;
		}} extended;
	}} v;
}} align(8);

stream {{
	id = 0;
	event.header := struct event_header_large;
	packet.context := struct packet_context;
	event.context := struct {{
		integer {{ size = 32; align = 8; signed = 1; encoding = none; base = 10; }} _vpid;
		integer {{ size = 32; align = 8; signed = 1; encoding = none; base = 10; }} _vtid;
		integer {{ size = 8; align = 8; signed = 1; encoding = UTF8; base = 10; }} _procname[17];
	}};
}};

"""

_EVENT = """\
event {{
	name = "{name}";
	id = {id};
	stream_id = 0;
	loglevel = 13;
	fields := struct {{
{fields}	}};
}};

"""


def metadata_text(
    layout: Layout,
    *,
    uuid: UUID,
    clock_uuid: UUID,
    clock_offset: int,
    environment: Mapping[str, str | int],
) -> str:
    """TSDL of a trace whose clock shows 0 at `clock_offset` ns since the epoch."""
    lines = [
        f'\t{name} = "{value}";' if isinstance(value, str) else f"\t{name} = {value};"
        for name, value in environment.items()
    ]
    text = _PREAMBLE.format(
        uuid=uuid, clock_uuid=clock_uuid, clock_offset=clock_offset, environment="\n".join(lines)
    )
    return text + "".join(_event_text(event, index) for index, event in enumerate(layout.events))


def packets(text: str, uuid: UUID) -> Iterator[bytes]:
    """The text cut into packets of one page, each with its header."""
    content = text.encode()
    capacity = _PACKET_BYTES - _HEADER.size
    for start in range(0, len(content), capacity):
        part = content[start : start + capacity]
        content_bits = (_HEADER.size + len(part)) * 8
        header = _HEADER.pack(_MAGIC, uuid.bytes, 0, content_bits, _PACKET_BYTES * 8, 0, 0, 0, 1, 8)
        yield (header + part).ljust(_PACKET_BYTES, b"\0")


def _event_text(event: EventType, event_id: int) -> str:
    fields = "".join(f"\t\t{line};\n" for field in event.fields for line in _field_lines(field))
    return _EVENT.format(name=event.name, id=event_id, fields=fields)


def _field_lines(field: EventField) -> Iterator[str]:
    if field.kind in {FieldKind.SEQUENCE, FieldKind.NUMBERS}:
        length = f"__{field.name}_length"
        yield f"{FieldKind.UNSIGNED.tsdl} {length}"
        yield f"{field.kind.tsdl} _{field.name}[ {length} ]"
        return
    length = f"[{field.length}]" if field.length else ""
    yield f"{field.kind.tsdl} _{field.name}{length}"
