"""Damaged and unusual input through bt2: a clear error, what came before it delivered."""

from __future__ import annotations

import struct
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace
from msgflow.errors import ExitCode, TraceError, UsageError
from msgflow.trace import PACKET, EventBatch, TraceSet

Open = Callable[..., TraceSet]

PACKET_COUNT = 10
EVENTS_PER_PACKET = 50
HEADER_SIZE = 84


@pytest.fixture
def open_traces(bt2_bindings: Any) -> Open:
    return lambda *paths: msgflow.trace.open(paths, reader="bt2")


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    """Ten packets of fifty events."""
    packets = [
        Packet([Event(n * 100 + i, "ros2:x", (n,)) for i in range(EVENTS_PER_PACKET)])
        for n in range(PACKET_COUNT)
    ]
    return write_trace(tmp_path / "trace", TraceContent({"ros2:x": {"n": "u64"}}, {0: packets}))


def change(trace: Path, edit: Callable[[bytearray], bytes | bytearray | None]) -> None:
    stream = trace / "channel_0"
    content = bytearray(stream.read_bytes())
    stream.write_bytes(edit(content) or content)


def packet_size(trace: Path) -> int:
    return (trace / "channel_0").stat().st_size // PACKET_COUNT


def read(traces: TraceSet) -> tuple[list[EventBatch], TraceError]:
    """Read until it fails."""
    batches: list[EventBatch] = []
    with pytest.raises(TraceError) as caught:
        batches.extend(traces.batches())
    return batches, caught.value


def test_stream_cut_off(trace: Path, open_traces: Open) -> None:
    change(trace, lambda content: content[:-70])
    with pytest.raises(
        TraceError, match=f"damaged or incomplete: .* — {trace}/channel_0\n"
    ) as caught:
        open_traces(trace)
    assert caught.value.exit_code is ExitCode.TRACE
    assert "copy it again" in (caught.value.hint or "")


@pytest.mark.parametrize("size", [1, 40, 100])
def test_stream_of_a_few_bytes(trace: Path, open_traces: Open, size: int) -> None:
    change(trace, lambda content: content[:size])
    with pytest.raises(TraceError, match=str(trace)):
        open_traces(trace)


def test_damage_in_the_middle(trace: Path, open_traces: Open) -> None:
    """An event class that does not exist, in the sixth packet."""
    offset = 5 * packet_size(trace) + HEADER_SIZE
    change(trace, lambda content: struct.pack_into("<H", content, offset, 999))
    with open_traces(trace) as traces:
        batches, error = read(traces)
    rows = dict.fromkeys(("ros2:x", PACKET), 0)
    for batch in batches:
        rows[batch.name] += batch.batch.num_rows
    assert rows == {"ros2:x": 5 * EVENTS_PER_PACKET, PACKET: 5}
    assert str(trace) in error.message
    assert "; 250 events were read before" in error.message
    assert "0x" not in error.message
    assert "copy it again" in (error.hint or "")


def test_damage_names_the_trace(tmp_path: Path, trace: Path, open_traces: Open) -> None:
    other = TraceContent({"ros2:x": {}}, {0: [Packet([Event(1, "ros2:x")])]})
    write_trace(tmp_path / "another", other)
    offset = 5 * packet_size(trace) + HEADER_SIZE
    change(trace, lambda content: struct.pack_into("<H", content, offset, 999))
    with open_traces(tmp_path) as traces:
        _, error = read(traces)
    assert f"— {trace};" in error.message


def test_damaged_packet_header(trace: Path, open_traces: Open) -> None:
    """Once the way in which libbabeltrace2 ends the whole process."""
    offset = 5 * packet_size(trace)
    change(trace, lambda content: struct.pack_into("<I", content, offset, 0xDEADBEEF))
    with pytest.raises(TraceError, match=r"damaged or incomplete: .*magic"):
        open_traces(trace)


def test_file_that_does_not_belong_there(trace: Path, open_traces: Open) -> None:
    (trace / "notes.txt").write_text("what I did that day")
    with pytest.raises(TraceError, match=f"damaged or incomplete: .* — {trace}/notes.txt\n"):
        open_traces(trace)


def test_metadata_that_ends_early(trace: Path, open_traces: Open) -> None:
    text = (trace / "metadata").read_text()
    (trace / "metadata").write_text(text[: len(text) // 2])
    with pytest.raises(TraceError, match=str(trace)):
        open_traces(trace)


def test_ctf2_needs_a_newer_library(
    trace: Path, bt2_bindings: Any, open_traces: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    (trace / "metadata").write_bytes(b'\x1e{"type": "preamble", "version": 2}\n')
    monkeypatch.setattr(bt2_bindings, "__version__", "2.0.4")
    message = f"the trace is CTF 2, which needs babeltrace2 2.1 or newer, here is 2.0.4 — {trace}"
    with pytest.raises(TraceError, match=message) as caught:
        open_traces(trace)
    assert "--trace-format=ctf-1.8" in (caught.value.hint or "")


def test_nothing_is_said_behind_our_back(
    trace: Path, open_traces: Open, capfd: pytest.CaptureFixture[str]
) -> None:
    offset = 5 * packet_size(trace) + HEADER_SIZE
    change(trace, lambda content: struct.pack_into("<H", content, offset, 999))
    with open_traces(trace) as traces:
        read(traces)
    assert capfd.readouterr() == ("", "")


def test_unknown_reader(trace: Path) -> None:
    with pytest.raises(UsageError, match="there is no reader 'babeltrace1'") as caught:
        msgflow.trace.open([trace], reader="babeltrace1")
    assert "auto" in (caught.value.hint or "")


def test_the_trace_is_not_touched(trace: Path, open_traces: Open) -> None:
    def state() -> dict[str, tuple[bytes, int]]:
        return {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in trace.iterdir()}

    before = state()
    with open_traces(trace) as traces:
        list(traces.batches())
    assert state() == before


class TestInterrupt:
    """Ctrl-C arrives wherever Python happens to be."""

    def test_while_babeltrace_calls_us(self, trace: Path, open_traces: Open) -> None:
        calls = 0

        def interrupt(frame: FrameType, event: str, argument: Any) -> None:
            nonlocal calls
            # Babeltrace calls the method of this name for each message.
            calls += event == "call" and frame.f_code.co_name == "_user_consume"
            if calls == 20:
                raise KeyboardInterrupt

        with open_traces(trace) as traces:
            sys.setprofile(interrupt)
            try:
                with pytest.raises(KeyboardInterrupt):
                    list(traces.batches())
            finally:
                sys.setprofile(None)
            assert calls == 20
            assert sum(b.batch.num_rows for b in traces.batches({})) == PACKET_COUNT

    def test_in_the_consumer(self, trace: Path, open_traces: Open) -> None:
        def interrupted(traces: TraceSet) -> None:
            for _ in traces.batches(batch_rows=10):
                raise KeyboardInterrupt

        with open_traces(trace) as traces:
            with pytest.raises(KeyboardInterrupt):
                interrupted(traces)
            events = sum(b.batch.num_rows for b in traces.batches() if b.name == "ros2:x")
        assert events == PACKET_COUNT * EVENTS_PER_PACKET
