"""What is known of packets, and of what was lost."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_index, write_trace

from msgflow.trace import PACKET, TraceSet
from msgflow.trace.columns import PACKET_SCHEMA

Rows = dict[str, list[dict[str, Any]]]
Open = Callable[..., TraceSet]
Read = Callable[..., Rows]

EPOCH = 1_700_000_000_000_000_000


def events(*times: int) -> list[Event]:
    return [Event(time, "ros2:x") for time in times]


def write(path: Path, *packets: Packet, **more: Any) -> Path:
    return write_trace(path, TraceContent({"ros2:x": {}}, {0: packets}, **more))


def column(rows: Rows, name: str) -> list[Any]:
    return [row[name] for row in rows[PACKET]]


def test_every_column(tmp_path: Path, open_traces: Open, reader: str) -> None:
    packets = [Packet(events(12, 17), begin=10, end=20, cpu=3), Packet(begin=20, end=30, cpu=3)]
    with open_traces(write(tmp_path / "trace", *packets)) as traces:
        (batch,) = [b.batch for b in traces.batches() if b.name == PACKET]
    assert batch.schema == PACKET_SCHEMA
    first, second = batch.to_pylist()
    assert first == {
        "trace_index": 0,
        "stream_index": 0,
        "stream_class_id": 0,
        "stream_instance_id": 0,
        "cpu_id": 3,
        "position": 0,
        "begin_ns": EPOCH + 10,
        "end_ns": EPOCH + 20,
        "last_event_ns": EPOCH + 17,
        "event_count": 2,
        "discarded_event_count": 0,
        "lost_packet_count": 0,
        "is_numbered": reader != "bt2",
    }
    assert (second["position"], second["event_count"], second["last_event_ns"]) == (1, 0, None)


def test_streams_are_numbered_by_instance(tmp_path: Path, read_rows: Read) -> None:
    streams = {number: [Packet(events(100 - number))] for number in (9, 2, 10)}
    trace = write_trace(tmp_path / "trace", TraceContent({"ros2:x": {}}, streams))
    rows = read_rows(trace)[PACKET]
    assert {row["stream_instance_id"]: row["stream_index"] for row in rows} == {2: 0, 9: 1, 10: 2}


def test_many_streams(tmp_path: Path, read_rows: Read) -> None:
    """More than Babeltrace hands over at once."""
    streams = {number: [Packet(events(1000 - number), cpu=number)] for number in range(300)}
    trace = write_trace(tmp_path / "trace", TraceContent({"ros2:x": {}}, streams))
    rows = read_rows(trace)
    assert [row["cpu_id"] for row in rows["ros2:x"]] == list(reversed(range(300)))
    assert all(row["stream_index"] == row["cpu_id"] for row in rows[PACKET])


@pytest.mark.parametrize("batch_rows", [1, 3, 1000])
def test_counts_do_not_depend_on_batches(tmp_path: Path, read_rows: Read, batch_rows: int) -> None:
    packets = [Packet(events(*range(t, t + 5))) for t in range(0, 50, 5)]
    rows = read_rows(write(tmp_path / "trace", *packets), batch_rows=batch_rows)
    assert column(rows, "event_count") == [5] * 10
    assert column(rows, "position") == list(range(10))


def test_packet_without_end(tmp_path: Path, read_rows: Read) -> None:
    """What a crash leaves: the packet ends with its last event."""
    rows = read_rows(write(tmp_path / "trace", Packet(events(5, 8), begin=1, end=0)))
    assert column(rows, "end_ns") == [EPOCH + 8]


class TestDiscardedEvents:
    """A rise counts for the packet that shows it: lost after its last event, before its end."""

    packets = (
        Packet(events(1), begin=0, end=10),
        Packet(events(11), begin=10, end=20, discarded=4),
        Packet(events(21), begin=20, end=30, discarded=4),
        Packet(begin=30, end=40, discarded=9),
    )

    def test_rise(self, tmp_path: Path, read_rows: Read) -> None:
        rows = read_rows(write(tmp_path / "trace", *self.packets))
        assert column(rows, "discarded_event_count") == [0, 4, 0, 5]
        assert column(rows, "last_event_ns") == [EPOCH + 1, EPOCH + 11, EPOCH + 21, None]

    def test_streams_apart(self, tmp_path: Path, read_rows: Read) -> None:
        streams = {0: self.packets, 1: [Packet(events(15), begin=5, end=50)]}
        rows = read_rows(write_trace(tmp_path / "trace", TraceContent({"ros2:x": {}}, streams)))
        lost = {0: 0, 1: 0}
        for row in rows[PACKET]:
            lost[row["stream_index"]] += row["discarded_event_count"]
        assert lost == {0: 9, 1: 0}

    def test_in_the_first_packet(self, tmp_path: Path, read_rows: Read, reader: str) -> None:
        """Babeltrace does not tell it; the index does, and so does the packet itself."""
        packets = [
            Packet(events(1), begin=0, end=10, discarded=3),
            Packet(events(11), begin=10, end=20, discarded=5),
        ]
        trace = write(tmp_path / "trace", *packets)
        without_index = [None if reader == "bt2" else 3, 2]
        assert column(read_rows(trace), "discarded_event_count") == without_index
        write_index(trace, 0, packets)
        assert column(read_rows(trace), "discarded_event_count") == [3, 2]

    @pytest.mark.parametrize(
        "content", [b"", b"x" * 88, struct.pack(">IIII", 0xC1F1DCC1, 1, 1, 72)]
    )
    def test_useless_index(
        self, tmp_path: Path, read_rows: Read, reader: str, content: bytes
    ) -> None:
        trace = write(tmp_path / "trace", Packet(events(1), discarded=3))
        (trace / "index").mkdir()
        (trace / "index/other_0.idx").write_bytes(content)
        expected = [None if reader == "bt2" else 3]
        assert column(read_rows(trace), "discarded_event_count") == expected

    def test_counter_goes_on_in_the_next_chunk(self, tmp_path: Path, read_rows: Read) -> None:
        chunks: list[Sequence[Packet]] = [
            [Packet(events(1)), Packet(events(11), discarded=4)],
            [Packet(events(21), discarded=4), Packet(events(31), discarded=6)],
            [Packet(events(41), discarded=7)],
        ]
        for number, packets in enumerate(chunks):
            write_index(write(tmp_path / str(number), *packets), 0, packets)
        assert column(read_rows(tmp_path), "discarded_event_count") == [0, 4, 0, 2, 1]

    def test_what_lost_packets_discarded_is_not_known(
        self, tmp_path: Path, read_rows: Read
    ) -> None:
        """Nor what of the rise came behind them; where the counter stands still, it was nothing."""
        packets = [
            Packet(
                events(number), begin=number - 1, end=number + 4, discarded=count, sequence=place
            )
            for number, count, place in ((1, 2, 0), (11, 9, 4), (21, 10, 5), (31, 10, 8))
        ]
        trace = write(tmp_path / "trace", *packets)
        write_index(trace, 0, packets)
        rows = read_rows(trace)
        assert column(rows, "discarded_event_count") == [2, None, 1, 0]
        assert column(rows, "lost_packet_count") == [0, 3, 0, 2]

    def test_other_recordings_count_for_themselves(self, tmp_path: Path, read_rows: Read) -> None:
        for number in range(2):
            packets = [Packet(events(10 * number + 1), discarded=3)]
            trace = write(tmp_path / str(number), *packets, trace_uuid=uuid4())
            write_index(trace, 0, packets)
        assert column(read_rows(tmp_path), "discarded_event_count") == [3, 3]


def test_lost_packets_count_for_the_next_one(tmp_path: Path, read_rows: Read) -> None:
    packets = [
        Packet(events(t), begin=t, end=t + 5, sequence=n) for t, n in ((0, 0), (10, 3), (20, 4))
    ]
    rows = read_rows(write(tmp_path / "trace", *packets))
    assert column(rows, "lost_packet_count") == [0, 2, 0]


def test_numbers_go_on_in_the_next_chunk(tmp_path: Path, read_rows: Read, reader: str) -> None:
    """Babeltrace compares them within a directory only."""
    chunks = [[(0, 2), (10, 3)], [(20, 4), (30, 7)], [(40, 9)]]
    for number, chunk in enumerate(chunks):
        packets = [Packet(events(t), begin=t, end=t + 5, sequence=n) for t, n in chunk]
        write(tmp_path / str(number), *packets)
    rows = read_rows(tmp_path)
    is_known = reader != "bt2"
    assert column(rows, "lost_packet_count") == [2, 0, 0, 2, 1] if is_known else [0, 0, 0, 2, 0]
    assert column(rows, "is_numbered") == [is_known] * 5
