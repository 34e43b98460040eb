"""How much of a recording is on the disk already."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.trace.ctf.packet_index import content_bytes

if TYPE_CHECKING:
    from pathlib import Path


def recorded_bytes(directory: Path) -> int:
    """Return the bytes of all packets that are written, without what only fills them up."""
    return sum(content_bytes(path) for path in directory.rglob("*.idx"))
