"""Events are found in packets, whatever their layout, size and damage."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.ctf_layouts import Style, TraceMaker
from support.ctf_writer import Event, Packet, TraceContent, write_trace
from support.mutations import flip_header, flip_stream, overwrite
from support.same_batches import differences, read
from support.thorough import examples

from msgflow.errors import TraceError
from msgflow.trace.ctf import event_positions, stream_layout
from msgflow.trace.ctf.event_positions import Found, Lanes, SideBySide

STYLES = st.builds(Style, st.booleans(), st.booleans(), st.booleans(), st.booleans())
KINDS = {
    "test:other": {},
    "test:number": {"n": "u64"},
    "test:blob": {"n": "u32", "blob": "u8[]"},
}


@settings(
    deadline=None,
    max_examples=examples(10, 60),
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    style=STYLES,
    random=st.randoms(use_true_random=True),
    damage=st.sampled_from([None, flip_stream, flip_header, overwrite]),
)
def test_columns_as_field_by_field(
    style: Style, random: Random, damage: Any, tmp_path_factory: Any
) -> None:
    trace = TraceMaker(style, random).write(tmp_path_factory.mktemp("trace") / "trace", packets=12)
    if damage is not None:
        damage(trace, random)
    try:
        at_once = read(trace)
    except TraceError:
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stream_layout, "compile_header", lambda *_: None)
        field_by_field = read(trace)
    assert not differences(at_once, field_by_field)
    places = [
        [(found.file, found.position) for found in content.damages]
        for content in (at_once, field_by_field)
    ]
    assert places[0] == places[1]


def anywhere(random: Random) -> Callable[..., Any]:
    """Return guesses of where events begin; most are wrong."""

    def guess(layout: Any, _: Any, targets: Any) -> Any:
        near = [at + random.randrange(-3, 4) * layout.header.align for at in targets.tolist()]
        return np.array(near, np.int64), np.arange(targets.size)

    return guess


@settings(
    deadline=None,
    max_examples=examples(10, 60),
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    style=STYLES,
    random=st.randoms(use_true_random=True),
    damage=st.sampled_from([None, flip_stream, flip_header, overwrite]),
    smallest=st.sampled_from([1, 8, 100, 4096]),
    looked_at=st.sampled_from([8, 128]),
    followed=st.sampled_from([0, 200]),
    is_wild=st.booleans(),
)
def test_side_by_side_as_alone(
    style: Style,
    random: Random,
    damage: Any,
    smallest: int,
    looked_at: int,
    followed: int,
    is_wild: bool,
    tmp_path_factory: Any,
) -> None:
    """Also where packets are split at bytes where no event begins, or within a long event."""
    trace = TraceMaker(style, random).write(tmp_path_factory.mktemp("trace") / "trace", packets=12)
    if damage is not None:
        damage(trace, random)
    contents = []
    for fewest in (1, 3, 1 << 30):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(event_positions, "FEWEST_LANES", fewest)
            patch.setattr(event_positions, "SMALLEST_LANE", smallest)
            patch.setattr(event_positions, "LOOKED_AT", looked_at)
            patch.setattr(event_positions, "FOLLOWED", followed)
            if is_wild:
                patch.setattr(event_positions, "guess", anywhere(random))
            try:
                contents.append(read(trace))
            except TraceError:
                return
    alone = contents.pop()
    for content in contents:
        assert not differences(content, alone)
        assert content.damages == alone.damages


def write_numbers(directory: Path, count: int, *, blob_at: int = -1) -> Path:
    """Write a trace of one packet with so many events, one of which may be a blob."""
    events = [
        Event(n * 10, "test:blob", (n, b"\1" * 40_000))
        if n == blob_at
        else Event(n * 10, "test:number", (n,))
        for n in range(count)
    ]
    return write_trace(directory / "trace", TraceContent(KINDS, {0: [Packet(events)]}))


def test_a_long_event_among_short_ones(tmp_path: Path) -> None:
    rows = read(write_numbers(tmp_path, 2000, blob_at=900)).rows
    assert [row[-1] for row in rows["test:number"]] == [n for n in range(2000) if n != 900]
    assert [row[-1] for row in rows["test:blob"]] == [[1] * 40_000]


def test_events_in_front_of_damage_are_kept(tmp_path: Path) -> None:
    trace = write_numbers(tmp_path, 20_000)
    file = trace / "channel_0"
    data = bytearray(file.read_bytes())
    data[400_000:400_100] = b"\xff" * 100
    file.write_bytes(data)
    found = read(trace)
    (damage,) = found.damages
    assert 399_950 < damage.offset < 400_100
    numbers = [row[-1] for row in found.rows["test:number"]]
    assert numbers[:-1] == [*range(len(numbers) - 1)]
    assert 9_000 < len(numbers) < 9_400


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Lanes, list[Found]]]:
    """What was read side by side, and what was found in it."""
    noted = []

    class Noting(SideBySide):
        def __init__(self, layout: Any, memory: Any, spans: Any, lanes: Lanes) -> None:
            super().__init__(layout, memory, spans, lanes)
            self.lanes = lanes

        def run(self) -> list[Found]:
            found = super().run()
            noted.append((self.lanes, found))
            return found

    monkeypatch.setattr(event_positions, "SideBySide", Noting)
    return noted


def test_a_large_packet_is_read_side_by_side(
    tmp_path: Path, runs: list[tuple[Lanes, list[Found]]]
) -> None:
    """In a lane per 4 KiB, each from the begin of an event."""
    found = read(write_numbers(tmp_path, 20_000))
    assert [row[-1] for row in found.rows["test:number"]] == [*range(20_000)]
    ((lanes, (packet,)),) = runs
    assert lanes.begins.size > 100
    assert set(lanes.begins.tolist()) <= set(packet.positions.tolist())


@pytest.mark.parametrize(
    ("count", "times"), [(event_positions.FEWEST_LANES - 1, 0), (event_positions.FEWEST_LANES, 1)]
)
def test_many_small_packets_are_read_side_by_side(
    tmp_path: Path, runs: list[tuple[Lanes, list[Found]]], count: int, times: int
) -> None:
    packets = [Packet([Event(n, "test:number", (n,))]) for n in range(count)]
    found = read(write_trace(tmp_path / "trace", TraceContent(KINDS, {0: packets})))
    assert [row[-1] for row in found.rows["test:number"]] == [*range(count)]
    assert len(runs) == times


def test_packets_without_events(tmp_path: Path) -> None:
    empty = TraceContent(KINDS, {0: [Packet(begin=1), Packet(begin=2)]})
    assert "test:number" not in read(write_trace(tmp_path / "trace", empty)).rows


def test_a_header_longer_than_a_packet_is_damage(tmp_path: Path) -> None:
    """The id is looked for behind the end of the file."""
    directory = tmp_path / "trace"
    directory.mkdir()
    (directory / "metadata").write_text(
        """/* CTF 1.8 */
        typealias integer { size = 8; align = 8; } := uint8_t;
        typealias integer { size = 32; align = 8; } := uint32_t;
        trace { major = 1; minor = 8; byte_order = le; };
        clock { name = c; freq = 1000000000; };
        stream {
            packet.context := struct { uint32_t content_size; uint32_t packet_size; };
            event.header := struct { uint8_t rest[5000]; uint8_t id;
                integer { size = 32; align = 8; map = clock.c.value; } timestamp; }; };
        event { id = 0; name = "x"; fields := struct { uint8_t n; }; };"""
    )
    (directory / "stream").write_bytes(struct.pack("<II", 8 * 80, 8 * 80) + bytes(72))
    found = read(directory)
    assert not any(found.event_counts.values())
    assert "do not fit into the packet" in found.damages[0].message
