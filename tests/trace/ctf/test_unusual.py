"""Valid traces that are not like LTTng's: read as bt2 reads them, or better."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import pytest
from support.bit_writer import BitWriter
from support.ctf_writer import Event, Packet, TraceContent, write_trace
from support.same_batches import differences, read
from support.thorough import few

from msgflow.trace import PACKET

CLOCK = "clock { name = monotonic; freq = 1000000000; offset = 1600000000000000000; };"
TYPES = """
    typealias integer { size = 8; align = 8; } := uint8_t;
    typealias integer { size = 16; align = 8; } := uint16_t;
    typealias integer { size = 32; align = 8; } := uint32_t;
    typealias integer { size = 64; align = 8; } := uint64_t;
"""
TIME = "map = clock.monotonic.value;"
TIMES = f"""
    typealias integer {{ size = 16; align = 8; {TIME} }} := time16_t;
    typealias integer {{ size = 64; align = 8; {TIME} }} := time_t;
"""


def write(directory: Path, metadata: str, **files: bytes) -> Path:
    directory.mkdir()
    (directory / "metadata").write_text("/* CTF 1.8 */\n" + metadata)
    for name, content in files.items():
        (directory / name).write_bytes(content)
    return directory


def assert_as_bt2(path: Path, bt2_bindings: Any, events: int) -> None:
    ours = read(path)
    assert not ours.damages
    assert sum(ours.event_counts.values()) == events
    assert not differences(ours, read(path, reader="bt2"))


def test_events_at_any_bit(tmp_path: Path, bt2_bindings: Any) -> None:
    metadata = f"""
        trace {{ major = 1; minor = 8; byte_order = le; }};
        {CLOCK} {TYPES}
        stream {{
            packet.context := struct {{
                uint64_t timestamp_begin; uint64_t timestamp_end; uint32_t content_size;
                uint32_t packet_size; }};
            event.header := struct {{
                integer {{ size = 3; align = 1; }} id;
                integer {{ size = 13; align = 1; {TIME} }} timestamp; }};
        }};
        event {{ id = 0; name = "a"; fields := struct {{
            integer {{ size = 5; align = 1; }} _five; }}; }};
        event {{ id = 6; name = "b"; fields := struct {{
            integer {{ size = 1; align = 1; }} _one; string _text; }}; }};
    """
    writer = BitWriter()
    for value, size in ((0, 64), (60_000, 64), (0, 32), (0, 32)):
        writer.integer(value, size, 8, False)
    for number in range(30):
        writer.integer(6 if number % 3 == 0 else 0, 3, 1, False)
        writer.integer(number * 2000 % (1 << 13), 13, 1, False)
        if number % 3 == 0:
            # A structure is aligned as its member that is aligned most.
            writer.align(8)
            writer.integer(1, 1, 1, False)
            writer.bytes(b"text" * (number % 2) + b"\0")
        else:
            writer.integer(number, 5, 1, False)
    content = writer.content()
    struct.pack_into("<II", content, 16, writer.position, len(content) * 8)
    path = write(tmp_path / "trace", metadata, stream=bytes(content))
    assert_as_bt2(path, bt2_bindings, 30)


def test_two_stream_classes(tmp_path: Path, bt2_bindings: Any) -> None:
    streams = "\n".join(
        f"""stream {{ id = {number};
            packet.context := struct {{ time_t timestamp_begin; time_t timestamp_end;
                uint32_t content_size; uint32_t packet_size; }};
            event.header := struct {{ uint8_t id; time_t timestamp; }};
            event.context := struct {{ {context} }}; }};
        event {{ id = 1; stream_id = {number}; name = "x{number}";
            fields := struct {{ {fields} }}; }};"""
        for number, context, fields in ((0, "uint8_t _vpid;", "uint8_t _a;"), (5, "", "string _b;"))
    )
    metadata = f"""
        {TYPES}
        trace {{ major = 1; minor = 8; byte_order = be;
            packet.header := struct {{ uint32_t magic; uint32_t stream_id; }}; }};
        {CLOCK} {TIMES} {streams}
    """

    def stream(class_id: int, event: bytes, packets: int) -> bytes:
        content = b""
        for begin in range(0, packets * 1000, 1000):
            times = range(begin, begin + 600, 10)
            events = b"".join(struct.pack(">BQ", 1, t + class_id) + event for t in times)
            bits = (32 + len(events)) * 8
            span = (begin, begin + 999)
            content += struct.pack(">IIQQII", 0xC1FC1FC1, class_id, *span, bits, bits) + events
        return content

    path = write(
        tmp_path / "trace",
        metadata,
        b=stream(5, b"text\0", 2),
        a=stream(0, b"\x07\x08", 60),
    )
    assert_as_bt2(path, bt2_bindings, 60 * 62)


def test_packets_that_say_nothing_of_time(tmp_path: Path, bt2_bindings: Any) -> None:
    """The clock goes on from packet to packet."""
    metadata = f"""
        {TYPES}
        trace {{ major = 1; minor = 8; byte_order = le; }};
        {CLOCK} {TIMES}
        stream {{
            packet.context := struct {{ uint32_t content_size; uint32_t packet_size; }};
            event.header := struct {{ time16_t timestamp; }}; }};
        event {{ name = "only"; fields := struct {{ uint16_t _n; }}; }};
    """

    def stream(first: int) -> bytes:
        packets = b""
        for packet in range(5):
            times = [(first + packet * 100_000 + n * 30_000) % 65536 for n in range(3)]
            events = b"".join(struct.pack("<HH", t, n) for n, t in enumerate(times))
            packets += struct.pack("<II", (8 + len(events)) * 8, 800) + events.ljust(92, b"\0")
        return packets

    path = write(tmp_path / "trace", metadata, a=stream(7), b=stream(40_000))
    ours = read(path)
    assert [row[5] for row in ours.rows[PACKET]] == [0, 1, 2, 3, 4] * 2
    assert_as_bt2(path, bt2_bindings, 30)


def test_one_packet_without_any_header(tmp_path: Path, bt2_bindings: Any) -> None:
    metadata = f"""
        {TYPES}
        trace {{ major = 1; minor = 8; byte_order = le; }};
        {CLOCK} {TIMES}
        stream {{ event.header := struct {{ uint8_t id; time_t timestamp; }}; }};
        event {{ id = 3; name = "x"; fields := struct {{ uint8_t _n; }}; }};
    """
    content = b"".join(struct.pack("<BQB", 3, 5 * n, n) for n in range(100))
    assert_as_bt2(write(tmp_path / "trace", metadata, stream=content), bt2_bindings, 100)


def test_lengths_and_selectors_in_outer_structures(tmp_path: Path, bt2_bindings: Any) -> None:
    metadata = f"""
        {TYPES}
        trace {{ major = 1; minor = 8; byte_order = le; }};
        {CLOCK} {TIMES}
        stream {{
            packet.context := struct {{ time_t timestamp_begin; time_t timestamp_end;
                uint32_t content_size; uint32_t packet_size; uint8_t cpu_id; }};
            event.header := struct {{ uint8_t id; time_t timestamp; }};
            event.context := struct {{ uint8_t _count; }}; }};
        event {{ id = 0; name = "x"; fields := struct {{
            enum : uint8_t {{ A, B = 7 }} _tag;
            uint8_t _of_context[stream.event.context._count];
            uint8_t _of_packet[stream.packet.context.cpu_id];
            struct {{ variant <_tag> {{ uint8_t A; string B; }} _inner; }} _s;
            }}; }};
    """
    events = b"".join(
        struct.pack("<BQBB", 0, n, n % 3, 7 * (n % 2))
        + bytes(n % 3)
        + b"\1\2"
        + (b"text\0" if n % 2 else b"\7")
        for n in range(20)
    )
    bits = (25 + len(events)) * 8
    content = struct.pack("<QQIIB", 0, 100, bits, bits, 2) + events
    assert_as_bt2(write(tmp_path / "trace", metadata, stream=content), bt2_bindings, 20)


def packets(*begins: int) -> list[Packet]:
    return [
        Packet([Event(begin + n, "ros2:x") for n in range(3)], begin=begin, end=begin + 9)
        for begin in begins
    ]


def test_stream_in_several_files(tmp_path: Path, bt2_bindings: Any) -> None:
    """Files of limited size: the order of their names is not that of time."""
    parts = {name: packets(*begins) for name, begins in {"a": (40, 50), "b": (0, 10)}.items()}
    for name, content in parts.items():
        write_trace(tmp_path / name, TraceContent({"ros2:x": {}}, {0: content}))
    trace = tmp_path / "a"
    (tmp_path / "b" / "channel_0").rename(trace / "channel_0_1")
    (tmp_path / "b" / "metadata").unlink()
    assert_as_bt2(trace, bt2_bindings, 12)


def test_what_a_crash_leaves(tmp_path: Path, bt2_bindings: Any) -> None:
    content = [*packets(0), Packet([Event(20, "ros2:x")], begin=15, end=0)]
    trace = write_trace(tmp_path / "trace", TraceContent({"ros2:x": {}}, {0: content}))
    assert_as_bt2(trace, bt2_bindings, 4)


@pytest.mark.parametrize(("minor", "is_damage"), [(10, False), (11, True)])
def test_old_tracers_end_packets_too_early(tmp_path: Path, minor: int, is_damage: bool) -> None:
    environment = {"tracer_name": "lttng-ust", "tracer_major": 2, "tracer_minor": minor}
    content = [Packet([Event(5, "ros2:x"), Event(9, "ros2:x")], begin=1, end=7)]
    trace = write_trace(
        tmp_path / "trace", TraceContent({"ros2:x": {}}, {0: content}, environment=environment)
    )
    found = read(trace)
    assert bool(found.damages) is is_damage
    assert found.rows[PACKET][0][7] == found.rows["ros2:x"][-1][1]


def test_narrow_counter_of_lost_events_wraps_round(tmp_path: Path) -> None:
    content = [
        Packet([Event(1, "ros2:x")], discarded=(1 << 32) - 2),
        Packet([Event(2, "ros2:x")], discarded=3),
    ]
    trace = write_trace(tmp_path / "trace", TraceContent({"ros2:x": {}}, {0: content}))
    text = (trace / "metadata").read_text()
    narrow = text.replace("uint64_t events_discarded", "uint32_t events_discarded; uint32_t _rest")
    (trace / "metadata").write_text(narrow)
    assert [row[10] for row in read(trace).rows[PACKET]] == [(1 << 32) - 2, 5]


@pytest.mark.parametrize("batch_rows", few([1, 7, 1000], 7))
def test_long_packet_beside_short_ones(tmp_path: Path, batch_rows: int) -> None:
    """It stays in memory through many batches, and every event comes once and in order."""
    streams = {
        0: [Packet([Event(t, "ros2:x") for t in range(0, 100_000, 100)])],
        1: [Packet([Event(t + n, "ros2:x") for n in range(20)]) for t in range(0, 100_000, 50)],
    }
    trace = write_trace(tmp_path / "trace", TraceContent({"ros2:x": {}}, streams))
    content = read(trace, batch_rows=batch_rows)
    rows = content.rows["ros2:x"]
    assert [row[0] for row in rows] == list(range(1000 + 40_000))
    assert [row[1] for row in rows] == sorted(row[1] for row in rows)
    assert not content.damages


def test_words_that_no_reader_knows(tmp_path: Path, bt2_bindings: Any) -> None:
    """As in `warnings` of Babeltrace's own tests."""
    metadata = f"""
        {CLOCK} {TYPES}
        typealias integer {{ size = 32; align = 32; zz = aa; }} := odd_t;
        typealias integer {{ size = 8; align = 8; {TIME} }} := time8_t;
        trace {{ major = 1; minor = 8; byte_order = le; bb = "aa"; of_trace := struct {{ }}; }};
        stream {{
            packet.context := struct {{ odd_t content_size; odd_t packet_size; }};
            event.header := struct {{ time8_t timestamp; }};
            of_stream := struct {{ uint8_t one; }};
            other = 1;
        }};
        event {{
            name = string;
            fields := struct {{ string text; }};
            of_event := struct {{ uint8_t one; }};
        }};
    """
    content = b"\1one\0\2two\0"
    bits = (8 + len(content)) * 8
    path = write(tmp_path / "trace", metadata, stream=struct.pack("<II", bits, bits) + content)
    assert_as_bt2(path, bt2_bindings, 2)
