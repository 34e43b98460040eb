"""Moves a run from staging into the tables of `store`, giving it its ids."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.db.tables import TABLES

if TYPE_CHECKING:
    from collections.abc import Iterable

    import duckdb

    from msgflow.db.tables import Column, Table


# Joins of more rows than fit into memory give them in any order, in which ids and times take far
# more room. To put fewer rows in order costs more than it saves. Of a view it is not known how many
# it has: where one table is large, everything is put in order.
_ROWS_WORTH_ORDERING = 1_000_000


def store(con: duckdb.DuckDBPyConnection, run_id: int) -> None:
    """Copy what staging has under the name of a store table, inside the open transaction.

    Ids in staging are above 0; in the store those of a run come after what is there. Tables without
    a row are left alone: each statement takes longer than its few rows. Which ones have none is
    known of what was there when the transaction began: staging is filled before it, and one run is
    stored in it.
    """
    staged = dict(
        con.execute(
            "SELECT table_name, estimated_size FROM duckdb_tables() "
            "WHERE database_name = 'staging' AND schema_name = 'main' AND estimated_size > 0 "
            "UNION ALL SELECT view_name, 0 FROM duckdb_views() "
            "WHERE database_name = 'staging' AND schema_name = 'main'"
        ).fetchall()
    )
    bases = _bases(con)
    is_large = max(staged.values(), default=0) >= _ROWS_WORTH_ORDERING
    for table in TABLES.values():
        if table.name in staged:
            _copy(con, table, run_id, bases, in_order=is_large)


def delete(con: duckdb.DuckDBPyConnection, run_ids: Iterable[int]) -> None:
    """Delete runs from every table, inside the open transaction."""
    for run_id in run_ids:
        for table in TABLES.values():
            if "run_id" in table.columns:
                con.execute(f"DELETE FROM {table.full_name} WHERE run_id = ?", [run_id])


def _bases(con: duckdb.DuckDBPyConnection) -> dict[str, int]:
    filled = {
        name
        for (name,) in con.execute(
            "SELECT table_name FROM duckdb_tables() "
            "WHERE schema_name = 'store' AND estimated_size > 0"
        ).fetchall()
    }
    bases = {}
    for table in TABLES.values():
        key = f"{table.name}_id"
        if key in table.columns:
            row = None
            if table.name in filled:
                row = con.execute(f"SELECT max({key}) FROM {table.full_name}").fetchone()
            bases[key] = 0 if row is None else int(row[0] or 0)
    return bases


def _copy(
    con: duckdb.DuckDBPyConnection,
    table: Table,
    run_id: int,
    bases: dict[str, int],
    *,
    in_order: bool,
) -> None:
    names = ", ".join(table.columns)
    values = ", ".join(_value(table, column, run_id, bases) for column in table.columns.values())
    key = f"{table.name}_id"
    order = f" ORDER BY {key}" if in_order and key in table.columns else ""
    con.execute(
        f"INSERT INTO {table.full_name} ({names}) SELECT {values} FROM staging.{table.name}{order}"
    )


def _value(table: Table, column: Column, run_id: int, bases: dict[str, int]) -> str:
    if column.name == "run_id":
        return str(run_id)
    if column.name == f"{table.name}_id":
        return f"{column.name} + {bases[column.name]}"
    if column.references is None:
        return f'"{column.name}"'
    return f"{column.name} + {bases[column.references.split('.')[1]]}"
