"""Print how many physical operators DuckDB plans while a trace is ingested: no clock says so.

All that moves rows counts: `INSERT`, `CREATE TABLE … AS`, `SELECT`, also those in a longer text. A
table that is only declared does not, though `EXPLAIN` shows an operator for it.

A program of its own, as what a process has prepared once it does not plan again.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import duckdb

from msgflow.db.migration import create
from msgflow.ingest import ingest

# Statements that EXPLAIN takes.
_PLANNED = {"COPY", "CREATE", "DELETE", "INSERT", "MERGE_INTO", "SELECT", "UPDATE"}


class _Counting:
    """A connection that has each statement explained before it executes it.

    Attributes:
        operators: what all connections have planned.
    """

    operators = 0

    def __init__(self, connection: Any) -> None:
        self._connection = connection

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)

    def __enter__(self) -> _Counting:
        return self

    def __exit__(self, *error: object) -> None:
        self._connection.close()

    def cursor(self) -> _Counting:
        return _Counting(self._connection.cursor())

    def execute(self, query: Any, *given: Any) -> _Counting:
        statements = [query]
        if isinstance(query, str):
            statements = self._connection.extract_statements(query)
        for statement in statements:
            if statement.type.name in _PLANNED:
                explained = f"EXPLAIN (FORMAT json) {statement.query}"
                ((_, plan),) = self._connection.execute(explained, *given).fetchall()
                (top,) = json.loads(plan)
                if statement.type.name != "CREATE" or top["children"]:
                    _Counting.operators += _count([top])
            self._connection.execute(statement, *given)
        return self


def _count(plans: list[dict[str, Any]]) -> int:
    return sum(1 + _count(plan["children"]) for plan in plans)


def main(trace: Path) -> int:
    """Ingest a trace into a new database, and return how many operators that took."""
    with TemporaryDirectory() as directory:
        # A user has the empty database, which is copied, from an ingest before.
        os.environ["XDG_CACHE_HOME"] = directory
        create(Path(directory, "empty.duckdb"))
        connect = duckdb.connect
        duckdb.connect = lambda *words, **more: _Counting(connect(*words, **more))
        ingest([trace], Path(directory, "run.duckdb"))
    return _Counting.operators


if __name__ == "__main__":
    print(main(Path(sys.argv[1])))
