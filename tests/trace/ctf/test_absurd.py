"""Values that make no sense: dropped and told, and nothing else is lost."""

from __future__ import annotations

import os
import re
import struct
import time
from pathlib import Path
from typing import Any

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_index, write_trace
from support.same_batches import read
from support.thorough import few

import msgflow.trace
from msgflow.errors import TraceError
from msgflow.trace import PACKET
from msgflow.trace.ctf import json_metadata, tsdl
from msgflow.trace.ctf.declarations import LATEST_NS, Clock
from msgflow.trace.ctf.field_types import MetadataError
from msgflow.trace.ctf.reader import read_metadata

EVENTS, PACKETS, HEADER, EVENT = 50, 10, 84, 10 + 25 + 8
BEGIN = "trace { major = 1; minor = 8; byte_order = le; };"
DAY = 86_400 * 10**9


def content(**more: Any) -> TraceContent:
    """Ten packets of fifty events."""
    packets = [
        Packet([Event(n * 100 + i, "ros2:x", (n,)) for i in range(EVENTS)], sequence=n)
        for n in range(PACKETS)
    ]
    return TraceContent({"ros2:x": {"n": "u64"}}, {0: packets}, **more)


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    return write_trace(tmp_path / "trace", content())


def put(trace: Path, packet: int, at: int, value: int) -> None:
    """Write eight bytes into a packet."""
    stream = trace / "channel_0"
    data = bytearray(stream.read_bytes())
    struct.pack_into("<Q", data, packet * (len(data) // PACKETS) + at, value)
    stream.write_bytes(data)


def messages(trace: Path) -> list[str]:
    return [damage.message for damage in read(trace).damages]


class TestEventTimes:
    @pytest.mark.parametrize("value", [(1 << 64) - 1, 1 << 63, 1 << 62, 501 + 450 + DAY])
    @pytest.mark.parametrize("batch_rows", [100, 100_000])
    def test_far_from_the_packet(self, trace: Path, value: int, batch_rows: int) -> None:
        """Only that event is left out."""
        put(trace, 5, HEADER + 20 * EVENT + 2, value)
        found = read(trace, batch_rows=batch_rows)
        (damage,) = found.damages
        assert damage.message == "an event with a time that makes no sense: left out"
        assert (damage.position, damage.offset) == (5, 5 * (HEADER + 50 * EVENT) + 904 + 40)
        assert sum(found.event_counts.values()) == EVENTS * PACKETS - 1
        assert [row[9] for row in found.rows[PACKET]] == [50] * 5 + [49] + [50] * 4

    def test_within_a_day_they_stay(self, trace: Path) -> None:
        put(trace, 5, HEADER + 49 * EVENT + 2, 549 + DAY)
        found = read(trace)
        assert [d.message for d in found.damages] == [
            "an event is later than the end of its packet"
        ]
        assert sum(found.event_counts.values()) == EVENTS * PACKETS

    def test_early_ones(self, tmp_path: Path) -> None:
        events = [Event(3 * DAY + n, "ros2:x") for n in range(5)]
        trace = write_trace(tmp_path / "trace", TraceContent({"ros2:x": {}}, {0: [Packet(events)]}))
        stream = trace / "channel_0"
        data = bytearray(stream.read_bytes())
        size = (len(data) - HEADER) // 5
        for place in (1, 2):
            struct.pack_into("<Q", data, HEADER + place * size + 2, 2 * DAY - 1)
        stream.write_bytes(data)
        found = read(trace)
        assert [d.message for d in found.damages] == [
            "2 events with a time that makes no sense: left out"
        ]
        assert sum(found.event_counts.values()) == 3

    def test_in_packets_that_wait(self, tmp_path: Path) -> None:
        """Packets of two streams overlap: they are looked at twice, and told once."""
        streams = {
            cpu: [
                Packet([Event(n * 1000 + 2 * i + cpu, "ros2:x", (n,)) for i in range(500)], cpu=cpu)
                for n in range(10)
            ]
            for cpu in (0, 1)
        }
        trace = write_trace(tmp_path / "t", TraceContent({"ros2:x": {"n": "u64"}}, streams))
        put(trace, 5, HEADER + 20 * EVENT + 2, 1 << 63)
        found = read(trace, batch_rows=100)
        assert len(found.damages) == 1
        assert sum(found.event_counts.values()) == 9_999


class TestPacketTimes:
    @pytest.mark.parametrize("value", [1 << 63, LATEST_NS, LATEST_NS - 1_700_000_000 * 10**9])
    def test_that_are_too_late(self, trace: Path, value: int) -> None:
        put(trace, 9, 40, value)
        assert messages(trace) == ["the time of the packet makes no sense"]

    def test_the_last_one_that_makes_sense(self, trace: Path) -> None:
        put(trace, 9, 40, LATEST_NS - 1_700_000_000 * 10**9 - 1)
        assert messages(trace) == []


class TestClocks:
    @pytest.mark.parametrize("seconds", [1 << 62, -(1 << 62), 10**40, 4_611_686_019])
    def test_absurd_offset_counts_from_zero(self, tmp_path: Path, seconds: int) -> None:
        trace = write_trace(tmp_path / "trace", content(offset_seconds=seconds))
        found = read(trace)
        assert [d.message for d in found.damages] == [
            "the offset of the clock 'monotonic' makes no sense: its times count from 0"
        ]
        assert found.damages[0].file == trace / "metadata"
        assert found.traces[0].clock_offset_ns == 0
        assert found.rows["ros2:x"][0][1] == 0

    def test_the_largest_offset(self, tmp_path: Path) -> None:
        trace = write_trace(tmp_path / "trace", content(offset_seconds=4_611_686_017))
        assert messages(trace) == []

    @pytest.mark.parametrize("frequency", [0, -1, 1 << 63])
    def test_absurd_frequency(self, frequency: int) -> None:
        with pytest.raises(MetadataError, match=f"a clock of {frequency} Hz makes no sense"):
            tsdl.parse(f"{BEGIN} clock {{ freq = {frequency}; }};")

    @pytest.mark.parametrize("frequency", [1, 999, 10**9, 9 * 10**9, 10**12, (1 << 63) - 1])
    def test_all_frequencies_are_exact(self, frequency: int) -> None:
        import numpy as np

        clock = Clock(frequency, offset_seconds=-3, offset_cycles=7)
        values = [0, 1, 999_999, 123_456_789_012, 1 << 32]
        found = clock.to_ns_array(np.array(values, np.uint64)).tolist()
        wrapped = [(clock.to_ns(value) + (1 << 63)) % (1 << 64) - (1 << 63) for value in values]
        assert found == wrapped

    def test_limits(self) -> None:
        for frequency in (1000, 10**9, 3_333_333_333):
            clock = Clock(frequency, offset_seconds=-4_611_686_100, offset_cycles=-5)
            first, last = clock.limits
            assert clock.to_ns(first - 1) <= -LATEST_NS < clock.to_ns(first)
            assert clock.to_ns(last) < LATEST_NS <= clock.to_ns(last + 1) or last == (1 << 64) - 1


class TestCounters:
    def test_of_lost_events(self, trace: Path) -> None:
        put(trace, 5, 72, (1 << 64) - 5)
        found = read(trace)
        assert [d.message for d in found.damages] == [
            f"the counter of lost events makes no sense: {(1 << 64) - 5}"
        ]
        assert [row[10] for row in found.rows[PACKET]] == [0] * 5 + [None] + [0] * 4

    def test_the_most_that_may_be_lost(self, trace: Path) -> None:
        put(trace, 9, 72, 1 << 48)
        found = read(trace)
        assert not found.damages
        assert found.rows[PACKET][9][10] == 1 << 48

    def test_of_packets(self, trace: Path) -> None:
        put(trace, 5, 64, 1 << 63)
        found = read(trace)
        assert [d.message for d in found.damages] == [
            f"the number {1 << 63} of the packet makes no sense"
        ]
        assert [row[11] for row in found.rows[PACKET]] == [0] * 10

    def test_cpu(self, trace: Path) -> None:
        stream = trace / "channel_0"
        data = bytearray(stream.read_bytes())
        struct.pack_into("<I", data, 80, 1 << 31)
        stream.write_bytes(data)
        found = read(trace)
        assert [d.message for d in found.damages] == [f"there is no CPU {1 << 31}: left out"]
        assert [row[4] for row in found.rows[PACKET]] == [None] + [0] * 9


class TestMetadata:
    @pytest.mark.parametrize(
        "event_id", ["-1", "18446744073709551616", "9" * 5000, "0x" + "f" * 99]
    )
    def test_event_that_cannot_occur(self, trace: Path, event_id: str) -> None:
        text = (trace / "metadata").read_text()
        more = f'event {{ name = "odd"; id = {event_id}; stream_id = 0; fields := struct {{ }}; }};'
        (trace / "metadata").write_text(text + more)
        found = read(trace)
        assert sum(found.event_counts.values()) == EVENTS * PACKETS
        assert len(found.damages) == (event_id != "-1")
        assert all("'odd': left out" in d.message for d in found.damages)

    def test_event_that_cannot_occur_among_many_ids(self, trace: Path) -> None:
        text = (trace / "metadata").read_text()
        odd = 'event { name = "odd"; id = 18446744073709551615; stream_id = 0; };'
        (trace / "metadata").write_text(text + odd + odd.replace("18446744073709551615", "-7"))
        assert sum(read(trace).event_counts.values()) == EVENTS * PACKETS

    def test_long_numbers_are_no_matter(self) -> None:
        declared = tsdl.parse(f"{BEGIN} env {{ a = {'9' * 5000}; b = -{'9' * 40}; }};")
        assert declared.environment == {"a": 1 << 80, "b": -(1 << 80)}
        assert tsdl.parse(f"{BEGIN} env {{ a = {'0' * 5000}9; }};").environment == {"a": 9}

    @pytest.mark.parametrize("digits", ["9" * 5000, "0x" + "f" * 5000, "0b" + "1" * 20_000])
    def test_long_numbers_where_they_matter(self, tmp_path: Path, digits: str) -> None:
        text = f"{BEGIN} event {{ fields := struct {{ string a[{digits}]; }}; }};"
        (tmp_path / "metadata").write_text("/* CTF 1.8 */" + text)
        with pytest.raises(TraceError, match="makes no sense"):
            read_metadata(tmp_path)

    def test_long_numbers_in_json(self) -> None:
        numbers = f'{{"a": {"9" * 5000}, "b": -{"9" * 5000}}}'
        declared = json_metadata.parse(f'\x1e{{"type": "trace-class", "environment": {numbers}}}')
        assert declared.environment == {"a": 1 << 80, "b": -(1 << 80)}

    def test_halves_of_characters_in_json(self) -> None:
        declared = json_metadata.parse(
            '\x1e{"type": "trace-class", "environment": {"hostname": "a\\ud800b"}}'
        )
        assert declared.environment == {"hostname": "a\N{REPLACEMENT CHARACTER}b"}

    def test_character_constants(self) -> None:
        assert tsdl.parse(f"{BEGIN} env {{ a = 'b'; c = ''; }};").environment == {"a": 98, "c": 0}
        with pytest.raises(MetadataError, match="line 1: 'ab' is more than one character"):
            tsdl.parse(f"{BEGIN} env {{ a = 'ab'; }};")

    def test_signed_bytes_of_a_uuid(self, tmp_path: Path) -> None:
        """With a header that is read field by field."""
        import uuid

        trace = write_trace(
            tmp_path / "trace",
            content(trace_uuid=uuid.UUID("ff" * 16)),
        )
        text = (trace / "metadata").read_text()
        signed = "integer { size = 8; align = 8; signed = true; } uuid[16];"
        text = text.replace("uint8_t uuid[16];", signed)
        # A sequence without elements makes the size of the header one that varies.
        text = text.replace("uint32_t stream_id;", "uint32_t stream_id; uint8_t more[0];")
        (trace / "metadata").write_text(text)
        assert not read(trace).damages

    @pytest.mark.parametrize("field", ["uint32_t uuid", "uint8_t magic[4]"])
    def test_fields_that_cannot_be_what_their_name_says(self, tmp_path: Path, field: str) -> None:
        trace = write_trace(tmp_path / "trace", content())
        text = (trace / "metadata").read_text()
        start = text.index("packet.header")
        name = field.split()[1].partition("[")[0]
        before = {"uuid": "uint8_t uuid[16]", "magic": "uint32_t magic"}[name]
        rest = text[start:].replace(
            before, field + ("; uint8_t x[12]" if name == "uuid" else ""), 1
        )
        (trace / "metadata").write_text(text[:start] + rest)
        assert sum(read(trace).event_counts.values()) == EVENTS * PACKETS


class TestShapes:
    @pytest.mark.parametrize(
        "field", ["_zz" + "[1000]" * 20, "_zz" + "[60000]" * 3, "_zz[4096]" + "[4096]" * 2]
    )
    @pytest.mark.parametrize(
        "element", few(["uint8_t", "struct { }", "integer { size = 3; }"], "struct { }")
    )
    def test_arrays_of_arrays(self, trace: Path, field: str, element: str) -> None:
        """They do not fit into any packet, which is found without going through them."""
        text = (trace / "metadata").read_text()
        begun = time.monotonic()
        (trace / "metadata").write_text(re.sub(r"integer [^}]*} _n;", f"{element} {field};", text))
        found = read(trace)
        assert time.monotonic() - begun < 10
        assert len(found.damages) == PACKETS
        assert not found.event_counts

    def test_header_of_gigabytes(self, trace: Path) -> None:
        text = (trace / "metadata").read_text()
        (trace / "metadata").write_text(text.replace("uuid[16]", "uuid[4294967295]"))
        with pytest.raises(TraceError, match=r"headers of packets have .* bytes — .*trace"):
            read(trace)

    def test_aliases_of_aliases(self, tmp_path: Path) -> None:
        def alias(number: int) -> str:
            inner = f'"t{number - 1}"' if number else '{"type": "null-terminated-string"}'
            members = ", ".join(f'{{"name": "{n}", "field-class": {inner}}}' for n in "ab")
            return (
                f'\x1e{{"type": "field-class-alias", "name": "t{number}", "field-class": '
                f'{{"type": "structure", "member-classes": [{members}]}}}}'
            )

        text = '\x1e{"type": "preamble", "version": 2}' + "".join(map(alias, range(40)))
        text += '\x1e{"type": "data-stream-class", "packet-context-field-class": "t39"}'
        (tmp_path / "metadata").write_text(text)
        with pytest.raises(TraceError, match="more than 100000 fields"):
            read_metadata(tmp_path)

    def test_depth(self, tmp_path: Path) -> None:
        for depth, is_read in ((30, True), (31, False)):
            text = f"{BEGIN} event {{ fields := struct {{ string a{'[1]' * depth}; }}; }};"
            (tmp_path / "metadata").write_text("/* CTF 1.8 */" + text)
            if is_read:
                read_metadata(tmp_path)
            else:
                with pytest.raises(TraceError, match="too deeply nested"):
                    read_metadata(tmp_path)


class TestFiles:
    """Files that are no files, or longer than they can be."""

    def test_pipe_in_place_of_metadata(self, trace: Path) -> None:
        (trace / "metadata").unlink()
        os.mkfifo(trace / "metadata")
        with pytest.raises(TraceError, match=r"a pipe, no file. — .*/metadata") as caught:
            msgflow.trace.open([trace])
        assert caught.value.hint is not None
        assert "cp -rL" in caught.value.hint

    def test_device_in_place_of_metadata(self, trace: Path) -> None:
        (trace / "metadata").unlink()
        (trace / "metadata").symlink_to("/dev/zero")
        with pytest.raises(TraceError, match=r"a device, no file"):
            msgflow.trace.open([trace])

    def test_sparse_metadata(self, trace: Path) -> None:
        os.truncate(trace / "metadata", 1 << 40)
        with pytest.raises(TraceError, match=r"1,099,511,627,776 bytes, more than"):
            msgflow.trace.open([trace])

    def test_links_in_a_circle(self, trace: Path) -> None:
        (trace / "metadata").unlink()
        (trace / "metadata").symlink_to(trace / "metadata")
        with pytest.raises(TraceError, match="Too many levels") as caught:
            msgflow.trace.open([trace])
        assert caught.value.hint is not None
        assert "cp -rL" in caught.value.hint
        with pytest.raises(TraceError, match="a link in a circle"):
            msgflow.trace.open([trace / "metadata"])

    def test_irregular_streams_are_told(self, trace: Path) -> None:
        os.mkfifo(trace / "channel_1")
        (trace / "channel_2").symlink_to("/dev/zero")
        (trace / "channel_3").symlink_to("nowhere")
        (trace / "channel_4").symlink_to("channel_4")
        found = read(trace)
        assert [(d.file.name, d.message) for d in found.damages] == [
            ("channel_1", "a pipe, no file: left out"),
            ("channel_2", "a device, no file: left out"),
            ("channel_3", "a link that leads nowhere, no file: left out"),
            ("channel_4", "a link in a circle, no file: left out"),
        ]
        assert sum(found.event_counts.values()) == EVENTS * PACKETS

    @pytest.mark.parametrize("kind", ["pipe", "sparse"])
    def test_index_that_is_none(self, trace: Path, kind: str) -> None:
        packets = content().streams[0]
        write_index(trace, 0, packets)
        path = trace / "index" / "channel_0.idx"
        if kind == "sparse":
            os.truncate(path, 1 << 40)
        else:
            path.unlink()
            os.mkfifo(path)
        found = read(trace)
        (damage,) = found.damages
        assert damage.file == path
        assert damage.message.startswith("the index is not used: ")
        assert sum(found.event_counts.values()) == EVENTS * PACKETS

    def test_missing_stream_of_an_index(self, trace: Path) -> None:
        write_index(trace, 0, content().streams[0])
        (trace / "index" / "channel_0.idx").rename(trace / "index" / "channel_7.idx")
        found = read(trace)
        assert [d.message for d in found.damages] == [
            "the stream channel_7 is missing, only its index is there"
        ]

    def test_sparse_end_of_a_stream(self, trace: Path) -> None:
        """Terabytes of nothing take no time."""
        os.truncate(trace / "channel_0", 1 << 42)
        begun = time.monotonic()
        found = read(trace)
        assert time.monotonic() - begun < 10
        assert [d.position for d in found.damages] == [PACKETS]
        assert sum(found.event_counts.values()) == EVENTS * PACKETS

    def test_hole_in_a_packet(self, trace: Path) -> None:
        size = 1 << 28
        put(trace, 9, 48, size * 8)
        put(trace, 9, 56, size * 8)
        whole = (trace / "channel_0").stat().st_size
        os.truncate(trace / "channel_0", whole - whole // PACKETS + size)
        found = read(trace)
        assert found.damages[0].message.startswith("the file has a hole within this packet")
        assert sum(found.event_counts.values()) >= EVENTS * PACKETS

    def test_packet_of_more_than_a_gigabyte(self, trace: Path) -> None:
        size = (1 << 30) + 8
        put(trace, 9, 48, size * 8)
        put(trace, 9, 56, size * 8)
        os.truncate(trace / "channel_0", 2 << 30)
        assert messages(trace)[0] == f"a packet of {size:,} bytes is too large to be read"
