"""Audits: what must be true of every database, and which rows break it.

`schema/health/check` holds one audit per file, a query that returns the offending rows with their
run. Relations between tables are audited from the foreign keys that `tables` declares: databases do
not have them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from msgflow.db import objects
from msgflow.db.tables import STORE

if TYPE_CHECKING:
    from collections.abc import Iterator

    import duckdb
    from sqlalchemy import Column


RELATION_SEVERITY = "error"


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
    """Run every audit, those of `schema/health/check` first.

    Args:
        con: connection to a current database.
        run_id: look at this run only; at all runs when None.
    """
    return [*_audits(con, run_id), *_relations(con, run_id)]


def _audits(con: duckdb.DuckDBPyConnection, run_id: int | None) -> Iterator[CheckResult]:
    of_run, values = ("", []) if run_id is None else (" WHERE run_id = ?", [run_id])
    for header in objects.load("health/check"):
        statement = f"SELECT count(*) FROM ({header.body}){of_run}"
        ((row_count,),) = con.execute(statement, values).fetchall()
        yield CheckResult(header.name, header.severity or "error", row_count, header.description)


def _relations(con: duckdb.DuckDBPyConnection, run_id: int | None) -> Iterator[CheckResult]:
    relations = {
        table: [
            (column.name, key.column) for column in table.columns for key in column.foreign_keys
        ]
        for table in sorted(STORE.tables.values(), key=lambda table: table.name)
    }
    blocks = _blocks(con, {parent for each in relations.values() for _, parent in each})
    of_run = "" if run_id is None else f" WHERE run_id = {run_id:d}"
    selects = [
        f"SELECT '{table.name}', ["
        + ", ".join(_broken(column, parent, blocks[parent]) for column, parent in each)
        + f"] FROM {table.fullname} AS child{of_run}"
        for table, each in relations.items()
        if each
    ]
    # One statement: each takes longer to plan than its few rows to count.
    row_counts = dict(con.execute(" UNION ALL ".join(selects)).fetchall())
    for table, each in relations.items():
        for (column, parent), row_count in zip(each, row_counts.get(table.name, []), strict=True):
            yield CheckResult(
                f"relation.{table.name}.{column}",
                RELATION_SEVERITY,
                row_count,
                f"Every {column} of {table.name} is a row of {parent.table.name}.",
            )


def _blocks(
    con: duckdb.DuckDBPyConnection, keys: set[Column[Any]]
) -> dict[Column[Any], tuple[int, int] | None]:
    """Return the first and last of the ids that each column holds, None if some are missing."""
    rows = con.execute(
        " UNION ALL ".join(
            f"SELECT '{key}', min({key.name}), max({key.name}), count({key.name}) "
            f"FROM {key.table.fullname}"
            for key in keys
        )
    ).fetchall()
    by_name = {
        name: (first or 1, last or 0) if count == (last or 0) - (first or 1) + 1 else None
        for name, first, last, count in rows
    }
    return {key: by_name[str(key)] for key in keys}


def _broken(column: str, key: Column[Any], block: tuple[int, int] | None) -> str:
    """Return the expression that counts the children without a parent.

    A whole block of ids, which is what ingests write, makes that a comparison; an id used twice
    would pass it, and fails `identity_is_unique`.
    """
    if block is not None:
        return f"count(*) FILTER (child.{column} < {block[0]} OR child.{column} > {block[1]})"
    return f"count(*) FILTER (child.{column} NOT IN (SELECT {key.name} FROM {key.table.fullname}))"
