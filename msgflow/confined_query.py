"""Confined queries: SQL and conditions that a user gave, each run in a process of its own."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from msgflow.confined import ConfinedProcess, bound_memory
from msgflow.database import Database
from msgflow.query.result import QueryResult

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path


def confined_sql(
    path: Path, text: str, *, limit: int | None, memory_limit: str | None
) -> QueryResult:
    """Return the rows of `Database.sql`, which a child process computes.

    Args:
        path: the database.
        text: one query, or EXPLAIN of one.
        limit: most rows returned; all when None.
        memory_limit: most memory that DuckDB takes; its default when None. The process takes at
            most half as much besides.

    Raises:
        MsgflowError: as `Database.sql`, or the process took too much memory.
    """
    return _ask("sql", path, memory_limit, [text], {"limit": limit})


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
    return _ask("query", path, memory_limit, [name], given)


def _ask(
    method: str,
    path: Path,
    memory_limit: str | None,
    places: Sequence[str],
    names: Mapping[str, Any],
) -> QueryResult:
    arguments = {
        "method": method,
        "path": str(path),
        "memory_limit": memory_limit,
        "places": places,
        "names": names,
    }
    with ConfinedProcess(__name__) as process:
        # Meanwhile the child imports as well.
        import pyarrow as pa

        content = process.call("answer", arguments)
    size = int.from_bytes(content[:8], "big")
    said = json.loads(content[8 : 8 + size])
    from msgflow.query.catalogue import load_query
    from msgflow.run.choice import Run

    with pa.ipc.open_stream(pa.py_buffer(content)[8 + size :]) as reader:
        table = reader.read_all()
    runs = tuple(Run(**{**run, "labels": tuple(run["labels"])}) for run in said["runs"])
    header = None if said["header"] is None else load_query(said["header"])
    return QueryResult(table, header, runs, said["notes"], said["when_empty"])


def answer(
    method: str,
    path: str,
    memory_limit: str | None,
    places: Sequence[str],
    names: Mapping[str, Any],
) -> bytes:
    """Return a result of a method of `Database` as bytes: the child calls this."""
    import pyarrow as pa

    with Database(path, memory_limit=memory_limit) as database:
        bound_memory(database.connection)
        result: QueryResult = getattr(database, method)(*places, **names)
    said = json.dumps(
        {
            "header": None if result.header is None else result.header.name,
            "runs": [asdict(run) for run in result.runs],
            "notes": result.notes,
            "when_empty": result.when_empty,
        }
    ).encode()
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, result.table.schema) as writer:
        writer.write_table(result.table)
    rows: bytes = sink.getvalue().to_pybytes()
    return len(said).to_bytes(8, "big") + said + rows
