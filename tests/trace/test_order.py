"""The total order: time, trace, stream, position in stream."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import UUID

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.ctf_writer import Event, Packet, TraceContent, write_trace

Read = Callable[..., dict[str, list[dict[str, Any]]]]

EVENTS = {"ros2:a": {"stream": "u32", "position": "u32"}, "ros2:b": {"stream": "u32"}}


Streams = list[list[int]]


@settings(
    deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.lists(
        st.lists(st.lists(st.integers(0, 3), max_size=8).map(sorted), min_size=1, max_size=3),
        min_size=1,
        max_size=3,
    ),
    st.integers(1, 20),
)
def test_simultaneous_events(
    tmp_path_factory: Any, read_rows: Read, sets: list[Streams], batch_rows: int
) -> None:
    """Events of few nanoseconds in many streams and traces, in batches of any size."""
    directory = tmp_path_factory.mktemp("ties")
    expected = []
    for trace_index, streams in enumerate(sets):
        packets: dict[int, list[Packet]] = {}
        for stream, times in enumerate(streams):
            events = []
            for position, time in enumerate(times):
                expected.append((time, trace_index, stream, position))
                if position % 3:
                    events.append(Event(time, "ros2:b", (stream,)))
                else:
                    events.append(Event(time, "ros2:a", (stream, position)))
            packets[stream] = [Packet(events)]
        content = TraceContent(EVENTS, packets, trace_uuid=UUID(int=trace_index + 1))
        write_trace(directory / str(trace_index), content)
    expected.sort()
    found = read_rows(directory, batch_rows=batch_rows)
    rows = [row for name in EVENTS for row in found.get(name, [])]
    rows.sort(key=lambda row: row["event_id"])
    assert [row["event_id"] for row in rows] == list(range(len(expected)))
    keys = [(row["ts_ns"] % 1000, row["trace_index"], row["stream"]) for row in rows]
    assert keys == [entry[:3] for entry in expected]
    assert [row["position"] for row in rows if row.get("position") is not None] == [
        entry[3] for entry in expected if entry[3] % 3 == 0
    ]
    for name in EVENTS:
        ids = [row["event_id"] for row in found.get(name, [])]
        assert ids == sorted(ids)


def test_clock_that_does_not_count_nanoseconds(tmp_path: Path, read_rows: Read) -> None:
    """Babeltrace rounds such times to the next hundred nanoseconds or so; we do not."""
    offset = 1_700_000_000 * 24_000_000
    events = {
        0: [Event(t, "ros2:a", (0, i)) for i, t in enumerate(range(1_000_000, 1_000_400, 4))],
        1: [Event(t, "ros2:a", (1, i)) for i, t in enumerate(range(1_000_001, 1_000_400, 3))],
    }
    content = TraceContent(
        EVENTS,
        {stream: [Packet(of_stream)] for stream, of_stream in events.items()},
        frequency=24_000_000,
        offset_seconds=5,
        offset_cycles=offset,
    )
    rows = read_rows(write_trace(tmp_path / "trace", content))["ros2:a"]
    expected = sorted(
        (5 * 10**9 + (event.time + offset) * 10**9 // 24_000_000, *event.payload)
        for of_stream in events.values()
        for event in of_stream
    )
    assert [(row["ts_ns"], row["stream"], row["position"]) for row in rows] == expected
