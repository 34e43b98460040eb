"""The two ways to find events agree, whatever the layout and damage."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from ctf_layouts import Style, TraceMaker
from ctf_writer import Event, Packet, TraceContent, write_trace
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mutations import flip_header, flip_stream, overwrite
from same_batches import differences, read
from thorough import examples

from msgflow.errors import TraceError
from msgflow.trace.ctf import events, lanes, lockstep, scan, steps

STYLES = st.builds(Style, st.booleans(), st.booleans(), st.booleans(), st.booleans())


ONE_BY_ONE = partial(lockstep.scan_lockstep, narrowest=1 << 30)


def anywhere(random: Random) -> Callable[..., Any]:
    """Return guesses of which most are wrong."""

    def guess(_: Any, targets: Any, align: int) -> Any:
        return np.array(
            [at + random.randrange(-3, 4) * align for at in targets.tolist()], np.int64
        ), np.arange(targets.size)

    return guess


@settings(
    deadline=None,
    max_examples=examples(20, 60),
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
def test_side_by_side_as_one_by_one(
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
    for narrowest in (1, 3, 1 << 30):
        kernel = partial(lockstep.scan_lockstep, narrowest=narrowest)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(events, "scan_lockstep", kernel)
            patch.setattr(lanes, "_SMALLEST", smallest)
            patch.setattr(lanes, "_LOOKED_AT", looked_at)
            patch.setattr(lanes, "_FOLLOWED", followed)
            if is_wild:
                patch.setattr(lanes, "_guess", anywhere(random))
            try:
                contents.append(read(trace))
            except TraceError:
                return
    one_by_one = contents.pop()
    for content in contents:
        assert not differences(content, one_by_one)
        assert content.damages == one_by_one.damages


def test_many_packets_are_read_side_by_side(tmp_path: Any, monkeypatch: Any) -> None:
    """So that the default takes the fast way and the comparison above means something."""
    random = Random(1)
    maker = TraceMaker(Style(False, False, False, False), random)
    trace = maker.write(tmp_path / "trace", packets=400)
    count = 0
    sizes = steps.Steps.sizes

    def counted(self: Any, positions: Any) -> Any:
        nonlocal count
        count += 1
        return sizes(self, positions)

    monkeypatch.setattr(steps.Steps, "sizes", counted)
    fast = read(trace)
    assert count > 0
    monkeypatch.setattr(events, "scan_lockstep", ONE_BY_ONE)
    assert not differences(fast, read(trace))


def numbers(count: int, long_at: int = -1) -> TraceContent:
    """Return a trace of one packet with so many events, one of which may be very long."""
    happened = [
        Event(n * 10, "test:blob", (n, b"\1" * 40_000))
        if n == long_at
        else Event(n * 10, "test:number", (n * 0x9E3779B97F4A7C15 % 2**64,))
        for n in range(count)
    ]
    kinds = {
        "test:other": {},
        "test:number": {"n": "u64"},
        "test:blob": {"n": "u32", "blob": "u8[]"},
    }
    return TraceContent(kinds, {0: [Packet(happened)]})


@pytest.fixture
def looked_at_alone(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return where packets, or parts of them, are read one event after the other."""
    begins: list[int] = []
    scan_until = scan.scan_until

    def noted(layout: Any, memory: Any, span: Any, position: int, until: int) -> Any:
        begins.append(position - span.base)
        return scan_until(layout, memory, span, position, until)

    monkeypatch.setattr(scan, "scan_until", noted)
    monkeypatch.setattr(lockstep, "scan_until", noted)
    monkeypatch.setattr(lockstep, "NARROWEST", 2)
    monkeypatch.setattr(events, "scan_lockstep", partial(lockstep.scan_lockstep, narrowest=2))
    return begins


def test_a_large_packet_is_read_side_by_side(tmp_path: Path, looked_at_alone: list[int]) -> None:
    """Every guess is right: what is read alone are rests of lanes, the last of all."""
    trace = write_trace(tmp_path / "trace", numbers(20_000))
    fast = read(trace)
    assert len(looked_at_alone) <= 1
    assert len(fast.rows["test:number"]) == 20_000


def test_a_wrong_guess_costs_its_lane_alone(
    tmp_path: Path, looked_at_alone: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What comes after it joins the next lane that begins at an event."""
    guess = lanes._guess

    def one_wrong(*given: Any) -> Any:
        begins, owners = guess(*given)
        begins[50] += 1
        return begins, owners

    monkeypatch.setattr(lanes, "_guess", one_wrong)
    trace = write_trace(tmp_path / "trace", numbers(20_000))
    fast = read(trace)
    assert 1 <= len(looked_at_alone) <= 2
    monkeypatch.setattr(events, "scan_lockstep", ONE_BY_ONE)
    assert not differences(fast, read(trace))


def test_an_event_longer_than_a_lane(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lanes that seem to begin within it are left out."""
    trace = write_trace(tmp_path / "trace", numbers(20_000, long_at=9_000))
    fast = read(trace)
    monkeypatch.setattr(events, "scan_lockstep", ONE_BY_ONE)
    assert not differences(fast, read(trace))
    assert len(fast.rows["test:blob"]) == 1


def test_damage_in_a_large_packet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Events in front of it are kept, and lanes behind it do not count."""
    trace = write_trace(tmp_path / "trace", numbers(20_000))
    file = trace / "channel_0"
    data = bytearray(file.read_bytes())
    data[400_000:400_100] = b"\xff" * 100
    file.write_bytes(data)
    fast = read(trace)
    assert len(fast.damages) == 1
    assert 0 < len(fast.rows["test:number"]) < 11_000
    monkeypatch.setattr(events, "scan_lockstep", ONE_BY_ONE)
    slow = read(trace)
    assert not differences(fast, slow)
    assert fast.damages == slow.damages


def test_packets_without_events(tmp_path: Path) -> None:
    """Nothing is split where there is nothing."""
    empty = TraceContent({"test:number": {"n": "u64"}}, {0: [Packet(begin=1), Packet(begin=2)]})
    assert "test:number" not in read(write_trace(tmp_path / "trace", empty)).rows
