"""The store: moves a run from staging into the tables of `store` and assigns its ids."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgflow.db.tables import STORE

if TYPE_CHECKING:
    from collections.abc import Iterable

    import duckdb
    from sqlalchemy import Column, Table

# What a database says of itself.
_OF_NO_RUN = ("alembic_version", "definition")


def store(con: duckdb.DuckDBPyConnection, run_id: int) -> None:
    """Copy each staged table that has the name of a store table, inside the open transaction.

    Rows are sorted by id: unsorted ids and times take far more room in the file.

    Ids in staging are above 0; the store adds its highest id to them. Tables without a row are
    skipped, since a statement takes longer than its few rows. DuckDB sees staging as of the start
    of the transaction: staging has to be filled before, and a transaction stores one run.
    """
    staged = {
        name
        for (name,) in con.execute(
            "SELECT table_name FROM duckdb_tables() "
            "WHERE database_name = 'staging' AND schema_name = 'main' AND estimated_size > 0 "
            "UNION ALL SELECT view_name FROM duckdb_views() "
            "WHERE database_name = 'staging' AND schema_name = 'main'"
        ).fetchall()
    }
    bases = _bases(con)
    for table in STORE.tables.values():
        if table.name in staged:
            _copy(con, table, run_id, bases)


def delete(con: duckdb.DuckDBPyConnection, run_ids: Iterable[int]) -> None:
    """Delete runs from every table, inside the open transaction."""
    for run_id in run_ids:
        for table in STORE.tables.values():
            if "run_id" in table.columns:
                con.execute(f"DELETE FROM {table.fullname} WHERE run_id = ?", [run_id])


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


def _bases(con: duckdb.DuckDBPyConnection) -> dict[str, int]:
    filled = {
        name
        for (name,) in con.execute(
            "SELECT table_name FROM duckdb_tables() "
            "WHERE schema_name = 'store' AND estimated_size > 0"
        ).fetchall()
    }
    bases = {}
    for table in STORE.tables.values():
        key = f"{table.name}_id"
        if key in table.columns:
            bases[key] = 0
            if table.name in filled:
                ((most,),) = con.execute(f"SELECT max({key}) FROM {table.fullname}").fetchall()
                bases[key] = int(most or 0)
    return bases


def _copy(con: duckdb.DuckDBPyConnection, table: Table, run_id: int, bases: dict[str, int]) -> None:
    names = ", ".join(table.columns.keys())
    values = ", ".join(_value(table, column, run_id, bases) for column in table.columns)
    key = f"{table.name}_id"
    order = f" ORDER BY {key}" if key in table.columns else ""
    con.execute(
        f"INSERT INTO {table.fullname} ({names}) SELECT {values} FROM staging.{table.name}{order}"
    )


def _value(table: Table, column: Column[Any], run_id: int, bases: dict[str, int]) -> str:
    if column.name == "run_id":
        return str(run_id)
    if column.name == f"{table.name}_id":
        return f"{column.name} + {bases[column.name]}"
    for relation in column.foreign_keys:
        return f"{column.name} + {bases[relation.column.name]}"
    return f'"{column.name}"'
