"""Tables are read from `schema/store.sql` as DuckDB reads them."""

from __future__ import annotations

from pathlib import Path

import duckdb

from msgflow.db.store_table import store_tables

# That of Alembic.
OTHERS = {"alembic_version"}


def test_tables_are_those_of_a_new_database(empty_database: Path) -> None:
    """All of their columns; types and comments are compared by tests/test_schema.py."""
    with duckdb.connect(str(empty_database), read_only=True) as con:
        rows = con.execute(
            "SELECT table_name, column_name, is_nullable FROM duckdb_columns() "
            "WHERE schema_name = 'store'"
        ).fetchall()
        keys = con.execute(
            "SELECT table_name, constraint_column_names[1] FROM duckdb_constraints() "
            "WHERE schema_name = 'store' AND constraint_type = 'PRIMARY KEY'"
        ).fetchall()
    read = {
        (table.name, column.name, not column.is_required)
        for table in store_tables().values()
        for column in table.columns.values()
    }
    assert read == {row for row in rows if row[0] not in OTHERS}
    assert {
        (table.name, column.name)
        for table in store_tables().values()
        for column in table.columns.values()
        if column.is_key
    } == {key for key in keys if key[0] not in OTHERS}


def test_every_column_has_a_meaning_and_every_mark_is_known() -> None:
    for table in store_tables().values():
        assert table.grain.startswith("One row per "), table.name
        for column in (*table.columns.values(), *table.computed):
            assert column.description, (table.name, column.name)
            assert "{" not in column.description, (table.name, column.name)
            assert column.to is None or column.to in store_tables()
            assert column.clock is None or column.clock in table.columns
