"""Tasks for workers and their outcomes: plain values, which can be sent to any machine."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

# Variables with secrets, which messages of libraries could repeat.
_SECRETS = ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN")
_MEGABYTE = 1_000_000


class Reason(StrEnum):
    """Why a recording failed."""

    BROKEN = "broken"
    TOO_LARGE = "too_large"
    TIMEOUT = "timeout"
    CHANGED = "changed"
    SAME_PACKETS = "same_packets"
    UNREACHABLE = "unreachable"
    NO_SPACE = "no_space"
    NO_SCRATCH = "no_scratch"
    CRASHED = "crashed"
    WORKER_LOST = "worker_lost"
    ERROR = "error"


# Another try may succeed although nothing has been changed.
PASSING = frozenset(
    {
        Reason.CHANGED,
        Reason.UNREACHABLE,
        Reason.NO_SPACE,
        Reason.CRASHED,
        Reason.WORKER_LOST,
        Reason.ERROR,
    }
)


@dataclass(frozen=True)
class Task:
    """One recording to ingest, with options.

    Attributes:
        index: number of the recording in the call.
        source: address of the recording.
        lake: address of the lake.
        options: of the ingest: reader, strict, ignore, events, clock_sync.
        views: write the public views.
        database: write the database.
        timeout: most seconds.
        most_memory: most bytes of memory; None for no limit.
        scratch: folder for temporary files; that of the system when None.
        memory: estimated bytes of memory.
        disk: estimated bytes of scratch space.
    """

    index: int
    source: str
    lake: str
    options: dict[str, Any] = field(default_factory=dict)
    views: bool = False
    database: bool = True
    timeout: float = 3600.0
    most_memory: int | None = None
    scratch: str | None = None
    memory: int = 0
    disk: int = 0

    def as_dict(self) -> dict[str, Any]:
        """Return the attributes, as values for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class Outcome:
    """The outcome of a task.

    Attributes:
        values: columns of the table `run`; None after a failure.
        reason: kind of failure.
        stage: what the task was doing.
        error: what went wrong.
        hint: what to do about it.
        signature: of the source, if known.
        seconds: duration.
        worker: machine and process.
    """

    values: dict[str, Any] | None = None
    reason: str = ""
    stage: str = ""
    error: str = ""
    hint: str | None = None
    signature: str | None = None
    seconds: float = 0.0
    worker: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return the attributes, as values for JSON."""
        return asdict(self)


def needs(size: int, *, is_archive: bool, is_remote: bool) -> tuple[int, int]:
    """Estimate (memory, disk) that a recording needs, in bytes; see docs/fleet.md#sizing."""
    unpacked = size * 8 if is_archive else size
    copied = (size if is_remote else 0) + (unpacked if is_archive else 0)
    return 1_200 * _MEGABYTE + unpacked * 3 // 2, 100 * _MEGABYTE + copied + 3 * unpacked


def without_secrets(text: str) -> str:
    """Return a text without credentials of the environment."""
    for name in _SECRETS:
        value = os.environ.get(name)
        if value and len(value) > 3:
            text = text.replace(value, "…")
    return text
