"""Traces of one boot are on one time base, however far apart the offsets that they declare."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from uuid import UUID

from support.ctf_writer import Event, Packet, TraceContent, write_trace

from msgflow.trace import PACKET, TraceSet

Open = Callable[..., TraceSet]
EPOCH = 1_700_000_000_000_000_000
OTHER_BOOT = UUID(int=7)


def write(path: Path, offset: int, times: list[int], **more: object) -> None:
    packet = Packet([Event(time, "ros2:x", (time,)) for time in times])
    content = TraceContent(
        {"ros2:x": {"n": "u64"}},
        {0: [packet]},
        trace_uuid=UUID(int=len(times)),
        offset_cycles=offset,
        **more,  # type: ignore[arg-type]
    )
    write_trace(path, content)


def read(traces: TraceSet) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Return (trace, time) of each event, and (begin, end) of each packet, since the epoch."""
    events, packets = [], []
    for batch in traces.batches():
        for row in batch.batch.to_pylist():
            if batch.name == PACKET:
                packets.append((row["begin_ns"] - EPOCH, row["end_ns"] - EPOCH))
            else:
                events.append((row["trace_index"], row["ts_ns"] - EPOCH))
    return events, packets


def test_the_first_trace_of_a_boot_decides(tmp_path: Path, open_traces: Open) -> None:
    write(tmp_path / "a", 10_000, [10, 20])
    write(tmp_path / "b", 4_000, [15])
    write(tmp_path / "c", 2_000_000_000, [12, 18, 22])
    with open_traces(tmp_path) as traces:
        declared = [info.clock_offset_ns - EPOCH for info in traces.traces]
        corrections = [info.clock_correction_ns for info in traces.traces]
        extents = [(i.begin_ns - EPOCH, i.end_ns - EPOCH) for i in traces.traces]  # type: ignore[operator]
        events, packets = read(traces)
    assert declared == [10_000, 4_000, 2_000_000_000]
    assert corrections == [0, 6_000, -1_999_990_000]
    assert extents == [(10_010, 10_020), (10_015, 10_015), (10_012, 10_022)]
    assert events == [(0, 10_010), (2, 10_012), (1, 10_015), (2, 10_018), (0, 10_020), (2, 10_022)]
    assert sorted(packets) == [(10_010, 10_020), (10_012, 10_022), (10_015, 10_015)]


def test_a_kernel_trace_decides_only_alone(tmp_path: Path, open_traces: Open) -> None:
    write(tmp_path / "a", 10_000, [10], environment={"domain": "kernel"})
    write(tmp_path / "b", 4_000, [15, 16], environment={"domain": "ust"})
    with open_traces(tmp_path) as traces:
        assert [info.clock_correction_ns for info in traces.traces] == [-6_000, 0]
        assert read(traces)[0] == [(0, 4_010), (1, 4_015), (1, 4_016)]
    with open_traces(tmp_path / "a") as traces:
        assert read(traces)[0] == [(0, 10_010)]


def test_errors_of_measuring_are_left_alone(tmp_path: Path, open_traces: Open) -> None:
    write(tmp_path / "a", 10_000, [10, 11])
    write(tmp_path / "b", 9_000, [15])
    write(tmp_path / "c", 11_000, [16])
    write(tmp_path / "d", 8_999, [17])
    write(tmp_path / "e", 11_001, [18])
    with open_traces(tmp_path) as traces:
        assert [info.clock_correction_ns for info in traces.traces] == [0, 0, 0, 1_001, -1_001]
        events, _ = read(traces)
    assert sorted(events) == [
        (0, 10_010),
        (0, 10_011),
        (1, 9_015),
        (2, 11_016),
        (3, 10_017),
        (4, 10_018),
    ]


def test_another_boot_keeps_its_offset(tmp_path: Path, open_traces: Open) -> None:
    write(tmp_path / "a", 1_000, [10])
    write(tmp_path / "b", 4_000, [15, 16], clock_uuid=OTHER_BOOT)
    with open_traces(tmp_path) as traces:
        assert [info.clock_correction_ns for info in traces.traces] == [0, 0]
        assert read(traces)[0] == [(0, 1_010), (1, 4_015), (1, 4_016)]


def test_a_clock_of_its_own_in_an_equal_boot_keeps_its_offset(
    tmp_path: Path, open_traces: Open
) -> None:
    """A time namespace, or a clone: recorded at one time, as much later on the other's clock."""
    write(tmp_path / "a", 1_000_000, [10, 30], environment={"hostname": "one"})
    write(tmp_path / "b", 0, [1_000_015, 1_000_016, 1_000_017], environment={"hostname": "two"})
    write(tmp_path / "c", 0, [1_000_040], environment={"hostname": "two"})
    with open_traces(tmp_path) as traces:
        assert [info.clock_correction_ns for info in traces.traces] == [0, 0, 0]
        assert [info.clock_uuid is None for info in traces.traces] == [False, True, True]
        assert [time for _, time in read(traces)[0]] == [
            1_000_010,
            1_000_015,
            1_000_016,
            1_000_017,
            1_000_030,
            1_000_040,
        ]


def test_hosts_of_one_clock_that_was_set_are_on_one_base(tmp_path: Path, open_traces: Open) -> None:
    write(tmp_path / "a", 1_000_000, [10, 30], environment={"hostname": "one"})
    write(tmp_path / "b", 0, [20, 25, 40], environment={"hostname": "two"})
    with open_traces(tmp_path) as traces:
        assert [info.clock_correction_ns for info in traces.traces] == [0, 1_000_000]


def test_a_clock_that_counts_no_nanoseconds_is_left_alone(
    tmp_path: Path, open_traces: Open
) -> None:
    write(tmp_path / "a", 1_000, [10], frequency=500_000_000)
    write(tmp_path / "b", 4_000, [15, 16], frequency=500_000_000)
    with open_traces(tmp_path) as traces:
        assert [info.clock_correction_ns for info in traces.traces] == [0, 0]
        assert read(traces)[0] == [(0, 2_020), (1, 8_030), (1, 8_032)]
