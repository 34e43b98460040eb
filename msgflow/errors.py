"""Errors that a user can cause, each with a hint and an exit code."""

from __future__ import annotations

from enum import IntEnum
from pathlib import Path


class ExitCode(IntEnum):
    """What the process returns; part of the interface."""

    OK = 0
    FAILED = 1
    USAGE = 2
    TRACE = 3
    DATABASE = 4
    NOT_MEASURED = 5
    INTERRUPTED = 130
    TERMINATED = 143


class MsgflowError(Exception):
    """Something that the user can put right.

    Attributes:
        message: what went wrong and with which object, one sentence without a full stop.
        hint: the command to run or the thing to check, or None.
        exit_code: what the command line returns.
    """

    exit_code: ExitCode = ExitCode.FAILED

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return self.message if self.hint is None else f"{self.message}\n\nhint: {self.hint}"


class QueryError(MsgflowError):
    """The database could not run a query or other SQL."""


class UsageError(MsgflowError):
    """The command or call itself is wrong: a name, parameter or value that does not exist."""

    exit_code = ExitCode.USAGE


class NoFlowError(UsageError):
    """Data arrive nowhere in what is read, so that there is nothing to explain."""


class TraceError(MsgflowError):
    """A trace is missing, unreadable, or holds nothing that msgflow can use."""

    exit_code = ExitCode.TRACE


class RecordingError(MsgflowError):
    """A recording cannot begin or go on: LTTng, its daemon, the disk, or a program is missing."""


class DatabaseError(MsgflowError):
    """A database is missing, locked, foreign, or of another schema revision."""

    exit_code = ExitCode.DATABASE


class DatabaseInUseError(DatabaseError):
    """Another process has the database open."""


def require_utf8(name: str | Path, kind: type[MsgflowError] = UsageError) -> None:
    """Raise an error of this kind unless a name is UTF-8: databases hold no other ones.

    The system takes any bytes. Python gives one that is not UTF-8 as half of a surrogate pair.
    """
    try:
        str(name).encode()
    except UnicodeEncodeError:
        shown = str(name).encode(errors="surrogateescape").decode(errors="backslashreplace")
        raise kind(f"not UTF-8 — {shown}", "give it a name in UTF-8 first") from None
