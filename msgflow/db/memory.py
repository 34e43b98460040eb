"""Memory that grows when it has to: nobody should have to guess it for a recording.

Most of what an ingest does spills to disk, but some statements have to hold all events of a
thread. What joins look up stays in memory, and some queries have hundreds of joins.
"""

from __future__ import annotations

import contextlib
import os
from typing import TYPE_CHECKING, TypeVar

import duckdb

from msgflow.errors import DatabaseError
from msgflow.sql.failure import is_of_the_file

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_T = TypeVar("_T")

DEFAULT_LIMIT = "195MB"
_LOADING_BYTES = 44_000_000
# DuckDB keeps 0.8 bytes per event beside its limit: where each part of a table is. So its limit is
# smaller for large recordings, but not so small that what joins look up no longer fits.
_LESS_PER_EVENT = 0.24
_LEAST_DEFAULT_BYTES = 172_000_000
# What DuckDB keeps of freed blocks, to use it again instead of asking the system for zeroed pages.
# As much as the limit saves a tenth of the processor time; some of it comes on top of the limit.
_KEPT_BYTES = 192_000_000
_LESS_KEPT_PER_EVENT = 1.44
_LEAST_KEPT_BYTES = 96_000_000
# With less, even opening fails.
_LEAST_BYTES = 15_000_000
# As DuckDB advises. With less for each, threads spill what fewer would not, or run short of memory.
_BYTES_PER_THREAD = 125_000_000
# Of a small limit, two make as much as one does, in less time.
_LEAST_THREADS = 2
_EXAMPLE = "--memory-limit 2GB"
# Of a limit that the user gave, if that is more.
_LOADING_SHARE = 4
_SHARE_OF_MACHINE = 0.7


class Memory:
    """The memory limit of a connection: fixed by the user, or growing from a modest default."""

    def __init__(
        self, con: duckdb.DuckDBPyConnection, limit: str | None, *, default: str = DEFAULT_LIMIT
    ) -> None:
        self._con = con
        self._is_fixed = limit is not None
        self._first = self._limit = limit or default
        self._kept = 0
        self._set(self._limit)
        limit_threads(con)

    @contextlib.contextmanager
    def loading(self) -> Iterator[None]:
        """Take less while rows are only written: the reader needs memory, too.

        Raises:
            DatabaseError: that is too little.
        """
        usual = self._bytes()
        enough = max(_LOADING_BYTES, usual // _LOADING_SHARE if self._is_fixed else 0)
        if enough < usual:
            self._con.execute("SET memory_limit = ?", [f"{enough}B"])
        try:
            yield
        except duckdb.OutOfMemoryException as error:
            if is_of_the_file(error):
                raise
            raise self._too_little() from error
        finally:
            # A database that failed for good takes no setting either.
            with contextlib.suppress(duckdb.FatalException):
                self._con.execute("SET memory_limit = ?", [self._limit])

    def keep_freed(self, events: int | None = None) -> None:
        """Let freed blocks be used again, more of them once a recording is read that is not large.

        Args:
            events: how many were read; None: that is not known yet.
        """
        more = 0 if events is None else _KEPT_BYTES - round(_LESS_KEPT_PER_EVENT * events)
        kept = min(max(more, _LEAST_KEPT_BYTES), self._bytes())
        if kept > self._kept:
            self._con.execute("SET block_allocator_memory = ?", [f"{kept}B"])
            self._kept = kept

    def make_room(self, events: int) -> None:
        """Take less for a recording of so many events; a limit that the user gave is kept."""
        enough = max(_LEAST_DEFAULT_BYTES, self._bytes() - round(_LESS_PER_EVENT * events))
        if not self._is_fixed and enough < self._bytes():
            self._set(f"{enough}B")

    @contextlib.contextmanager
    def threads(self, count: int) -> Iterator[None]:
        """Let at most so many threads do all work of the database."""
        usual = _threads(self._con)
        self._con.execute(f"SET threads = {min(usual, count)}")
        try:
            yield
        finally:
            # A database that failed for good takes no setting either.
            with contextlib.suppress(duckdb.FatalException):
                self._con.execute(f"SET threads = {usual}")

    def run(self, work: Callable[[], _T]) -> _T:
        """Return what `work` returns; it is run again with twice the memory where that was short.

        Args:
            work: something that leaves nothing behind when it fails.

        Raises:
            DatabaseError: the limit that the user gave, or the memory of the machine, is too small.
        """
        while True:
            try:
                return work()
            except duckdb.OutOfMemoryException as error:
                if is_of_the_file(error):  # nor can more be spilled
                    raise
                if not self.grow(2):
                    raise self._too_little() from error

    def grow(self, times: float) -> bool:
        """Allow so many times as much; tell whether the user and the machine let that happen."""
        if self._is_fixed:
            return False
        wanted = round(times * self._bytes())
        if wanted > _SHARE_OF_MACHINE * _machine_bytes():
            return False
        self._set(f"{wanted}B")
        return True

    def reset(self) -> None:
        """Allow as much as at first again."""
        # What is in use now cannot be taken away: then the next one who asks for this does it.
        with contextlib.suppress(duckdb.OutOfMemoryException):
            self._con.execute("SET memory_limit = ?", [self._first])
            self._limit = self._first

    def _too_little(self) -> DatabaseError:
        return DatabaseError(
            f"the traces need more memory than {self._limit}",
            "give more with --memory-limit, or read a shorter part of the recording",
        )

    def _bytes(self) -> int:
        return _limit_bytes(self._con)

    def _set(self, limit: str) -> None:
        set_memory_limit(self._con, limit)
        self._limit = limit


def set_memory_limit(con: duckdb.DuckDBPyConnection, limit: str) -> None:
    """Let a connection take so much memory.

    Raises:
        DatabaseError: that is no amount, or none that a database can work with.
    """
    try:
        con.execute("SET memory_limit = ?", [limit])
    except duckdb.OutOfMemoryException as error:
        raise DatabaseError(f"too little memory for this database — {limit}", _EXAMPLE) from error
    except duckdb.Error as error:
        raise DatabaseError(f"not an amount of memory — {limit}", _EXAMPLE) from error
    if limit.strip().startswith("-"):  # DuckDB takes it for no limit
        raise DatabaseError(f"not an amount of memory — {limit}", _EXAMPLE)
    try:
        is_enough = _limit_bytes(con) >= _LEAST_BYTES
    except duckdb.OutOfMemoryException:  # not even for that question
        is_enough = False
    if not is_enough:
        raise DatabaseError(f"too little memory for any database — {limit}", _EXAMPLE)


def limit_threads(con: duckdb.DuckDBPyConnection) -> None:
    """Let no more threads work than its memory limit is enough for."""
    most = max(_LEAST_THREADS, round(_limit_bytes(con) / _BYTES_PER_THREAD))
    if most < _threads(con):
        con.execute(f"SET threads = {most}")


def _threads(con: duckdb.DuckDBPyConnection) -> int:
    return int(con.execute("SELECT current_setting('threads')").fetchall()[0][0])


def _limit_bytes(con: duckdb.DuckDBPyConnection) -> int:
    now = con.execute("SELECT current_setting('memory_limit')").fetchall()[0][0]
    number, unit = now.split()
    power = ("bytes", "KiB", "MiB", "GiB", "TiB", "PiB").index(unit)
    return round(float(number) * float(1024**power))


def _machine_bytes() -> int:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):  # a system that does not say
        return 8 * 1024**3
