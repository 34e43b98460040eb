"""Audits: what must be true of every database, and which rows break it.

`schema/check` holds one audit per file, a query that returns the offending rows. Relations between
tables are audited from what `tables.py` declares, since there are no foreign keys.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.db import objects
from msgflow.db.tables import SCHEMA, metadata

if TYPE_CHECKING:
    from collections.abc import Iterator

    import duckdb


@dataclass(frozen=True)
class CheckResult:
    """Outcome of one audit.

    Attributes:
        name: of the audit.
        severity: 'error' or 'warning' when there are offending rows.
        row_count: number of offending rows; 0: passed.
        description: what must be true.
    """

    name: str
    severity: str
    row_count: int
    description: str


def run_checks(con: duckdb.DuckDBPyConnection, run_id: int | None = None) -> list[CheckResult]:
    """Run every audit, those of `schema/check` first.

    Args:
        con: connection to a current database.
        run_id: look at the relations of this run only; at those of all runs when None.
    """
    return [*_audits(con), *_relations(con, run_id)]


def _audits(con: duckdb.DuckDBPyConnection) -> Iterator[CheckResult]:
    for header in objects.load("check"):
        yield CheckResult(
            header.name,
            header.severity or "error",
            _count(con, f"SELECT count(*) FROM ({header.body})"),
            header.description,
        )


def _relations(con: duckdb.DuckDBPyConnection, run_id: int | None) -> Iterator[CheckResult]:
    for table in metadata.tables.values():
        for column in table.columns:
            reference = column.info.get("references")
            if reference is None or reference == f"{table.name}.{column.name}":
                continue
            parent, key = reference.split(".")
            offending = _count(
                con,
                f"SELECT count(*) FROM {table.fullname} AS child "
                f"ANTI JOIN {SCHEMA}.{parent} AS parent ON child.{column.name} = parent.{key} "
                f"WHERE child.{column.name} IS NOT NULL "
                + ("" if run_id is None else f"AND child.run_id = {run_id:d}"),
            )
            yield CheckResult(
                f"relation.{table.name}.{column.name}",
                "error",
                offending,
                f"Every {column.name} of {table.name} is a row of {parent}.",
            )


def _count(con: duckdb.DuckDBPyConnection, query: str) -> int:
    return int(con.execute(query).fetchall()[0][0])
