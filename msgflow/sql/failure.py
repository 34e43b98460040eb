"""Errors of DuckDB that a file or its disk causes, in words for users."""

from __future__ import annotations

import errno
import re
import shlex
import shutil
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import duckdb

from msgflow.errors import DatabaseError, QueryError

_FULL = re.compile(r"no space left|disk quota|max_temp_directory_size|not enough space", re.I)
_REFUSED = re.compile(r"permission denied|read-only file system|operation not permitted", re.I)
# A block with a wrong checksum raises the base class of all errors.
_DAMAGE = re.compile(
    r"corrupt|checksum|deserializ|invalid unicode|could not read|failed to load metadata", re.I
)
# DuckDB 2.0 sometimes fails when dictionaries of strings pass through several joins. The same
# statement seldom fails twice (similar: duckdb/duckdb#24807).
_MISTAKE = re.compile(r"dict-surviving")
_REFUSED_KINDS = (duckdb.IOException, duckdb.TransactionException)
_OF_FILES = (*_REFUSED_KINDS, duckdb.FatalException, duckdb.OutOfMemoryException)
_DAMAGED_KINDS = (duckdb.InternalException, duckdb.FatalException, duckdb.SerializationException)

# What each kind of error means, and what to do about it.
_WORDS = {
    "full": (
        "no space left on the disk of the database ({free} free)",
        "free some, or put the database on another disk with --db; it is as it was before",
    ),
    "refused": (
        "cannot write beside the database",
        "check the permissions of its directory, or copy the database elsewhere",
    ),
    "mistaken": (
        "DuckDB {version} made a mistake: {cause}",
        "try again, then with another version of DuckDB; the database is as it was before",
    ),
    "damaged": (
        "the database is damaged: {cause}",
        "restore the file from a copy, or ingest the traces into a new one",
    ),
}


def is_of_the_file(error: BaseException) -> bool:
    """Tell whether a database file or its disk causes an error, not a statement."""
    return _kind(error) is not None


def in_words(error: BaseException, path: Path) -> DatabaseError | None:
    """Return an error of the file at `path` in our words, None if a statement causes it."""
    kind = _kind(error)
    if kind is None:
        return None
    what, hint = _WORDS[kind]
    said = what.format(free=_free(path), version=duckdb.__version__, cause=_cause(error))
    return DatabaseError(f"{said} — {path}", hint)


def out_of_memory(
    what: str, hint: str = "give more with MSGFLOW_MEMORY_LIMIT, or ask for less at a time"
) -> QueryError:
    """Return the error of a query that needs more memory than DuckDB has."""
    return QueryError(f"more memory is needed than the database may take — {what}", hint)


def out_of_range(error: Exception, what: object) -> DatabaseError:
    """Return the error of a database that no ingest has made, with whose values SQL calculates."""
    return DatabaseError(
        f"the database has values that no recording has: {first_line(error)} — {what}",
        "ingest the traces into a new one",
    )


@contextmanager
def format_errors(run: str) -> Iterator[None]:
    """Turn what a file's format cannot have into the same error, such as times before its first."""
    try:
        yield
    except (AttributeError, TypeError, ValueError, RecursionError, struct.error) as error:
        raise out_of_range(error, f"run {run}") from error


@contextmanager
def query_errors(what: str, message: str) -> Iterator[None]:
    """Turn errors of a statement into a QueryError; errors of the database file pass."""
    try:
        yield
    except duckdb.Error as error:
        if is_of_the_file(error):
            raise
        if isinstance(error, duckdb.OutOfMemoryException):
            raise out_of_memory(what) from error
        raise QueryError(message.format(first_line(error))) from error


@contextmanager
def database_errors(path: Path) -> Iterator[None]:
    """Turn errors that the file at `path` or its disk causes into a DatabaseError."""
    try:
        yield
    except duckdb.PermissionException as error:
        raise DatabaseError(
            f"a view of the database reads more than the database: {_cause(error)} — {path}",
            f"msgflow db upgrade --db {shlex.quote(str(path))} makes views and macros anew",
        ) from error
    except (duckdb.Error, OSError, UnicodeDecodeError) as error:
        words = in_words(error, path)
        if words is None:
            raise
        raise words from error


def first_line(error: Exception) -> str:
    """Return what a database error says, without its category and the quoted SQL."""
    line = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
    _, separator, text = line.partition(" Error: ")
    return (text if separator else line).rstrip(".!")


def _kind(error: BaseException) -> str | None:
    """Return what kind of error of a file or disk it is; other errors of Python name their file."""
    if isinstance(error, OSError):
        return "full" if error.errno in (errno.ENOSPC, errno.EDQUOT) else None
    if isinstance(error, UnicodeDecodeError):
        return "damaged"
    if not isinstance(error, duckdb.Error) or isinstance(error, duckdb.InterruptException):
        return None
    text = str(error)
    if isinstance(error, _OF_FILES) and _FULL.search(text):
        return "full"
    if isinstance(error, _REFUSED_KINDS) and _REFUSED.search(text):
        return "refused"
    if isinstance(error, _DAMAGED_KINDS):
        return "mistaken" if _MISTAKE.search(text) else "damaged"
    may_be_damage = type(error) is duckdb.Error or isinstance(error, duckdb.IOException)
    return "damaged" if may_be_damage and _DAMAGE.search(text) else None


def _cause(error: BaseException) -> str:
    """Return the first line of an error of the file, with its category unless that says nothing."""
    line = (str(error).strip().splitlines() or [type(error).__name__])[0]
    return line.removeprefix("INTERNAL Error: ").removeprefix("FATAL Error: ")[:200].rstrip(".")


def _free(path: Path) -> str:
    try:
        free = shutil.disk_usage(path.absolute().parent).free
    except OSError:
        return "little"
    return f"{free / 1_000_000:,.0f} MB"
