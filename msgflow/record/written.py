"""How much of a recording is on the disk already."""

from __future__ import annotations

import os
from pathlib import Path

from msgflow.trace.ctf.packet_index import content_bytes


def recorded_bytes(directory: Path) -> int:
    """Return the bytes of all packets that are written, without what only fills them up."""
    # A chunk of it may go away meanwhile: unlike others, this walk goes on.
    return sum(
        content_bytes(Path(folder, name))
        for folder, _, names in os.walk(directory)
        for name in names
        if name.endswith(".idx")
    )
