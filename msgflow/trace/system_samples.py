"""Samples of the system beside a recording, as `msgflow record` writes them: packed lines."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path

from msgflow.trace.discovery import SYSTEM_SAMPLES, directories
from msgflow.trace.regular_file import open_regular

_BEGIN = b"msgflow usage 1\t"
# What zlib calls a file of gzip.
_GZIP = 31
_PIECE = 1 << 16
_MOST_AT_ONCE = 1 << 20
# What a damaged file may take: a robot of sixty threads writes as much in half a day.
_MOST_LINES = 1 << 25
_LONGEST_LINE = 1 << 12


def system_sample_files(paths: Sequence[str | Path]) -> list[Path]:
    """Return the files of samples of the system below some folders."""
    roots = [root for root in map(Path, paths) if root.is_dir()]
    return sorted(
        {
            folder / SYSTEM_SAMPLES
            for root in roots
            for folder, files in directories(root)
            if SYSTEM_SAMPLES in files
        }
    )


def read_system_samples(file: Path, damages: list[str]) -> Iterator[list[str]]:
    """Yield the lines of a file, some at a time; `damages` gets what is left out, as sentences."""
    unpack = zlib.decompressobj(_GZIP)
    rest, count, too_long = b"", 0, 0
    try:
        with open_regular(file) as stream:
            while not unpack.eof:
                piece = unpack.unconsumed_tail or stream.read(_PIECE)
                text = unpack.decompress(piece, _MOST_AT_ONCE)
                if not piece and not text:
                    damages.append("it ends early: its recording was killed, or it is not over")
                    break
                *lines, rest = (rest + text).split(b"\n")
                # Enough of it to know that it is too long.
                rest = rest[: _LONGEST_LINE + 1]
                whole = [line for line in lines if len(line) <= _LONGEST_LINE]
                too_long += len(lines) - len(whole)
                if whole and not count and not whole[0].startswith(_BEGIN):
                    damages.append("it has no samples of the system, or those of a later msgflow")
                    break
                count += len(whole)
                if count > _MOST_LINES:
                    damages.append(f"only the first {_MOST_LINES:,} of its lines are used")
                    break
                if whole:
                    plain = b"\n".join(whole).replace(b"\0", b"").decode(errors="replace")
                    yield plain.split("\n")
    except OSError as error:
        damages.append(f"it cannot be read: {error.strerror or error}")
    except zlib.error:
        damages.append(f"it is damaged behind its first {count:,} lines")
    if too_long:
        damages.append(f"{too_long:,} of its lines are too long, and left out")
