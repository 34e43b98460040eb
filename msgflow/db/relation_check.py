"""Relations between tables, and the rows that break them: they refer to a row that is missing.

A row of another run does not count: nothing is linked across runs.

`store.sql` marks the columns that refer to another table. The databases have no foreign keys.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgflow.db.store_table import store_tables

if TYPE_CHECKING:
    import duckdb


# A run, and the first and last of its ids.
_Block = tuple[int, int, int]


def broken_relations(
    con: duckdb.DuckDBPyConnection, run_id: int | None = None
) -> list[dict[str, Any]]:
    """Return the columns with identities that no row of their run has where they refer to.

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


def _blocks(con: duckdb.DuckDBPyConnection, names: set[str]) -> dict[str, list[_Block] | None]:
    """Return the ids that each table holds, None where a run's are not one block."""
    rows = con.execute(
        " UNION ALL ".join(
            f"SELECT '{name}', run_id, min({name}_id), max({name}_id), count({name}_id)"
            f" FROM store.{name} GROUP BY run_id"
            for name in names
        )
    ).fetchall()
    blocks: dict[str, list[_Block] | None] = {name: [] for name in names}
    for name, run_id, first, last, count in rows:
        known = blocks[name]
        whole = known is not None and count == last - first + 1
        blocks[name] = [*known, (run_id, first, last)] if known is not None and whole else None
    return blocks


def _broken(column: str, parent: str, blocks: list[_Block] | None) -> str:
    """Return the expression that counts the children without a parent in their run.

    Ingests write whole blocks of ids, for which a comparison is enough. An id that is used twice
    passes it, but not `identity_is_unique`.
    """
    if blocks is None:
        rows = f"SELECT (run_id, {parent}_id) FROM store.{parent}"
        broken = f"(child.run_id, child.{column}) NOT IN ({rows})"
    elif blocks:
        first, last = (
            "MAP {" + ", ".join(f"{block[0]}: {block[end]}" for block in blocks) + "}[child.run_id]"
            for end in (1, 2)
        )
        broken = f"coalesce(child.{column} NOT BETWEEN {first} AND {last}, true)"
    else:
        broken = "true"
    return f"count(*) FILTER (child.{column} IS NOT NULL AND {broken})"
