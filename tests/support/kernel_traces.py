"""Kernel traces as lttng-modules writes them on x86-64: packed, little endian, hundreds of classes.

The two events of network packets copy the headers as they are on the wire; what the metadata
declares of them follows `include/instrumentation/events/net.h` of lttng-modules 2.13.
"""

from __future__ import annotations

import struct
import uuid
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgflow.trace

TCP, UDP, ICMP = 6, 17, 1
SENT, RECEIVED = "net_dev_queue", "net_if_receive_skb"
NOISE = "sched_process_wait"
FREQUENCY = "power_cpu_frequency"
KHZ = 2_400_000

_COMMON = ["irq_softirq_raise", *(f"syscall_entry_{number}" for number in range(300))]
_CONTENT_BYTES = 200_000


@dataclass(frozen=True)
class Header:
    """Headers of a packet as they are on the wire.

    Attributes:
        source: IPv4 address with dots, or the eight groups of an IPv6 address with colons.
        destination: likewise.
        protocol: TCP, UDP or another number.
        ports: of source and destination.
        identification: of the datagram; IPv6 has none.
        fragment: flags and offset.
        sequence: TCP.
        acknowledgement: TCP.
        length: of the payload in bytes.
        checksum: of the transport header.
    """

    source: str = "10.0.0.1"
    destination: str = "10.0.0.2"
    protocol: int = UDP
    ports: tuple[int, int] = (7411, 7411)
    identification: int = 1
    fragment: int = 0x4000
    sequence: int = 0
    acknowledgement: int = 0
    length: int = 100
    checksum: int = 0

    def content(self) -> bytes:
        """Return the fields behind the name of the device."""
        transport = self._transport()
        kind = {TCP: 1, UDP: 2, ICMP: 3}.get(self.protocol, 0)
        size = len(transport) + self.length
        if ":" in self.source:
            groups = [
                int(group, 16)
                for address in (self.source, self.destination)
                for group in address.split(":")
            ]
            fixed = struct.pack(">IHBB16H", 6 << 28, size, self.protocol, 64, *groups)
            return b"\2" + fixed + bytes([kind]) + transport
        addresses = [
            int(byte) for address in (self.source, self.destination) for byte in address.split(".")
        ]
        fixed = struct.pack(
            ">BBHHHBBH8B",
            0x45, 0, 20 + size, self.identification, self.fragment, 64, self.protocol, 0xBEEF,
            *addresses,
        )  # fmt: skip
        return b"\1" + fixed + bytes([kind]) + transport

    def _transport(self) -> bytes:
        if self.protocol == TCP:
            return struct.pack(
                ">HHIIHHHH",
                *self.ports, self.sequence, self.acknowledgement, 0x5018, 501, self.checksum, 0,
            )  # fmt: skip
        if self.protocol == UDP:
            return struct.pack(">HHHH", *self.ports, 8 + self.length, self.checksum)
        return struct.pack(">BBHI", 8, 0, 0, 0) if self.protocol == ICMP else b""


@dataclass(frozen=True)
class KernelEvent:
    """An event: time on the clock of the host [epoch ns], name, headers of a packet, device."""

    time_ns: int
    name: str
    header: Header | None = None
    device: str = "eth0"
    cpu: int = 0


@dataclass(frozen=True)
class KernelTrace:
    """What is recorded on a host.

    Attributes:
        hostname: of the host.
        clock_uuid: of its boot.
        offset_ns: where its clock shows 0 [epoch ns].
        events: in any order.
        with_network: whether the classes of network packets are declared.
        contexts: whether events carry the contexts vpid, vtid and procname.
    """

    hostname: str
    clock_uuid: uuid.UUID
    offset_ns: int
    events: Sequence[KernelEvent] = ()
    with_network: bool = True
    contexts: bool = False
    cpus: int = 2
    trace_uuid: uuid.UUID = field(default_factory=uuid.uuid4)


def kernel_trace_of(
    ust: Path, events: Iterable[KernelEvent], *, with_network: bool = True, contexts: bool = False
) -> KernelTrace:
    """Return a kernel trace of the boot that a user-space trace is of."""
    with msgflow.trace.open([ust]) as traces:
        (info,) = traces.traces
        assert info.hostname is not None
        assert info.clock_uuid is not None
        return KernelTrace(
            info.hostname,
            uuid.UUID(info.clock_uuid),
            info.clock_offset_ns,
            tuple(events),
            with_network=with_network,
            contexts=contexts,
        )


def write_kernel_trace(directory: Path, trace: KernelTrace) -> Path:
    """Write it, one stream file per CPU, and return the directory."""
    directory.mkdir(parents=True)
    (directory / "metadata").write_text(_metadata(trace), encoding="utf-8")
    names = _names(trace)
    for cpu in range(trace.cpus):
        events = sorted(
            (event for event in trace.events if event.cpu % trace.cpus == cpu),
            key=lambda event: event.time_ns,
        )
        data = b""
        begin: int | None = None
        for sequence, records in enumerate(_split(events, names, trace)):
            first, last = records[0][0], records[-1][0]
            content = b"".join(record for _, record in records)
            begin = first if begin is None else begin
            data += _packet(
                trace,
                (begin - trace.offset_ns, last - trace.offset_ns),
                (sequence, cpu),
                content,
            )
            begin = last
        (directory / f"kchan_{cpu}").write_bytes(data)
    return directory


def _names(trace: KernelTrace) -> list[str]:
    network = [SENT, RECEIVED, "net_if_rx"] if trace.with_network else []
    return [*_COMMON, NOISE, *network, FREQUENCY]


def _split(
    events: Sequence[KernelEvent], names: Sequence[str], trace: KernelTrace
) -> Iterable[list[tuple[int, bytes]]]:
    part: list[tuple[int, bytes]] = []
    size = 0
    latest = 0
    for event in events:
        cycles, place = event.time_ns - trace.offset_ns, names.index(event.name)
        head = struct.pack("<HI", place, cycles & 0xFFFFFFFF)
        if cycles - latest >= 1 << 32:
            head = struct.pack("<HIQ", 65535, place, cycles)
        record = head + _body(event, trace)
        latest = cycles
        if size + len(record) > _CONTENT_BYTES:
            yield part
            part, size = [], 0
        part.append((event.time_ns, record))
        size += len(record)
    if part:
        yield part


def _body(event: KernelEvent, trace: KernelTrace) -> bytes:
    head = b""
    if trace.contexts:
        head = struct.pack("<ii17s", 4242, 4243, b"swapper/0")
    if event.name == NOISE:
        return head + struct.pack("<16siiq16sii", b"swapper", 0, 20, 0, b"ros", 7, 20)
    if event.name == FREQUENCY:
        return head + struct.pack("<II", KHZ, event.cpu + 1)
    if event.name in {SENT, RECEIVED, "net_if_rx"}:
        size = 0 if event.header is None else event.header.length + 28
        network = b"\0" if event.header is None else event.header.content()
        head += struct.pack("<QI", 0xFFFF888012345678, size)
        return head + event.device.encode() + b"\0" + network
    return head + struct.pack("<i", 5)


def _packet(
    trace: KernelTrace, span: tuple[int, int], place: tuple[int, int], content: bytes
) -> bytes:
    sequence, cpu = place
    bits = (84 + len(content)) * 8
    size = -(-(84 + len(content)) // 4096) * 4096
    head = struct.pack("<I16sIQ", 0xC1FC1FC1, trace.trace_uuid.bytes, 0, cpu)
    head += struct.pack("<QQQQQQI", *span, bits, size * 8, sequence, 0, cpu)
    return (head + content).ljust(size, b"\0")


def _integer(
    size: int, *, align: int = 8, signed: int = 0, base: int = 10, big: bool = False
) -> str:
    order = " byte_order = be;" if big else ""
    return (
        f"integer {{ size = {size}; align = {align}; signed = {signed};"
        f" encoding = none; base = {base};{order} }}"
    )


def _struct(members: Sequence[str]) -> str:
    return "struct {\n" + "".join(f"\t\t\t{member};\n" for member in members) + "\t\t}"


def _network_fields() -> str:
    def big(size: int, name: str, *, align: int = 8, base: int = 10) -> str:
        return f"{_integer(size, align=align, base=base, big=True)} _{name}"

    protocol = (
        f"enum : {_integer(8, big=True)} {{"
        ' "_unknown" = 0, "_icmp" = 1, "_unknown" = 2 ... 5, "_tcp" = 6, "_unknown" = 7 ... 16,'
        ' "_udp" = 17, "_unknown" = 18 ... 255, }'
    )
    transport_type = (
        f"enum : {_integer(8)} {{"
        ' "_unknown" = 0, "_tcp" = 1, "_udp" = 2, "_icmp" = 3, } _transport_header_type'
    )
    tcp = [
        big(16, "source_port"), big(16, "dest_port"), big(32, "seq"), big(32, "ack_seq"),
        big(4, "data_offset", align=4), big(3, "reserved", align=1),
        big(9, "flags", align=1, base=16), big(16, "window_size"),
        big(16, "checksum", base=16), big(16, "urg_ptr"),
    ]  # fmt: skip
    udp = [big(16, "source_port"), big(16, "dest_port"), big(16, "len"), big(16, "check")]
    icmp = [big(8, "type"), big(8, "code"), big(16, "checksum"), big(32, "gateway")]
    transport = (
        "variant <_transport_header_type> {\n"
        f"{_struct([])} _unknown;\n{_struct(tcp)} _tcp;\n{_struct(udp)} _udp;\n"
        f"{_struct(icmp)} _icmp;\n}} _transport_header"
    )
    ipv4 = [
        big(4, "version", align=4), big(4, "ihl", align=4), big(8, "tos"), big(16, "tot_len"),
        big(16, "id", base=16), big(16, "frag_off"), big(8, "ttl"), f"{protocol} _protocol",
        big(16, "checksum", base=16), big(8, "saddr") + "[4]", big(8, "daddr") + "[4]",
        transport_type, transport,
    ]  # fmt: skip
    ipv6 = [
        big(4, "version", align=4), big(4, "prio", align=4), big(8, "flow_lbl", base=16) + "[3]",
        big(16, "payload_len"), f"{protocol} _nexthdr", big(8, "hop_limit"),
        big(16, "saddr", base=16) + "[8]", big(16, "daddr", base=16) + "[8]",
        transport_type, transport,
    ]  # fmt: skip
    network = (
        "variant <_network_header_type> {\n"
        f"{_struct([])} _unknown;\n{_struct(ipv4)} _ipv4;\n{_struct(ipv6)} _ipv6;\n"
        "} _network_header"
    )
    return _struct(
        [
            f"{_integer(64, base=16)} _skbaddr",
            f"{_integer(32)} _len",
            "string _name",
            f'enum : {_integer(8)} {{ "_unknown" = 0, "_ipv4" = 1, "_ipv6" = 2, }}'
            " _network_header_type",
            network,
        ]
    )


def _metadata(trace: KernelTrace) -> str:
    text = "integer { size = 8; align = 8; signed = 1; encoding = UTF8; base = 10; }"
    number = _integer(32, signed=1)
    switch = _struct(
        [
            f"{text} _prev_comm[16]", f"{number} _prev_tid", f"{number} _prev_prio",
            f"{_integer(64, signed=1)} _prev_state", f"{text} _next_comm[16]",
            f"{number} _next_tid", f"{number} _next_prio",
        ]
    )  # fmt: skip
    network = _network_fields()
    fields = {NOISE: switch, SENT: network, RECEIVED: network, "net_if_rx": network}
    fields[FREQUENCY] = _struct([f"{_integer(32)} _state", f"{_integer(32)} _cpu_id"])
    other = _struct([f"{number} _value"])
    events = "".join(
        f'event {{\n\tname = "{name}";\n\tid = {place};\n\tstream_id = 0;\n'
        f"\tfields := {fields.get(name, other)};\n}};\n\n"
        for place, name in enumerate(_names(trace))
    )
    contexts = [f"{number} _vpid", f"{number} _vtid", f"{text} _procname[17]"]
    context = f"\tevent.context := {_struct(contexts)};\n" if trace.contexts else ""
    return f"""/* CTF 1.8 */

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
	uuid = "{trace.trace_uuid}";
	byte_order = le;
	packet.header := struct {{
		uint32_t magic;
		uint8_t  uuid[16];
		uint32_t stream_id;
		uint64_t stream_instance_id;
	}};
}};

env {{
	hostname = "{trace.hostname}";
	domain = "kernel";
	sysname = "Linux";
	kernel_release = "6.8.0-45-generic";
	kernel_version = "#45-Ubuntu SMP PREEMPT_DYNAMIC";
	tracer_name = "lttng-modules";
	tracer_major = 2;
	tracer_minor = 13;
	tracer_patchlevel = 12;
	trace_buffering_scheme = "global";
	trace_name = "robot";
	trace_creation_datetime = "20250314T092653+0000";
	product_uuid = "";
}};

clock {{
	name = "monotonic";
	uuid = "{trace.clock_uuid}";
	description = "Monotonic Clock";
	freq = 1000000000; /* Frequency, in Hz */
	/* clock value offset from Epoch is: offset * (1/freq) */
	offset = {trace.offset_ns};
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
{context}}};

{events}"""
