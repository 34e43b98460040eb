"""A database with one run, and how to compare it with what is true."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import duckdb
import pytest

from msgflow.ingest import ingest

# The longest takes ten.
_SECONDS_TO_MAKE = 300


def rows(path: Path, sql: str) -> list[tuple[Any, ...]]:
    """Return the rows of a query on a database that is not open."""
    with duckdb.connect(str(path), read_only=True) as connection:
        return connection.execute(sql).fetchall()


@dataclass(frozen=True)
class Ingested:
    """A database with one run, open for reading."""

    connection: duckdb.DuckDBPyConnection
    path: Path

    def rows(self, sql: str) -> list[tuple[Any, ...]]:
        return self.connection.execute(sql).fetchall()

    def differences(self, expected: str, actual: str) -> tuple[list[Any], list[Any]]:
        """Return (missing, extra) rows of the query `actual`, the first few of each."""
        found = self.rows(
            f"WITH expected AS MATERIALIZED ({expected}), actual AS MATERIALIZED ({actual}) "
            "SELECT true, * FROM "
            "(FROM expected EXCEPT ALL FROM actual ORDER BY ALL LIMIT 5) "
            "UNION ALL SELECT false, * FROM "
            "(FROM actual EXCEPT ALL FROM expected ORDER BY ALL LIMIT 5)"
        )
        return (
            [row for is_missing, *row in found if is_missing],
            [row for is_missing, *row in found if not is_missing],
        )


def ingest_one(traces: Path, path: Path) -> Ingested:
    """Ingest the traces below a path into a new database."""
    ingest([traces], path)
    return open_ingested(path)


def open_ingested(path: Path) -> Ingested:
    """Open a database with one run; its connection may read files, as what is true lies in some."""
    return Ingested(duckdb.connect(str(path), read_only=True), path)


def contents(path: Path) -> dict[str, list[tuple[Any, ...]]]:
    """Return all rows of all tables of a database."""
    with duckdb.connect(str(path), read_only=True) as connection:
        tables = connection.execute(
            "SELECT table_name, estimated_size > 0 FROM duckdb_tables() "
            "WHERE schema_name = 'store' ORDER BY 1"
        ).fetchall()
        return {
            table: connection.execute(f"FROM store.{table} ORDER BY ALL").fetchall()
            if may_have_rows
            else []
            for table, may_have_rows in tables
        }


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], None]) -> Path:
    """Return the path for which `make` makes a file, once for all workers of a test run.

    Where it fails, or takes too long, it fails for all of them.
    """
    base = factory.getbasetemp()
    directory = (base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base) / f"once_{name}"
    path = directory / f"{name}.duckdb"
    done, failed = directory / "done", directory / "failed"
    try:
        directory.mkdir()
    except FileExistsError:
        end = time.monotonic() + _SECONDS_TO_MAKE
        while not done.exists():
            assert time.monotonic() < end, f"who makes it takes too long, or was killed — {path}"
            time.sleep(0.1)
    else:
        try:
            make(path)
        except BaseException:
            failed.touch()
            raise
        finally:
            done.touch()
    assert not failed.exists(), f"it could not be made — {path}"
    return path
