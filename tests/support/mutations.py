"""Damages traces, archives and other files at random: cuts, flips, copies, absurd values."""

from __future__ import annotations

import errno
import os
import re
import shutil
import struct
from collections.abc import Callable
from pathlib import Path
from random import Random

Mutation = Callable[[Path, Random], str]
"""Changes the trace in a directory and says how."""


def cut_stream(trace: Path, random: Random) -> str:
    path = random.choice(streams(trace))
    size = random.randrange(path.stat().st_size)
    path.write_bytes(_content(path)[:size])
    return f"{path.name} cut to {size}"


def flip_stream(trace: Path, random: Random) -> str:
    """Anywhere in a stream."""
    return _flip(random.choice(streams(trace)), random)


def flip_header(trace: Path, random: Random) -> str:
    """In the header or context of a packet."""
    path = random.choice(streams(trace))
    begins = packet_begins(_content(path))
    begin = random.choice(begins)
    return _flip(path, random, begin, begin + 84)


def overwrite(trace: Path, random: Random) -> str:
    """Random bytes over a part of a stream."""
    path = random.choice(streams(trace))
    content = bytearray(_content(path))
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
    path.write_bytes(_content(path)[:size])
    return f"{path.name} cut to {size}"


def flip_metadata(trace: Path, random: Random) -> str:
    return _flip(trace / "metadata", random)


def cut_metadata(trace: Path, random: Random) -> str:
    path = trace / "metadata"
    size = random.randrange(path.stat().st_size)
    path.write_bytes(_content(path)[:size])
    return f"metadata cut to {size}"


def swap_streams(trace: Path, random: Random) -> str:
    one, other = random.choice(streams(trace)), random.choice(streams(trace))
    first, second = _content(one), _content(other)
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


# What these change may be payload, or names, which nothing protects.
ANYWHERE: set[Mutation] = {flip_stream, overwrite, flip_metadata}

_MOST_BYTES = 256 << 20
ABSURD = (0, 1, (1 << 31) - 1, 1 << 32, 1 << 48, 1 << 62, 1 << 63, (1 << 64) - 1, (1 << 64) - 5)


def put_in_header(trace: Path, random: Random) -> str:
    """An absurd value in the context of a packet."""
    path = random.choice(streams(trace))
    content = bytearray(_content(path))
    begin = random.choice(packet_begins(bytes(content)))
    at = begin + random.choice((24, 32, 40, 48, 56, 64, 72, 76))
    value = random.choice(ABSURD)
    struct.pack_into("<Q", content, at, value)
    path.write_bytes(content)
    return f"{value} at {at} of {path.name}"


def put_in_event(trace: Path, random: Random) -> str:
    """An absurd value anywhere in a stream."""
    path = random.choice(streams(trace))
    content = bytearray(_content(path))
    at = random.randrange(len(content) - 8)
    value = random.choice(ABSURD)
    struct.pack_into("<Q", content, at, value)
    path.write_bytes(content)
    return f"{value} at {at} of {path.name}"


def put_in_metadata(trace: Path, random: Random) -> str:
    """An absurd number in the metadata."""
    path = trace / "metadata"
    content = _content(path)
    numbers = list(re.finditer(rb"(?<=[ =\[(-])\d+(?=[;\]) ])", content))
    if not numbers:
        return flip_metadata(trace, random)
    number = random.choice(numbers)
    value = random.choice((*map(str, ABSURD), "-1", "9" * 5000, "0x" + "f" * 40, "'ab'"))
    path.write_bytes(content[: number.start()] + value.encode() + content[number.end() :])
    return f"{value[:30]} in place of {number.group().decode()}, byte {number.start()} of metadata"


def copy_stream(trace: Path, random: Random) -> str:
    path = random.choice(streams(trace))
    shutil.copy(path, path.with_name(path.name + "-copy"))
    return f"{path.name} copied"


def copy_packet(trace: Path, random: Random) -> str:
    """Behind the end of its file."""
    path = random.choice(streams(trace))
    content = _content(path)
    begin, end = random.choice(_packets(content))
    path.write_bytes(content + content[begin:end])
    return f"bytes {begin} to {end} of {path.name} copied to its end"


def drop_packet(trace: Path, random: Random) -> str:
    path = random.choice(streams(trace))
    content = _content(path)
    begin, end = random.choice(_packets(content))
    path.write_bytes(content[:begin] + content[end:])
    return f"bytes {begin} to {end} of {path.name} left out"


def zero(trace: Path, random: Random) -> str:
    """A block that the disk lost."""
    path = random.choice(streams(trace))
    content = bytearray(_content(path))
    begin = random.randrange(len(content)) // 512 * 512
    length = len(content[begin : begin + 4096])
    content[begin : begin + length] = bytes(length)
    path.write_bytes(content)
    return f"zeros at {begin} of {path.name}"


def make_sparse(trace: Path, random: Random) -> str:
    path = random.choice([*streams(trace), trace / "metadata"])
    size = path.stat().st_size + random.choice((1, 5000, 1 << 20, 1 << 33))
    os.truncate(path, size)
    return f"{path.name} grown to {size}"


def make_irregular(trace: Path, random: Random) -> str:
    path = random.choice([*streams(trace), trace / "metadata"])
    path.unlink()
    kind = random.choice(("pipe", "circle", "nowhere", "directory", "zeros"))
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "directory":
        path.mkdir()
    else:
        targets = {"circle": path.name, "nowhere": "nowhere", "zeros": "/dev/zero"}
        path.symlink_to(targets[kind])
    return f"{path.name} is {kind}"


def move_stream(trace: Path, random: Random) -> str:
    """Renaming a stream is no matter."""
    path = random.choice(streams(trace))
    path.rename(path.with_name(f"moved-{path.name}"))
    return f"{path.name} renamed"


def drop_metadata(trace: Path, random: Random) -> str:
    (trace / "metadata").rename(trace / random.choice(("metadata.bak", "Metadata", "meta")))
    return "metadata renamed"


STRUCTURAL: tuple[Mutation, ...] = (
    put_in_header,
    put_in_event,
    put_in_metadata,
    copy_stream,
    copy_packet,
    drop_packet,
    zero,
    make_sparse,
    make_irregular,
    move_stream,
    drop_metadata,
)
"""More of them; what they change may be payload as well, or what nothing but an index witnesses."""

ANYWHERE |= {put_in_event, put_in_metadata, zero}


def damage_file(path: Path, random: Random) -> str:
    """Change a file of any kind."""
    content = bytearray(_content(path))
    at = random.randrange(len(content))
    kind = random.choice(("flip", "flip", "cut", "overwrite", "empty"))
    if kind == "flip":
        content[at] ^= 1 << random.randrange(8)
    elif kind == "cut":
        del content[at:]
    elif kind == "overwrite":
        length = min(random.choice((1, 8, 100, 4096)), len(content) - at)
        content[at : at + length] = random.randbytes(length)
    else:
        content.clear()
    path.write_bytes(content)
    return f"{kind} at {at} of {path.name}"


damage_archive = damage_file


def damage_text(text: str, random: Random) -> tuple[bytes, str]:
    """Return a text changed, and how."""
    content = bytearray(text.encode())
    at = random.randrange(len(content))
    kind = random.choice(("flip", "cut", "insert", "number", "nest", "repeat"))
    if kind == "flip":
        content[at] ^= 1 << random.randrange(8)
    elif kind == "cut":
        del content[at:]
    elif kind == "insert":
        content[at:at] = random.choice(
            (b"[", b"{", b": ", b" = ", b'"""', b"\n", b"\x00", b"&a *a", b"!!x ", b"\xff")
        )
    elif kind == "number":
        numbers = list(re.finditer(rb"\d+", content))
        found = random.choice(numbers) if numbers else None
        begin, end = found.span() if found else (at, at)
        content[begin:end] = random.choice(
            (b"9" * 5000, b"1__0", b"-1", b"1e999", b".inf", str(1 << 63).encode(), b"0x10")
        )
    elif kind == "nest":
        odd = (b"[", b"{", b": ", b" = ", b'"""', b"\n", b"\x00", b"&a *a", b"!!x ", b"\xff")
        content[at:at] = random.choice(odd)
    elif kind == "number":
        numbers = list(re.finditer(rb"\d+", content))
        found = random.choice(numbers) if numbers else None
        begin, end = found.span() if found else (at, at)
        content[begin:end] = random.choice(
            (b"9" * 5000, b"1__0", b"-1", b"1e999", b".inf", str(1 << 63).encode(), b"0x10")
        )
    elif kind == "nest":
        content[at:at] = random.choice((b"[", b"{a: ")) * random.choice((10, 5000))
    else:
        content += content * 50
    return bytes(content), f"{kind} at {at}"


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


def _packets(content: bytes) -> list[tuple[int, int]]:
    begins = packet_begins(content)
    return list(zip(begins, [*begins[1:], len(content)], strict=True))


def _content(path: Path) -> bytes:
    """Return what a file holds.

    Raises:
        OSError: another mutation has made it endless, or no file at all.
    """
    if not path.is_file() or path.stat().st_size > _MOST_BYTES:
        raise OSError(errno.EFBIG, os.strerror(errno.EFBIG), str(path))
    return path.read_bytes()


def _flip(path: Path, random: Random, begin: int = 0, end: int | None = None) -> str:
    content = bytearray(_content(path))
    at = random.randrange(begin, min(end or len(content), len(content)))
    content[at] ^= 1 << random.randrange(8)
    path.write_bytes(content)
    return f"{path.name} flipped at {at}"
