"""Confined queries: SQL and conditions that a user gave, each run in a process of its own."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from msgflow.confined.process import ConfinedProcess
from msgflow.database import Database
from msgflow.db.memory import bound_process
from msgflow.db.sandbox import open_memory
from msgflow.result.query_result import QueryResult

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    Write = Callable[[Any], int]

_SIZE = 8
_ROWS_AT_ONCE = 100_000


def confined_sql(
    path: Path, text: str, *, limit: int | None, memory_limit: str | None
) -> QueryResult:
    """Return the rows of `Database.sql`, which a child process computes.

    Args:
        path: the database.
        text: one query, or EXPLAIN of one.
        limit: most rows returned; all when None.
        memory_limit: most memory that DuckDB takes; its default when None. The process takes a
            quarter more at most, but may take 256 MiB.

    Raises:
        MsgflowError: as `Database.sql`, or the process took too much memory.
    """
    return _ask_database(path, memory_limit, "sql", [text], {"limit": limit})


def confined_query(
    path: Path, name: str, given: Mapping[str, Any], *, memory_limit: str | None
) -> QueryResult:
    """Return the rows of `Database.query`, which a child process computes.

    Args:
        path: the database.
        name: of the query.
        given: other arguments of `Database.query`.
        memory_limit: as `confined_sql` has it.

    Raises:
        MsgflowError: as `Database.query`, or the process took too much memory.
    """
    return _ask_database(path, memory_limit, "query", [name], given)


def confined_fleet_sql(
    lake: str, text: str, *, where: str | None, limit: int | None
) -> QueryResult:
    """Return the rows of `msgflow.fleet.lake_query.fleet_sql`, which a child process computes.

    Args:
        lake: its address.
        text: one query, or EXPLAIN of one.
        where: a condition on runs and their labels; all runs when None.
        limit: most rows returned; all when None.

    Raises:
        MsgflowError: as `fleet_sql`, or the process took too much memory.
    """
    return _ask("answer_of_lake", {"lake": lake, "text": text, "where": where, "limit": limit})


def answer(
    write: Write,
    *,
    method: str,
    path: str,
    memory_limit: str | None,
    given: Sequence[Any],
    named: Mapping[str, Any],
) -> None:
    """Write a result of a method of `Database`, in the child."""
    with Database(path, memory_limit=memory_limit) as database:
        bound_process(database.connection)
        _pack(getattr(database, method)(*given, **named), write)


def answer_of_lake(
    write: Write, *, lake: str, text: str, where: str | None, limit: int | None
) -> None:
    """Write a result of `fleet_sql`, in the child."""
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.lake_query import fleet_sql

    with open_memory() as con:
        bound_process(con)
    _pack(fleet_sql(Lake.open(lake), text, where=where, limit=limit), write)


def _ask_database(
    path: Path,
    memory_limit: str | None,
    method: str,
    given: Sequence[Any],
    named: Mapping[str, Any],
) -> QueryResult:
    return _ask("answer", _arguments(path, memory_limit, method, given, named))


def _arguments(
    path: Path,
    memory_limit: str | None,
    method: str,
    given: Sequence[Any],
    named: Mapping[str, Any],
) -> dict[str, Any]:
    of_database = {"method": method, "path": str(path), "memory_limit": memory_limit}
    return {**of_database, "given": given, "named": named}


def _ask(function: str, arguments: dict[str, Any]) -> QueryResult:
    with ConfinedProcess(__name__) as process:
        # Meanwhile the child imports as well.
        import pyarrow  # noqa: F401

        return _unpack(process.call(function, arguments))


def _unpack(content: bytearray) -> QueryResult:
    import pyarrow as pa

    from msgflow.query.catalogue import load_query
    from msgflow.run.choice import Run

    size = int.from_bytes(content[:_SIZE])
    said = json.loads(content[_SIZE : _SIZE + size])
    with pa.ipc.open_stream(pa.py_buffer(content)[_SIZE + size :]) as reader:
        table = reader.read_all()
    runs = tuple(Run(**{**run, "labels": tuple(run["labels"])}) for run in said["runs"])
    header = None if said["header"] is None else load_query(said["header"])
    names = ("notes", "when_empty", "path_numbers", "order")
    return QueryResult(table, header, runs, **{name: said[name] for name in names})


def _pack(result: QueryResult, write: Write) -> None:
    """Write the size of what a result says as JSON, that JSON, and the rows as an Arrow stream."""
    import pyarrow as pa

    said = json.dumps(
        {
            "header": None if result.header is None else result.header.name,
            "runs": [asdict(run) for run in result.runs],
            "notes": result.notes,
            "when_empty": result.when_empty,
            "path_numbers": result.path_numbers,
            "order": result.order,
        }
    ).encode()
    write(len(said).to_bytes(_SIZE) + said)
    with (
        pa.PythonFile(_Stream(write), "w") as stream,
        pa.ipc.new_stream(stream, result.table.schema) as writer,
    ):
        writer.write_table(result.table, max_chunksize=_ROWS_AT_ONCE)


class WarmSql:
    """SQL on one database, query after query in one child process, which starts with the first.

    Args:
        path: the database; every query opens it anew.
        memory_limit: as `confined_sql` has it.
        seconds: how long a query may take.
    """

    def __init__(self, path: Path, *, memory_limit: str | None, seconds: float) -> None:
        self._path = path
        self._memory_limit = memory_limit
        self._seconds = seconds
        self._process: ConfinedProcess | None = None

    def __call__(self, text: str, limit: int) -> QueryResult:
        """Return the rows of a query, `limit` at most; one thread at a time may ask.

        Raises:
            MsgflowError: as `confined_sql`, or it took too long, or was interrupted.
        """
        if self._process is None:
            self._process = ConfinedProcess(__name__, seconds=self._seconds)
        arguments = _arguments(self._path, self._memory_limit, "sql", [text], {"limit": limit})
        return _unpack(self._process.call("answer", arguments))

    def interrupt(self) -> None:
        """End the query that runs; for another thread than the one that waits for it."""
        if self._process is not None:
            self._process.kill()

    def close(self) -> None:
        """End the child."""
        if self._process is not None:
            self._process.close()


class _Stream:
    """A file that Arrow writes to."""

    closed = False

    def __init__(self, write: Write) -> None:
        self.write = write

    def flush(self) -> None:
        """Do nothing: what was written is on its way."""

    def close(self) -> None:
        """End the file."""
        self.closed = True
