"""How packets are brought together for reading changes nothing of what is read."""

from __future__ import annotations

import gc
from pathlib import Path
from random import Random
from typing import Any

import pytest
from ctf_layouts import Style, TraceMaker
from ctf_writer import Event, Packet, TraceContent, write_trace
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mutations import flip_stream, overwrite
from same_batches import Content, differences, read

from msgflow.errors import TraceError
from msgflow.trace.ctf import iteration, order
from msgflow.trace.ctf.loading import Loader

STYLES = st.builds(Style, st.booleans(), st.booleans(), st.booleans(), st.booleans())


def read_in_pieces(trace: Path, most_bytes: int, most_events: int) -> Content:
    """Read so little at once that packets of other streams keep most packets waiting."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(iteration, "_SMALLEST_BATCH", most_bytes)
        patch.setattr(iteration, "_LARGEST_BATCH", most_bytes)
        patch.setattr(order, "_MOST_EVENTS", most_events)
        return read(trace)


@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture]
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
        pieces = read_in_pieces(trace, most_bytes, most_events)
        assert not differences(whole, pieces)
        assert whole.damages == pieces.damages


def test_time_that_runs_backward_in_a_packet_that_waits(tmp_path: Path) -> None:
    """What of it is done is not what comes first in it."""
    kinds = {"test:n": {"n": "u32"}}
    back = [Event(time, "test:n", (time,)) for time in (10, 50, 20, 60, 30, 70)]
    others = [
        Packet([Event(time, "test:n", (time,))], begin=time, sequence=number)
        for number, time in enumerate((15, 25, 45, 65))
    ]
    content = TraceContent(kinds, {0: [Packet(back, begin=10, end=70)], 1: others})
    trace = write_trace(tmp_path / "trace", content)
    whole = read(trace)
    assert [row[-1] for row in whole.rows["test:n"]] == sorted(
        row[-1] for row in whole.rows["test:n"]
    )
    assert len(whole.rows["test:n"]) == 10
    assert not differences(whole, read_in_pieces(trace, 1, 2))


def test_room_is_used_again_when_nobody_uses_it() -> None:
    """Columns of a batch may be made while the packets after it are loaded."""
    loader = Loader()
    loader.load([])
    first = loader.memory
    loader.load([])
    second = loader.memory
    assert second.data is not first.data
    room = first.data
    del first
    gc.collect()
    loader.load([])
    assert loader.memory.data is room
    assert loader.memory.data is not second.data
