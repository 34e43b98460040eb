"""Damage is reported with its place; everything else is read."""

from __future__ import annotations

import struct
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_index, write_trace
from support.same_batches import Content, read

import msgflow.trace
from msgflow.errors import TraceError
from msgflow.trace import PACKET

EVENTS, PACKETS, HEADER = 50, 10, 84


@pytest.fixture
def packets() -> list[Packet]:
    return [
        Packet([Event(n * 100 + i, "ros2:x", (n,)) for i in range(EVENTS)], sequence=n)
        for n in range(PACKETS)
    ]


@pytest.fixture
def trace(tmp_path: Path, packets: list[Packet]) -> Path:
    """Ten packets of fifty events."""
    return write_trace(tmp_path / "trace", TraceContent({"ros2:x": {"n": "u64"}}, {0: packets}))


def change(trace: Path, edit: Callable[[bytearray], bytes | bytearray | None]) -> None:
    stream = trace / "channel_0"
    content = bytearray(stream.read_bytes())
    stream.write_bytes(edit(content) or content)


def packet_size(trace: Path) -> int:
    return (trace / "channel_0").stat().st_size // PACKETS


def told(content: Content) -> list[tuple[int, int, str]]:
    return [(damage.position, damage.offset, damage.message) for damage in content.damages]


def read_packets(content: Content) -> dict[int, int]:
    """Return for each packet that was read how many of its events were."""
    counts: dict[int, int] = {}
    for row in content.rows.get("ros2:x", []):
        counts[row[-1]] = counts.get(row[-1], 0) + 1
    return counts


def test_event_class_that_does_not_exist(trace: Path) -> None:
    """The packet is read up to there."""
    size = packet_size(trace)
    event = (size - HEADER) // EVENTS
    offset = 5 * size + HEADER + 20 * event
    change(trace, lambda content: struct.pack_into("<H", content, offset, 999))
    content = read(trace)
    assert told(content) == [(5, offset, "there is no event class 999")]
    assert content.damages[0].file == trace / "channel_0"
    assert content.damages[0].trace_index == 0
    assert read_packets(content) == {n: 20 if n == 5 else EVENTS for n in range(PACKETS)}
    assert [row[9] for row in content.rows[PACKET]] == [50] * 5 + [20] + [50] * 4


def test_strict_ends_there(trace: Path) -> None:
    size = packet_size(trace)
    change(trace, lambda content: struct.pack_into("<H", content, 5 * size + HEADER, 999))
    with msgflow.trace.open([trace], strict=True) as traces:
        with pytest.raises(TraceError, match=r"event class 999 — .*/channel_0, packet 5, offset"):
            list(traces.batches())
        assert not traces.damages


def test_strict_does_not_open(trace: Path) -> None:
    change(trace, lambda content: content[:-1])
    with pytest.raises(TraceError, match="cut off or is still being written"):
        msgflow.trace.open([trace], strict=True)


def test_stream_that_is_cut_off_or_still_grows(trace: Path) -> None:
    size = packet_size(trace)
    change(trace, lambda content: content[:-70])
    content = read(trace)
    ((position, offset, message),) = told(content)
    assert (position, offset) == (9, 9 * size)
    assert message.startswith("the file ends within this packet, it was cut off or is still being")
    found = read_packets(content)
    assert EVENTS - 20 < found.pop(9) < EVENTS
    assert found == dict.fromkeys(range(9), EVENTS)
    assert [row[10] for row in content.rows[PACKET]] == [0] * 9 + [None]


@pytest.mark.parametrize("size", [1, 40, 70, 83])
def test_stream_of_a_few_bytes(trace: Path, size: int) -> None:
    change(trace, lambda content: content[:size])
    content = read(trace)
    assert told(content) == [(0, 0, "the file ends within the header of a packet")]
    assert not content.rows


@pytest.mark.parametrize("field", [0, 20])
def test_packet_header_that_is_damaged(trace: Path, field: int) -> None:
    """Magic number and stream class: reading goes on at the next packet."""
    size = packet_size(trace)
    change(trace, lambda content: struct.pack_into("<I", content, 5 * size + field, 0xDEADBEEF))
    content = read(trace)
    ((position, offset, _),) = told(content)
    assert (position, offset) == (5, 5 * size)
    assert read_packets(content) == {n: EVENTS for n in range(PACKETS) if n != 5}


@pytest.mark.parametrize("at", [48, 56])
@pytest.mark.parametrize("bits", [0, 8, 1 << 20, (1 << 64) - 8, (1 << 64) - 1])
def test_sizes_that_make_no_sense(trace: Path, at: int, bits: int) -> None:
    size = packet_size(trace)
    read(trace)  # whatever is imported now is not counted
    tracemalloc.start()
    change(trace, lambda content: struct.pack_into("<Q", content, 5 * size + at, bits))
    content = read(trace)
    assert tracemalloc.get_traced_memory()[1] < 10_000_000
    tracemalloc.stop()
    assert [damage.position for damage in content.damages] == [5]
    assert read_packets(content) == {n: EVENTS for n in range(PACKETS) if n != 5}


def test_packet_that_claims_the_next_ones(trace: Path) -> None:
    size = packet_size(trace)
    change(trace, lambda content: struct.pack_into("<Q", content, 5 * size + 56, 3 * size * 8))
    content = read(trace)
    assert [damage.message for damage in content.damages] == [
        "another packet lies where this one says to be unused"
    ]
    assert read_packets(content) == dict.fromkeys(range(PACKETS), EVENTS)


def test_packet_that_ends_before_it_begins(trace: Path) -> None:
    size = packet_size(trace)
    change(trace, lambda content: struct.pack_into("<Q", content, 5 * size + 32, 1 << 50))
    content = read(trace)
    assert told(content) == [(5, 5 * size, "the packet ends before it begins")]


def test_packet_out_of_place(trace: Path) -> None:
    """Its neighbours agree with each other, so it is the one that is wrong."""
    size = packet_size(trace)
    change(trace, lambda content: struct.pack_into("<QQ", content, 5 * size + 32, 1 << 50, 1 << 51))
    content = read(trace)
    message = "the packet begins earlier or later than its neighbours"
    assert told(content) == [(5, 5 * size, message)]
    assert read_packets(content) == {n: EVENTS for n in range(PACKETS) if n != 5}


def test_event_later_than_its_packet(trace: Path) -> None:
    size = packet_size(trace)
    change(trace, lambda content: struct.pack_into("<Q", content, 5 * size + 40, 501))
    content = read(trace)
    assert told(content) == [(5, 5 * size, "an event is later than the end of its packet")]
    assert sum(read_packets(content).values()) == PACKETS * EVENTS


def test_time_that_runs_backward(trace: Path) -> None:
    size = packet_size(trace)
    event = (size - HEADER) // EVENTS
    at = 5 * size + HEADER + 3 * event + 2
    change(trace, lambda content: struct.pack_into("<Q", content, at, 7))
    content = read(trace)
    assert told(content) == [(5, 5 * size, "time runs backward in the packet")]
    assert [row[0] for row in content.rows["ros2:x"]] == list(range(PACKETS * EVENTS))


def test_length_of_a_sequence(tmp_path: Path) -> None:
    """No memory is taken for what a damaged length says."""
    events = [Event(n, "ros2:x", ([1, 2, 3],)) for n in range(20)]
    content = TraceContent({"ros2:x": {"subs": "u64[]"}}, {0: [Packet(events)]})
    trace = write_trace(tmp_path / "trace", content)
    event = ((trace / "channel_0").stat().st_size - HEADER) // 20
    at = HEADER + 11 * event - 28
    read(trace)  # whatever is imported now is not counted
    tracemalloc.start()
    change(trace, lambda content: struct.pack_into("<I", content, at, 0xFFFFFFFF))
    found = read(trace)
    assert tracemalloc.get_traced_memory()[1] < 10_000_000
    tracemalloc.stop()
    assert told(found) == [(0, HEADER + 10 * event, "a field goes beyond the end of the packet")]
    assert found.event_counts == {(0, "ros2:x"): 10}


def test_file_that_does_not_belong_there(trace: Path) -> None:
    (trace / "notes.txt").write_text("what I did that day" * 10)
    content = read(trace)
    (damage,) = content.damages
    assert damage.file == trace / "notes.txt"
    assert "no packet begins here" in damage.message
    assert sum(read_packets(content).values()) == PACKETS * EVENTS


def test_uuid_that_is_not_that_of_the_metadata(trace: Path) -> None:
    """Such a packet is read, as Babeltrace reads it."""
    size = packet_size(trace)
    change(trace, lambda content: struct.pack_into("<I", content, 5 * size + 4, 0xDEADBEEF))
    content = read(trace)
    ((position, offset, message),) = told(content)
    assert (position, offset) == (5, 5 * size)
    assert "another trace, efbeadde-2222-3333-4444-555555555555: read nevertheless" in message
    assert read_packets(content) == dict.fromkeys(range(PACKETS), EVENTS)


def test_metadata_of_another_trace(trace: Path) -> None:
    """It is reported once for a file; packets are found by the uuid that they have."""
    text = (trace / "metadata").read_text()
    (trace / "metadata").write_text(text.replace("11111111-", "11111112-"))
    size = packet_size(trace)
    change(trace, lambda content: struct.pack_into("<I", content, 5 * size, 0))
    content = read(trace)
    first, second = content.damages
    assert "belongs to another trace, 11111111-2222-3333-4444-555555555555" in first.message
    assert (first.position, second.position) == (0, 5)
    assert read_packets(content) == {n: EVENTS for n in range(PACKETS) if n != 5}


class TestIndex:
    def test_that_agrees(self, trace: Path, packets: list[Packet]) -> None:
        write_index(trace, 0, packets)
        assert not read(trace).damages

    def test_of_a_longer_file(self, trace: Path, packets: list[Packet]) -> None:
        """Cut off exactly between two packets, which only the index can tell."""
        write_index(trace, 0, packets)
        size = packet_size(trace)
        change(trace, lambda content: content[: 7 * size])
        assert told(read(trace)) == [(7, 7 * size, "the file ends before packets of its index")]

    def test_of_a_shorter_file(self, trace: Path, packets: list[Packet]) -> None:
        """The file has grown since."""
        write_index(trace, 0, packets)
        index = trace / "index" / "channel_0.idx"
        index.write_bytes(index.read_bytes()[: 16 + 72 * 4 + 5])
        assert not read(trace).damages

    def test_that_contradicts(self, trace: Path, packets: list[Packet]) -> None:
        write_index(trace, 0, packets)
        size = packet_size(trace)
        event = (size - HEADER) // EVENTS
        used = (size - event) * 8
        change(trace, lambda content: struct.pack_into("<Q", content, 5 * size + 48, used))
        content = read(trace)
        ((position, _, message),) = told(content)
        assert position == 5
        assert message.startswith("the index says that the packet's used size is")
        assert read_packets(content)[5] == EVENTS - 1

    def test_leads_on_after_a_damaged_header(self, trace: Path, packets: list[Packet]) -> None:
        write_index(trace, 0, packets)
        size = packet_size(trace)
        change(trace, lambda content: struct.pack_into("<16s", content, 5 * size, b""))
        assert read_packets(read(trace)) == {n: EVENTS for n in range(PACKETS) if n != 5}


def test_damages_are_told_again_by_the_next_reading(trace: Path) -> None:
    size = packet_size(trace)
    change(trace, lambda content: struct.pack_into("<H", content, 5 * size + HEADER, 999))
    change(trace, lambda content: content[:-1])
    with msgflow.trace.open([trace]) as traces:
        assert len(traces.damages) == 1
        list(traces.batches())
        first = list(traces.damages)
        list(traces.batches())
        assert traces.damages == first
        assert len(first) == 2


def test_file_that_shrinks_while_it_is_read(trace: Path) -> None:
    with msgflow.trace.open([trace]) as traces:
        change(trace, lambda content: content[:100])
        rows = sum(item.batch.num_rows for item in traces.batches() if item.name != PACKET)
        assert rows == 0
        assert {damage.message for damage in traces.damages} == {
            "the file has become shorter, the packet is gone"
        }
