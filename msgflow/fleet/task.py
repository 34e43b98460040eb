"""Tasks for workers and their outcomes: plain values, which can be sent to any machine."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

# Variables with secrets, which messages of libraries could repeat.
_SECRETS = ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN")
_MEGABYTE = 1_000_000
# Files in which the process of a task says what it is doing, and its outcome.
STAGE, RESULT = "stage", "result.json"


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


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options for all recordings."""

    # Options of the ingest: reader, strict, ignore, events, clock_sync.
    ingest: dict[str, Any] = field(default_factory=dict)
    views: bool = False  # also write the public views
    database: bool = True  # also write the database
    replace: bool = False  # ingest recordings again that the lake has already
    retry_failed: bool = False  # ingest recordings again that failed before
    tries: int = 3  # most tries of a recording, if another one may succeed
    pause: float = 2.0  # seconds before the second try; twice as many before each further one
    timeout: float = 3600.0  # most seconds of one recording
    memory: int | None = None  # most bytes of one recording
    scratch: str | None = None  # folder of each worker for temporary files, absolute


@dataclass(frozen=True)
class Task(Options):
    """One recording to ingest, with the options of all."""

    index: int  # number of the recording in the call
    source: str  # address of the recording
    lake: str  # address of the lake
    needed_memory: int = 0  # estimated bytes
    needed_disk: int = 0  # estimated bytes of scratch space


@dataclass(frozen=True)
class Outcome:
    """The outcome of a task."""

    values: dict[str, Any] | None = None  # columns of the table `run`; None after a failure
    reason: str = ""
    stage: str = ""  # what the task was doing
    error: str = ""  # what went wrong
    hint: str | None = None
    signature: str | None = None  # of the source, if known
    seconds: float = 0.0
    worker: str = ""  # machine and process


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
