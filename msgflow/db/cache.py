"""What is the same for all databases and takes long to make, kept in the user's cache.

It belongs to a version of DuckDB, to the files of `schema/` and to what declares the tables.
Nothing depends on it: where it cannot be written, is damaged or missing, it is made again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb

from msgflow.db.objects import definition_hash, head_revision
from msgflow.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable

_MOST_OF_A_KIND = 8


def made_once(kind: str, made_by: str, make: Callable[[], Any]) -> Any:
    """Return what was kept, as JSON, or make it and keep it.

    Args:
        kind: what it is.
        made_by: what else it depends on.
        make: what makes it where it is not kept.
    """
    content = read(kind, made_by)
    if content is None:
        content = json.dumps(make()).encode()
        keep(kind, made_by, content)
    return json.loads(content)


def read(kind: str, made_by: str) -> bytes | None:
    """Return what was kept, None where that is not whole.

    Args:
        kind: what it is.
        made_by: what else it depends on.
    """
    try:
        digest, content = _file(kind, made_by).read_bytes().split(b"\n", 1)
    except (OSError, ValueError, RuntimeError):  # the last: there is no home directory
        return None
    return content if hashlib.sha256(content).hexdigest().encode() == digest else None


def is_usable() -> bool:
    """Tell whether something can be kept, so that what only saves time is worth its making."""
    try:
        directory = _file("", "").parent
        directory.mkdir(parents=True, exist_ok=True)
        return os.access(directory, os.W_OK)
    except (OSError, RuntimeError):
        return False


def keep(kind: str, made_by: str, content: bytes) -> None:
    """Keep something, if possible."""
    with contextlib.suppress(OSError, RuntimeError):
        path = _file(kind, made_by)
        path.parent.mkdir(parents=True, exist_ok=True)
        aside = path.with_suffix(f".{os.getpid()}.part")
        try:
            aside.write_bytes(hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
            aside.replace(path)
        finally:
            aside.unlink(missing_ok=True)
        kept = sorted(path.parent.glob(f"{kind}-*"), key=lambda old: old.stat().st_mtime)
        for old in kept[:-_MOST_OF_A_KIND]:
            old.unlink()


def _file(kind: str, made_by: str) -> Path:
    given = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME")
    root = Path(given) if given and os.path.isabs(given) else Path("~/.cache").expanduser()
    made_of = "\0".join((__version__, head_revision(), definition_hash(), made_by))
    key = hashlib.sha256(made_of.encode()).hexdigest()[:32]
    return root / "msgflow" / f"{kind}-{duckdb.__version__}-{key}"
