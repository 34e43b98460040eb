"""Archives of traces, recognised by the names of their files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

SUFFIXES = (".tar", ".tar.gz", ".tgz", ".tar.zst", ".tzst", ".tar.xz", ".txz", ".zip")
"""How the names of archives end that can be read."""


def is_archive(path: Path) -> bool:
    """Tell whether this is a file with the name of an archive that can be read."""
    return path.name.lower().endswith(SUFFIXES) and path.is_file()


def stem(path: Path) -> str:
    """Return the name of an archive without its suffix, that of anything else as it is."""
    if not is_archive(path):
        return path.name
    suffix = max((end for end in SUFFIXES if path.name.lower().endswith(end)), key=len)
    return path.name[: -len(suffix)]


def shown(path: Path, unpacked: Mapping[Path, Path]) -> Path | None:
    """Return a path as it is in its archive, given where archives were unpacked; None: in none."""
    for directory, archive in unpacked.items():
        if path.is_relative_to(directory):
            return archive / path.relative_to(directory)
    return None
