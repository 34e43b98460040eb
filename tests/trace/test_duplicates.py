"""Packets that a set of traces holds more than once are read once, from the first trace."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from uuid import uuid4

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace
from msgflow.trace import PACKET, TraceSet

Open = Callable[..., TraceSet]


def packet(begin: int, **more: int) -> Packet:
    """Three events, the first of them at the very begin, as LTTng writes it."""
    times = (begin, begin + 3, begin + 6)
    return Packet([Event(t, "ros2:x", (t,)) for t in times], end=begin + 10, **more)


def write(path: Path, *begins: int, **more: object) -> Path:
    streams = {
        0: [packet(begin) for begin in begins],
        1: [packet(begin, cpu=1) for begin in begins],
    }
    return write_trace(path, TraceContent({"ros2:x": {"n": "u64"}}, streams, **more))  # type: ignore[arg-type]


def read(traces: TraceSet, **options: int) -> tuple[list[tuple[int, int, int]], list[int]]:
    """Return the events as (id, trace, n) and the trace index of each packet."""
    events, packets = [], []
    for batch in traces.batches(**options):  # type: ignore[arg-type]
        for row in batch.batch.to_pylist():
            if batch.name == PACKET:
                packets.append(row["trace_index"])
            else:
                events.append((row["event_id"], row["trace_index"], row["n"]))
    return events, packets


@pytest.mark.parametrize("batch_rows", [1, 1000])
def test_copied_directory(tmp_path: Path, open_traces: Open, batch_rows: int) -> None:
    trace = write(tmp_path / "a", 0, 10, 20)
    with open_traces(trace) as traces:
        alone = read(traces)
    shutil.copytree(trace, tmp_path / "b")
    with open_traces(tmp_path) as traces:
        assert read(traces, batch_rows=batch_rows) == alone
        assert traces.duplicate_packet_count == 6
        assert traces.event_counts == {(0, "ros2:x"): 18}


def test_three_copies(tmp_path: Path, open_traces: Open) -> None:
    for name in "abc":
        write(tmp_path / name, 0, 10)
    with open_traces(tmp_path) as traces:
        events, packets = read(traces)
        assert traces.duplicate_packet_count == 8
    assert {trace for _, trace, _ in events} == set(packets) == {0}
    assert len(events) == 12


def test_overlapping_snapshots(tmp_path: Path, open_traces: Open) -> None:
    write(tmp_path / "1", 0, 10, 20)
    write(tmp_path / "2", 20, 30)
    write(tmp_path / "3", 10, 30, 40)
    with open_traces(tmp_path) as traces:
        events, packets = read(traces)
        assert traces.duplicate_packet_count == 6
    assert [event_id for event_id, _, _ in events] == list(range(30))
    assert sorted(packets) == [0] * 6 + [1] * 2 + [2] * 2
    assert {n: trace for _, trace, n in events if n % 10 == 0} == {0: 0, 10: 0, 20: 0, 30: 1, 40: 2}


def test_empty_packets(tmp_path: Path, open_traces: Open) -> None:
    for name in "ab":
        streams = {0: [Packet(begin=5, end=5), packet(5), Packet(begin=15, end=20)]}
        write_trace(tmp_path / name, TraceContent({"ros2:x": {"n": "u64"}}, streams))
    with open_traces(tmp_path) as traces:
        events, packets = read(traces)
        assert traces.duplicate_packet_count == 3
    assert len(events) == 3
    assert packets == [0, 0, 0]


def test_packets_of_one_identity_but_other_content_are_read_both(tmp_path: Path) -> None:
    first, same = packet(0, sequence=1), packet(0, sequence=1)
    other = Packet([Event(t, "ros2:x", (t + 1,)) for t in (0, 3, 6)], end=10, sequence=1)
    content = TraceContent({"ros2:x": {"n": "u64"}}, {0: [first, same, other]})
    trace = write_trace(tmp_path / "a", content)
    # Babeltrace ends at such a packet.
    with msgflow.trace.open([trace], reader="msgflow") as traces:
        events, _ = read(traces)
        damages = [damage.message for damage in traces.damages]
        assert dict(traces.repeated_packet_counts) == {0: 1}
    assert sorted(n for _, _, n in events) == [0, 1, 3, 4, 6, 7]
    assert damages == ["another packet has its stream, number and begin: both were read"]


def test_losses_of_a_skipped_packet_do_not_count(tmp_path: Path, open_traces: Open) -> None:
    for name in "ab":
        streams = {0: [packet(0), packet(10, discarded=5, sequence=3)]}
        write_trace(tmp_path / name, TraceContent({"ros2:x": {"n": "u64"}}, streams))
    with open_traces(tmp_path) as traces:
        rows = [r for b in traces.batches() if b.name == PACKET for r in b.batch.to_pylist()]
    # Nothing tells how many of the five were in the packets that are missing.
    assert [row["discarded_event_count"] for row in rows] == [0, None]
    assert [row["lost_packet_count"] for row in rows] == [0, 2]


def test_other_trace_at_the_same_time_is_no_copy(tmp_path: Path, open_traces: Open) -> None:
    write(tmp_path / "a", 0, 10)
    write(tmp_path / "b", 0, 10, trace_uuid=uuid4())
    with open_traces(tmp_path) as traces:
        events, packets = read(traces)
        assert traces.duplicate_packet_count == 0
    assert len(events) == 24
    assert sorted(packets) == [0] * 4 + [1] * 4


def test_breaking_off_in_between(tmp_path: Path, open_traces: Open) -> None:
    for name in "ab":
        write(tmp_path / name, 0, 10, 20)
    with open_traces(tmp_path) as traces:
        for _ in traces.batches(batch_rows=2):
            break
        assert len(read(traces)[0]) == 18


class TestOneTrace:
    """A stream file copied beside itself."""

    @staticmethod
    def numbered(path: Path, count: int = 4) -> Path:
        streams = {
            cpu: [packet(10 * n, cpu=cpu, sequence=n) for n in range(count)] for cpu in (0, 1)
        }
        return write_trace(path, TraceContent({"ros2:x": {"n": "u64"}}, streams))

    def test_is_read_once(self, tmp_path: Path) -> None:
        trace = self.numbered(tmp_path / "a")
        with msgflow.trace.open([trace]) as traces:
            alone = read(traces)
        shutil.copy(trace / "channel_1", trace / "channel_1 (copy)")
        with msgflow.trace.open([trace]) as traces:
            assert read(traces) == alone
            assert traces.repeated_packet_counts == {0: 4}
            assert traces.duplicate_packet_count == 0

    def test_a_part_of_it(self, tmp_path: Path) -> None:
        """Also where another trace has the packets, too."""
        trace = self.numbered(tmp_path / "a")
        shutil.copytree(trace, tmp_path / "b")
        content = (trace / "channel_0").read_bytes()
        (trace / "more").write_bytes(content[: len(content) // 2])
        with msgflow.trace.open([tmp_path]) as traces:
            events, packets = read(traces)
            assert (len(events), len(packets)) == (24, 8)
            assert traces.repeated_packet_counts == {0: 2}
            assert traces.duplicate_packet_count == 8

    @pytest.mark.parametrize("is_named", [True, False])
    def test_without_numbers(self, tmp_path: Path, is_named: bool) -> None:
        """Packets that are equal byte for byte; one that differs in one of them stays."""
        trace = self.numbered(tmp_path / "a")
        text = (trace / "metadata").read_text().replace("packet_seq_num", "other")
        if not is_named:
            text = text.replace("uint64_t stream_instance_id", "uint64_t other")
        (trace / "metadata").write_text(text)
        content = bytearray((trace / "channel_0").read_bytes())
        content[-1] ^= 1
        (trace / "more").write_bytes(content)
        with msgflow.trace.open([trace]) as traces:
            events, _ = read(traces)
            assert len(events) == 24 + 3
            assert traces.repeated_packet_counts == {0: 3}

    def test_an_empty_packet_in_front_is_none(self, tmp_path: Path) -> None:
        """Rotation writes such: they begin together, and may have no numbers."""
        streams = {0: [Packet(begin=0, end=0), packet(0), packet(10)]}
        trace = write_trace(tmp_path / "a", TraceContent({"ros2:x": {"n": "u64"}}, streams))
        with msgflow.trace.open([trace]) as traces:
            events, packets = read(traces)
            assert (len(events), len(packets)) == (6, 3)
            assert not traces.repeated_packet_counts
