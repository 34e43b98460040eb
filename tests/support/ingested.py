"""A database with one run, and how to compare it with what is true."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import duckdb

from msgflow.db.connection import connect
from msgflow.ingest import IngestReport, ingest


@dataclass(frozen=True)
class Ingested:
    """A database with one run, open for reading."""

    report: IngestReport
    connection: duckdb.DuckDBPyConnection

    def rows(self, sql: str) -> list[tuple[Any, ...]]:
        return self.connection.execute(sql).fetchall()

    def differences(self, expected: str, actual: str) -> tuple[list[Any], list[Any]]:
        """Return (missing, extra) rows of the query `actual`, the first few of each."""
        few = "ORDER BY ALL LIMIT 5"
        return (
            self.rows(f"({expected}) EXCEPT ALL ({actual}) {few}"),
            self.rows(f"({actual}) EXCEPT ALL ({expected}) {few}"),
        )


def ingest_one(traces: Path, path: Path) -> Ingested:
    """Ingest the traces below a path into a new database."""
    return Ingested(ingest([traces], path), connect(path, read_only=True))
