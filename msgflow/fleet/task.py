"""What is asked of a worker, and what it answers: plain values, so that they go anywhere."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

# Secrets that a message of a library could repeat.
_SECRETS = ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN")
_MEGABYTE = 1_000_000


class Reason(StrEnum):
    """Why a recording did not go in."""

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


# What may go well the next time, without anything having been changed.
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
    """One recording, and how it is to be done.

    Attributes:
        index: which of the recordings.
        source: address of the recording.
        lake: address of the lake.
        options: of the ingest: reader, strict, ignore, clock_sync.
        views: write the public views.
        database: write the database.
        timeout: seconds that it may take.
        most_memory: bytes that it may take; None: what the machine has.
        scratch: folder for what it needs meanwhile; None: that of the system.
        memory: bytes that it will need, as far as can be told from outside.
        disk: bytes of scratch space, likewise.
        edition: told apart from what was written of the same recording before.
    """

    index: int
    source: str
    lake: str
    options: dict[str, Any] = field(default_factory=dict)
    views: bool = True
    database: bool = True
    timeout: float = 3600.0
    most_memory: int | None = None
    scratch: str | None = None
    memory: int = 0
    disk: int = 0
    edition: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return it as values that JSON can hold."""
        return asdict(self)


@dataclass(frozen=True)
class Outcome:
    """What came of a task.

    Attributes:
        values: of columns of the table `run`, where all went well; else None.
        reason: what kind of failure.
        stage: what was being done.
        error: what went wrong, in words.
        hint: what to do about it.
        signature: of the source, where it was looked at.
        seconds: how long it took.
        worker: machine that did it.
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
        """Return it as values that JSON can hold."""
        return asdict(self)


def needs(size: int, *, is_archive: bool, is_remote: bool) -> tuple[int, int]:
    """Return (memory, disk) that a recording will need, bytes; see docs/fleet.md#sizing.

    Args:
        size: bytes of the source.
        is_archive: it is packed: traces become some eight times smaller.
        is_remote: it is copied to this machine first.
    """
    unpacked = size * 8 if is_archive else size
    copied = (size if is_remote else 0) + (unpacked if is_archive else 0)
    return 1_200 * _MEGABYTE + unpacked * 3 // 2, 100 * _MEGABYTE + copied + 3 * unpacked


def without_secrets(text: str) -> str:
    """Return a text without what the environment has of credentials."""
    for name in _SECRETS:
        value = os.environ.get(name)
        if value and len(value) > 3:
            text = text.replace(value, "…")
    return text
