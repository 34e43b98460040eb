"""How packets are brought together for reading changes nothing of what is read."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.ctf_layouts import Style, TraceMaker
from support.ctf_writer import Event, Packet, TraceContent, write_trace
from support.mutations import flip_stream, overwrite
from support.same_batches import Content, differences, read
from support.thorough import examples

from msgflow.errors import TraceError
from msgflow.trace.ctf import batches, event_order
from msgflow.trace.ctf.packet_memory import Loader
from msgflow.trace.ctf.stream_layout import GAP

STYLES = st.builds(Style, st.booleans(), st.booleans(), st.booleans(), st.booleans())


def read_in_pieces(trace: Path, most_bytes: int, most_events: int) -> Content:
    """Read so little at once that packets of other streams keep most packets waiting, and cut."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(batches, "SMALLEST_BATCH", most_bytes)
        patch.setattr(batches, "LARGEST_BATCH", most_bytes)
        patch.setattr(event_order, "MOST_EVENTS", most_events)
        patch.setattr(event_order, "PIECE", max(most_bytes // GAP, 1) * GAP)
        patch.setattr(event_order, "LARGEST_WHOLE", 0)
        return read(trace)


@settings(
    deadline=None,
    max_examples=examples(8, 60),
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    style=STYLES,
    random=st.randoms(use_true_random=True),
    damage=st.sampled_from([None, None, flip_stream, overwrite]),
    latest_begin=st.sampled_from([1, 1 << 33, 1 << 40]),
)
def test_in_pieces_as_at_once(
    style: Style, random: Random, damage: Any, latest_begin: int, tmp_path_factory: Any
) -> None:
    """Also where clocks are narrow, time runs backward in packets, and events are left out."""
    maker = TraceMaker(style, random)
    trace = maker.write(tmp_path_factory.mktemp("trace") / "trace", 4, 6, latest_begin)
    if damage is not None:
        damage(trace, random)
    try:
        whole = read(trace)
    except TraceError:
        return
    for most_bytes, most_events in ((1, 1 << 18), (1, 3), (2000, 7)):
        found = read_in_pieces(trace, most_bytes, most_events)
        assert not differences(whole, found)
        assert whole.damages == found.damages


def beside_others(directory: Path, times: Iterable[int], begin: int, others: Iterable[int]) -> Path:
    """Write a packet with events of these times, and another stream with packets of one event."""
    content = TraceContent(
        {"test:n": {"n": "u32"}},
        {
            0: [Packet([Event(time, "test:n", (time,)) for time in times], begin=begin, end=70)],
            1: [
                Packet([Event(time, "test:n", (time,))], begin=time, sequence=number)
                for number, time in enumerate(others)
            ],
        },
    )
    return write_trace(directory / "trace", content)


def test_time_that_runs_backward_in_a_packet_that_waits(tmp_path: Path) -> None:
    """What of it is done is not what comes first in it."""
    trace = beside_others(tmp_path, (10, 50, 20, 60, 30, 70), 10, (15, 25, 45, 65))
    whole = read(trace)
    numbers = [row[-1] for row in whole.rows["test:n"]]
    assert numbers == [10, 15, 20, 25, 30, 45, 50, 60, 65, 70]
    assert not differences(whole, read_in_pieces(trace, 1, 2))


def test_events_earlier_than_their_packet(tmp_path: Path) -> None:
    """They come where the packet begins, as the reader knows of them only then."""
    trace = beside_others(tmp_path, (5, 12, 40, 41), 20, (10, 15, 25, 45))
    whole = read(trace)
    assert [row[-1] for row in whole.rows["test:n"]] == [10, 15, 5, 12, 25, 40, 41, 45]
    for most_bytes, most_events in ((1, 1 << 18), (1, 2), (40, 2)):
        assert not differences(whole, read_in_pieces(trace, most_bytes, most_events))


def test_large_packets_are_read_piece_by_piece(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of up to 1 MiB as they are; a batch has 8 MiB, and what waits of other streams."""
    kinds = {"test:n": {"n": "u32", "rest": "text[10000]"}}
    streams = {
        stream: [
            Packet(
                [Event(4 * n + stream, "test:n", (n, b"x")) for n in range(first, first + count)],
                sequence=number,
            )
            for number, (first, count) in enumerate(packets)
        ]
        for stream, packets in enumerate([[(0, 100), (100, 1400)], [(0, 1500)], [(200, 110)]])
    }
    loaded: list[list[Any]] = []
    load = Loader.load

    def noted(loader: Loader, entries: Any) -> Any:
        loaded.append([(entry.position, entry.until, entry.size) for entry in entries])
        return load(loader, entries)

    monkeypatch.setattr(Loader, "load", noted)
    content = read(write_trace(tmp_path / "trace", TraceContent(kinds, streams)))
    assert [row[0] for row in content.rows["test:n"]] == [*range(3110)]
    times = [row[1] for row in content.rows["test:n"]]
    assert times == sorted(times)
    assert content.event_counts == {(0, "test:n"): 3110}
    entries = [entry for entries in loaded for entry in entries]
    wholes = {size for _, until, size in entries if until is None}
    assert len(wholes) == 1
    assert 0.9 < wholes.pop() / 1e6 < 1.1
    assert 0.5 < max(size for _, until, size in entries if until is not None) / 1e6 < 0.56
    assert 8 < max(sum(size for *_, size in entries) for entries in loaded) / 1e6 < 10
