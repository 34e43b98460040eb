"""Relations between tables, and the rows that break them: they refer to a row that is missing.

A row of another run does not count: nothing is linked across runs.

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
    """Return the columns with identities that no row of their run has where they refer to.

    Returns:
        For each run and column: `run_id`, `child` ('table.column'), `parent` (a table) and `count`.
    """
    of_run = "" if run_id is None else f"AND run_id = {run_id:d} "
    selects = [
        f"SELECT run_id, '{name}.{column.name}', '{column.to}', count(*) "
        f"FROM store.{name} AS child ANTI JOIN store.{column.to} AS parent "
        f"ON child.{column.name} = parent.{column.to}_id AND child.run_id = parent.run_id "
        f"WHERE {column.name} IS NOT NULL {of_run}GROUP BY run_id"
        for name, table in sorted(store_tables().items())
        for column in table.columns.values()
        if column.to
    ]
    # One statement: each takes longer to plan than its few rows to count.
    rows = con.execute(" UNION ALL ".join(selects)).fetchall()
    return [dict(zip(("run_id", "child", "parent", "count"), row, strict=True)) for row in rows]
