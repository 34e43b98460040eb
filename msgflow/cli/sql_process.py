"""SQL that a page of the server was given, run in a process of its own."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.confined.process import ConfinedProcess
from msgflow.database import Database
from msgflow.db.memory import bound_process, default_limit
from msgflow.result.query_result import QueryResult

if TYPE_CHECKING:
    Write = Callable[[Any], int]

_ROWS_AT_ONCE = 100_000
# The server holds an answer as a whole, and so does the browser.
MOST_BYTES = 100_000_000


def answer(
    write: Write, *, path: str, memory_limit: str | None, text: str, limit: int | None
) -> None:
    """Write the result of `Database.sql`, in the child; metadata of its table have the notes."""
    import pyarrow as pa

    with Database(path, memory_limit=memory_limit or default_limit()) as database:
        bound_process(database.connection)
        result = database.sql(text, limit=limit)
        table = result.table
        while len(table) and table.nbytes > MOST_BYTES:
            # Rows differ in size: the first may take more than their share.
            table = table.slice(0, len(table) * MOST_BYTES // table.nbytes)
        said = list(result.notes)
        if len(table) < len(result):
            said.append(
                f"the first {len(table)} of {len(result)} rows: all take"
                f" {result.table.nbytes / 1e6:,.0f} MB, and a page shows {MOST_BYTES / 1e6:.0f} MB"
            )
        table = table.replace_schema_metadata({"notes": json.dumps(said)})
        with pa.ipc.new_stream(_Stream(write), table.schema) as writer:
            writer.write_table(table, max_chunksize=_ROWS_AT_ONCE)


class WarmSql:
    """SQL on one database, query after query in one child process, which starts with the first.

    Every query opens the database anew. The process takes a quarter more memory than DuckDB at
    most, but may take 256 MiB.
    """

    def __init__(self, path: Path, *, memory_limit: str | None, seconds: float) -> None:
        self._given = {"path": str(path), "memory_limit": memory_limit}
        self._seconds = seconds
        self._process: ConfinedProcess | None = None

    def __call__(self, text: str, limit: int) -> QueryResult:
        """Return the rows of a query, `limit` at most; one thread at a time may ask."""
        import pyarrow as pa

        if self._process is None:
            self._process = ConfinedProcess(__name__, seconds=self._seconds)
        given = self._given | {"text": text, "limit": limit}
        content = self._process.call("answer", given)
        with pa.ipc.open_stream(pa.py_buffer(content)) as reader:
            table = reader.read_all()
        notes = json.loads(table.schema.metadata[b"notes"])
        return QueryResult(table.replace_schema_metadata(None), notes=notes)

    def interrupt(self) -> None:
        """End the query that runs; for another thread than the one that waits for it."""
        if self._process is not None:
            self._process.kill()

    def close(self) -> None:
        """End the child."""
        if self._process is not None:
            self._process.close()


class _Stream(io.RawIOBase):
    def __init__(self, write: Write) -> None:
        self._write = write

    def write(self, data: Any) -> int:
        return self._write(data)

    def writable(self) -> bool:
        return True
