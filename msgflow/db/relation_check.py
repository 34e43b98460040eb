"""Relations between tables, and the rows that break them: they refer to a row that is missing.

`store.sql` marks the columns that refer to another table. The databases have no foreign keys.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgflow.db.store_table import store_tables

if TYPE_CHECKING:
    import duckdb


def broken_relations(
    con: duckdb.DuckDBPyConnection, run_id: int | None = None
) -> list[dict[str, Any]]:
    """Return the columns with identities that are no row of the table that they refer to.

    Returns:
        For each run and column: `run_id`, `child` ('table.column'), `parent` (a table) and `count`.
    """
    relations = {
        name: [(column.name, column.to) for column in table.columns.values() if column.to]
        for name, table in sorted(store_tables().items())
    }
    blocks = _blocks(con, {parent for each in relations.values() for _, parent in each})
    of_run = "" if run_id is None else f" WHERE run_id = {run_id:d}"
    selects = [
        f"SELECT '{name}', run_id, ["
        + ", ".join(_broken(column, parent, blocks[parent]) for column, parent in each)
        + f"] FROM store.{name} AS child{of_run} GROUP BY run_id"
        for name, each in relations.items()
        if each
    ]
    # One statement: each takes longer to plan than its few rows to count.
    rows = con.execute(" UNION ALL ".join(selects)).fetchall()
    return [
        {"run_id": found_id, "child": f"{name}.{column}", "parent": parent, "count": count}
        for name, found_id, counts in rows
        for (column, parent), count in zip(relations[name], counts, strict=True)
        if count
    ]


def _blocks(con: duckdb.DuckDBPyConnection, names: set[str]) -> dict[str, tuple[int, int] | None]:
    """Return the first and last of the ids that each table holds, None if some are missing."""
    rows = con.execute(
        " UNION ALL ".join(
            f"SELECT '{name}', min({name}_id), max({name}_id), count({name}_id) FROM store.{name}"
            for name in names
        )
    ).fetchall()
    return {
        name: (first or 1, last or 0) if count == (last or 0) - (first or 1) + 1 else None
        for name, first, last, count in rows
    }


def _broken(column: str, parent: str, block: tuple[int, int] | None) -> str:
    """Return the expression that counts the children without a parent.

    Ingests write whole blocks of ids, for which a comparison is enough. An id that is used twice
    passes it, but not `identity_is_unique`.
    """
    if block is not None:
        return f"count(*) FILTER (child.{column} < {block[0]} OR child.{column} > {block[1]})"
    return f"count(*) FILTER (child.{column} NOT IN (SELECT {parent}_id FROM store.{parent}))"
