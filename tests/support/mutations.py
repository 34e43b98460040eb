"""Damages traces at random: cuts, flipped bits, swapped files."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from random import Random

Mutation = Callable[[Path, Random], str]
"""Changes the trace in a directory and says how."""


def cut_stream(trace: Path, random: Random) -> str:
    path = random.choice(streams(trace))
    size = random.randrange(path.stat().st_size)
    path.write_bytes(path.read_bytes()[:size])
    return f"{path.name} cut to {size}"


def flip_stream(trace: Path, random: Random) -> str:
    """Anywhere in a stream."""
    return _flip(random.choice(streams(trace)), random)


def flip_header(trace: Path, random: Random) -> str:
    """In the header or context of a packet."""
    path = random.choice(streams(trace))
    begins = packet_begins(path.read_bytes())
    begin = random.choice(begins)
    return _flip(path, random, begin, begin + 84)


def overwrite(trace: Path, random: Random) -> str:
    """Random bytes over a part of a stream."""
    path = random.choice(streams(trace))
    content = bytearray(path.read_bytes())
    begin = random.randrange(len(content))
    length = random.choice([1, 4, 8, 64, 1000])
    content[begin : begin + length] = random.randbytes(min(length, len(content) - begin))
    path.write_bytes(content)
    return f"{path.name} overwritten at {begin}"


def flip_index(trace: Path, random: Random) -> str:
    indexes = sorted((trace / "index").glob("*.idx"))
    return _flip(random.choice(indexes), random) if indexes else flip_stream(trace, random)


def cut_index(trace: Path, random: Random) -> str:
    indexes = sorted((trace / "index").glob("*.idx"))
    if not indexes:
        return cut_stream(trace, random)
    path = random.choice(indexes)
    size = random.randrange(path.stat().st_size)
    path.write_bytes(path.read_bytes()[:size])
    return f"{path.name} cut to {size}"


def flip_metadata(trace: Path, random: Random) -> str:
    return _flip(trace / "metadata", random)


def cut_metadata(trace: Path, random: Random) -> str:
    path = trace / "metadata"
    size = random.randrange(path.stat().st_size)
    path.write_bytes(path.read_bytes()[:size])
    return f"metadata cut to {size}"


def swap_streams(trace: Path, random: Random) -> str:
    one, other = random.choice(streams(trace)), random.choice(streams(trace))
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)
    return f"{one.name} and {other.name} swapped"


MUTATIONS: tuple[Mutation, ...] = (
    cut_stream,
    flip_stream,
    flip_header,
    overwrite,
    flip_index,
    cut_index,
    flip_metadata,
    cut_metadata,
    swap_streams,
)


def streams(trace: Path) -> list[Path]:
    """Return the stream files that have content."""
    return sorted(
        path
        for path in trace.iterdir()
        if path.is_file() and path.name != "metadata" and path.stat().st_size
    )


def packet_begins(content: bytes) -> list[int]:
    begins = []
    for magic in (struct.pack("<I", 0xC1FC1FC1), struct.pack(">I", 0xC1FC1FC1)):
        at = content.find(magic)
        while at >= 0:
            begins.append(at)
            at = content.find(magic, at + 1)
    return begins or [0]


def _flip(path: Path, random: Random, begin: int = 0, end: int | None = None) -> str:
    content = bytearray(path.read_bytes())
    at = random.randrange(begin, min(end or len(content), len(content)))
    content[at] ^= 1 << random.randrange(8)
    path.write_bytes(content)
    return f"{path.name} flipped at {at}"
