"""Memory limits of DuckDB, the threads that they are enough for, and bounds of a process."""

from __future__ import annotations

import contextlib
import resource
from collections.abc import Iterator

import duckdb

from msgflow.errors import DatabaseError
from msgflow.sql.failure import is_of_the_file

# DuckDB's own limit is 80 % of the memory of the machine or container; this gives a quarter of it.
_SHARE_OF_OWN_LIMIT = 0.25 / 0.8
# An ingest of ten million events works with the least; more than the most hardly saves time.
_LEAST_DEFAULT_BYTES = 500_000_000
_MOST_DEFAULT_BYTES = 4_000_000_000
# With less, DuckDB cannot even open a database.
_LEAST_BYTES = 15_000_000
# DuckDB advises this. With less for each, threads spill more than fewer threads would.
_BYTES_PER_THREAD = 125_000_000
# What functions, results and fragmented heaps may take besides: a share of the bytes that DuckDB
# counts, and at least so much.
_SHARE_BESIDE = 0.25
_LEAST_BESIDE = 1 << 28
_EXAMPLE = "MSGFLOW_MEMORY_LIMIT=2GB"


def default_limit(connection: duckdb.DuckDBPyConnection | None = None) -> str:
    """Return the memory limit of an ingest or a server without `--memory-limit`.

    It is a quarter of the memory of the machine, at least 500 MB and at most 4 GB. A `connection`
    that has DuckDB's own limit as yet spares the time to make one.
    """
    with contextlib.nullcontext(connection) if connection else duckdb.connect() as con:
        share = _SHARE_OF_OWN_LIMIT * _limit_bytes(con)
    return f"{min(max(share, _LEAST_DEFAULT_BYTES), _MOST_DEFAULT_BYTES) / 1e9:.1f}GB"


def set_memory_limit(con: duckdb.DuckDBPyConnection, limit: str) -> None:
    """Set the memory limit of a connection."""
    try:
        con.execute("SET memory_limit = ?", [limit])
    except duckdb.OutOfMemoryException as error:
        raise DatabaseError(f"too little memory for this database — {limit}", _EXAMPLE) from error
    except duckdb.Error as error:
        raise DatabaseError(f"not an amount of memory — {limit}", _EXAMPLE) from error
    if limit.strip().startswith("-"):  # DuckDB reads it as no limit
        raise DatabaseError(f"not an amount of memory — {limit}", _EXAMPLE)
    try:
        is_enough = _limit_bytes(con) >= _LEAST_BYTES
    except duckdb.OutOfMemoryException:  # too little even for that question
        is_enough = False
    if not is_enough:
        raise DatabaseError(f"too little memory for any database — {limit}", _EXAMPLE)


def limit_threads(con: duckdb.DuckDBPyConnection) -> None:
    """Reduce the threads of a connection to what its memory limit is enough for."""
    most = max(1, round(_limit_bytes(con) / _BYTES_PER_THREAD))
    if most < con.execute("SELECT current_setting('threads')").fetchall()[0][0]:
        con.execute(f"SET threads = {most}")


def bound_process(con: duckdb.DuckDBPyConnection) -> None:
    """Bound the memory of this process by the memory limit of its connection.

    It may take the limit besides what it has now, and a quarter of the limit, at least 256 MiB, for
    what DuckDB does not count. A system without /proc knows no such bound.
    """
    con.execute("SELECT 1").fetchall()  # its threads have their stacks now
    limit = _limit_bytes(con)
    with contextlib.suppress(OSError), open("/proc/self/statm", encoding="ascii") as file:
        # Data and stack, in pages.
        used = int(file.read().split()[5]) * resource.getpagesize()
        most = used + limit + max(round(limit * _SHARE_BESIDE), _LEAST_BESIDE)
        bound(resource.RLIMIT_DATA, most)


def bound(kind: int, most: int) -> None:
    """Bound what this process takes of a resource, which it may have less of already."""
    _, hard = resource.getrlimit(kind)
    resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


@contextlib.contextmanager
def ingest_memory_errors(limit: str | None) -> Iterator[None]:
    """Turn an out-of-memory error of an ingest into one that says what to do.

    `limit` is that of the ingest, the default when None.
    """
    try:
        yield
    except duckdb.OutOfMemoryException as error:
        if is_of_the_file(error):  # the disk is full
            raise
        raise DatabaseError(
            f"the traces need more memory than {limit or default_limit()}",
            "give more with --memory-limit, or read a shorter part of the recording",
        ) from error


def _limit_bytes(con: duckdb.DuckDBPyConnection) -> int:
    now = con.execute("SELECT current_setting('memory_limit')").fetchall()[0][0]
    number, unit = now.split()
    power = ("bytes", "KiB", "MiB", "GiB", "TiB", "PiB").index(unit)
    return round(float(number) * float(1024**power))
