"""Limits of what is read, from both sides."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace
from msgflow.trace import extraction, metadata_frame

KIB = 1 << 10
BLOCK = 4 * KIB


def trace_with_packet(directory: Path, size: int) -> Path:
    """A trace of one packet that says it has so many bytes; return its stream."""
    packet = Packet([Event(12, "ros2:x")], begin=10, end=20)
    trace = write_trace(directory / "trace", TraceContent({"ros2:x": {}}, {0: [packet]}))
    stream = trace / "channel_0"
    content = bytearray(stream.read_bytes())
    struct.pack_into("<QQ", content, 48, 8 * size, 8 * size)
    stream.write_bytes(content)
    return stream


def damage(stream: Path) -> str:
    """What is said of the stream."""
    with msgflow.trace.open([stream.parent], reader="msgflow") as traces:
        list(traces.batches())
        return "; ".join(found.message for found in traces.damages)


@pytest.mark.parametrize(("more", "message"), [(0, "ends within"), (1, "too large to be read")])
def test_packets_of_a_gibibyte(tmp_path: Path, more: int, message: str) -> None:
    assert message in damage(trace_with_packet(tmp_path, (1 << 30) + more))


@pytest.mark.parametrize(("length", "is_hole"), [(64 * KIB - BLOCK, False), (64 * KIB, True)])
def test_holes_of_64_kibibytes(tmp_path: Path, length: int, is_hole: bool) -> None:
    stream = trace_with_packet(tmp_path, 256 * KIB)
    begin = stream.read_bytes().ljust(BLOCK, b"\xff")
    with stream.open("wb") as file:
        file.write(begin)
        file.seek(length, os.SEEK_CUR)
        file.write(b"\xff" * (256 * KIB - BLOCK - length))
    if stream.stat().st_blocks * 512 >= stream.stat().st_size:
        pytest.skip("this file system has no holes")
    assert ("has a hole" in damage(stream)) is is_hole


def test_metadata_of_64_mebibytes(tmp_path: Path) -> None:
    path = tmp_path / "metadata"
    path.touch()
    os.truncate(path, 64 << 20)
    assert len(metadata_frame.content_of(tmp_path)) == 64 << 20
    os.truncate(path, (64 << 20) + 1)
    with pytest.raises(OSError, match=r"67,108,865 bytes, more than the 67,108,864"):
        metadata_frame.content_of(tmp_path)


@pytest.mark.parametrize(
    ("packed", "limit"), [(0, 1 << 30), (1 << 24, 1 << 30), ((1 << 24) + 1, (1 << 30) + 64)]
)
def test_archives_of_a_gibibyte_or_64_times_their_size(packed: int, limit: int) -> None:
    assert extraction.limit_of(packed) == limit
