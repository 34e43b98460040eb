"""The store: moves a run from staging into the tables of `store` and assigns its ids."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from msgflow.db.store_table import store_tables

if TYPE_CHECKING:
    import duckdb

    from msgflow.db.store_table import StoreColumn, StoreTable

# What a database says of itself.
_OF_NO_RUN = ("alembic_version", "definition")


def store(con: duckdb.DuckDBPyConnection, run_id: int) -> None:
    """Copy each staged table that has the name of a store table, inside the open transaction.

    Rows are sorted by id: unsorted ids and times take far more room in the file.

    Ids in staging are above 0; the store adds its highest id to them. Tables without a row are
    skipped, since a statement takes longer than its few rows. DuckDB sees staging as of the start
    of the transaction: staging has to be filled before, and a transaction stores one run.
    """
    rows = con.execute(
        "SELECT if(schema_name = 'store', 'store', database_name) || '.' || table_name "
        "FROM duckdb_tables() WHERE estimated_size > 0 "
        "UNION ALL SELECT 'staging.' || view_name FROM duckdb_views() "
        "WHERE database_name = 'staging' AND schema_name = 'main'"
    ).fetchall()
    filled = {name for (name,) in rows}
    bases = {}
    for table in store_tables().values():
        if table.key in table.columns:
            bases[table.name] = 0
            if f"store.{table.name}" in filled:
                highest = f"SELECT max({table.key}) FROM store.{table.name}"
                ((most,),) = con.execute(highest).fetchall()
                bases[table.name] = int(most or 0)
    for table in store_tables().values():
        if f"staging.{table.name}" in filled:
            _copy(con, table, run_id, bases)


def delete(con: duckdb.DuckDBPyConnection, run_ids: Iterable[int]) -> None:
    """Delete runs from every table, inside the open transaction."""
    for run_id in run_ids:
        for table in store_tables().values():
            if "run_id" in table.columns:
                con.execute(f"DELETE FROM store.{table.name} WHERE run_id = ?", [run_id])


def empty(con: duckdb.DuckDBPyConnection, *databases: str) -> None:
    """Empty the tables of runs, or of staging, in attached databases.

    New tables take the place of those with rows: DuckDB plans and scans an emptied one as if its
    rows were there.
    """
    filled = con.execute(
        "SELECT database_name, schema_name, sql FROM duckdb_tables() "
        "WHERE list_contains(?, database_name) AND estimated_size > 0 "
        "AND NOT list_contains(?, table_name)",
        [list(databases), list(_OF_NO_RUN)],
    ).fetchall()
    for database, schema, sql in filled:
        definition = sql.removeprefix("CREATE TABLE ").removeprefix(f"{schema}.")
        con.execute(f"CREATE OR REPLACE TABLE {database}.{schema}.{definition}")


def _copy(
    con: duckdb.DuckDBPyConnection, table: StoreTable, run_id: int, bases: dict[str, int]
) -> None:
    names = ", ".join(table.columns)
    values = ", ".join(_value(table, column, run_id, bases) for column in table.columns.values())
    order = f" ORDER BY {table.key}" if table.key in table.columns else ""
    con.execute(
        f"INSERT INTO store.{table.name} ({names}) SELECT {values} FROM staging.{table.name}{order}"
    )


def _value(table: StoreTable, column: StoreColumn, run_id: int, bases: dict[str, int]) -> str:
    if column.name == "run_id":
        return str(run_id)
    owner = table.name if column.name == table.key else column.to
    return f"{column.name} + {bases[owner]}" if owner else f'"{column.name}"'
