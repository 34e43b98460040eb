from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace
from msgflow.errors import UsageError
from msgflow.events.selection import Selection
from msgflow.trace import EventBatch

Listed = Callable[..., list[dict[str, Any]]]

BEGIN_NS = 1_700_000_000_000_000_000
SECOND = 1_000_000_000


@pytest.fixture
def trace(reader: str, tmp_path: Path) -> Path:
    """Ten seconds, an event a second on each of two CPUs; three events were lost."""
    streams = {
        cpu: [
            Packet(
                [Event(n * SECOND + cpu, ("a:x", "a:y", "b:x")[n % 3]) for n in range(begin, end)],
                cpu=cpu,
                discarded=3 * (begin > 0),
            )
            for begin, end in ((0, 5), (5, 10))
        ]
        for cpu in (0, 1)
    }
    streams[1] = [Packet(packet.events, cpu=1) for packet in streams[1]]
    content = TraceContent(events={"a:x": {}, "a:y": {}, "b:x": {}, "b:never": {}}, streams=streams)
    return write_trace(tmp_path / "trace", content)


def times(events: list[dict[str, Any]]) -> list[int]:
    return [event["ts_ns"] - BEGIN_NS for event in events]


def test_all_in_order(listed: Listed, trace: Path) -> None:
    assert times(listed(trace)) == [n * SECOND + cpu for n in range(10) for cpu in (0, 1)]


def test_patterns(listed: Listed, trace: Path) -> None:
    def names(*patterns: str) -> set[str]:
        return {event["name"] for event in listed(trace, patterns=patterns)}

    assert names("a:*") == {"a:x", "a:y"}
    assert names("?:x") == {"a:x", "b:x"}
    assert names("a:y", "b:*") == {"a:y", "b:x"}
    assert names("b:never") == set()


def test_chosen_events_keep_their_numbers(listed: Listed, trace: Path) -> None:
    everything = listed(trace)
    chosen = listed(trace, patterns=["a:y"])
    assert chosen == [event for event in everything if event["name"] == "a:y"]
    assert len(chosen) == 6


def test_a_pattern_without_any_event_is_refused(trace: Path) -> None:
    with msgflow.trace.open([trace]) as traces, pytest.raises(UsageError, match="— A:x") as caught:
        Selection(traces, ["a:x", "A:x"])
    assert "--count" in str(caught.value.hint)


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ("3s", "5s"),
        ("+3", "5000ms"),
        (BEGIN_NS + 3 * SECOND, str(BEGIN_NS + 5 * SECOND)),
        ("2023-11-14T22:13:23Z", "2023-11-14T22:13:25"),
    ],
)
@pytest.mark.parametrize("batch_rows", [1, 1000])
def test_time_window_has_its_start_and_not_its_end(
    listed: Listed,
    trace: Path,
    start: str | int,
    end: str | int,
    batch_rows: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("msgflow.events.selection.BATCH_ROWS", batch_rows)
    assert times(listed(trace, start=start, end=end)) == [
        3 * SECOND,
        3 * SECOND + 1,
        4 * SECOND,
        4 * SECOND + 1,
    ]


def test_reading_stops_at_the_end(trace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with msgflow.trace.open([trace]) as traces:
        (whole,) = [item for item in traces.batches({"a:x": pa.schema([])}) if item.name == "a:x"]
        read = []

        def batches(*_: object, **__: object) -> Iterator[EventBatch]:
            for row in range(whole.batch.num_rows):
                read.append(row)
                yield EventBatch("a:x", whole.batch.slice(row, 1), row)

        monkeypatch.setattr(traces, "batches", batches)
        assert len(list(Selection(traces, end="2s").rounds())) == 2
    # That the third round is over, only the begin of the fourth tells.
    assert read == [0, 1, 2, 3]


def test_counts(trace: Path) -> None:
    with msgflow.trace.open([trace]) as traces:
        selection = Selection(traces)
        assert list(selection.counts().items()) == [("a:x", 8), ("a:y", 6), ("b:x", 6)]
        assert selection.lost_event_count == 3
        assert Selection(traces, ["b:*"]).counts() == {"b:x": 6}
        assert Selection(traces, ["?:x"], "2s", "4s").counts() == {"a:x": 2, "b:x": 2}


def test_times_that_cannot_be_read(trace: Path) -> None:
    with msgflow.trace.open([trace]) as traces:
        with pytest.raises(UsageError, match="cannot read the time of --start"):
            Selection(traces, start="soon")
        with pytest.raises(UsageError, match="ends before it starts"):
            Selection(traces, start="3s", end="2s")
