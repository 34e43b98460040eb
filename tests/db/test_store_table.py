"""Tables as `schema/store.sql` describes them are those that SQLAlchemy defines."""

from __future__ import annotations

import pytest
from sqlalchemy import Column, Table

from msgflow.db.store_table import StoreColumn, store_tables
from msgflow.db.tables import STORE


def told(column: StoreColumn) -> dict[str, object]:
    """All that is read of a column but its type, as SQLAlchemy has it."""
    marks = {"unit": column.unit, "clock": column.clock, "sql": column.sql}
    marks["is_hidden"] = column.is_hidden or None
    return {
        "name": column.name,
        "comment": column.description + (f" [{column.unit}]" if column.unit else ""),
        "nullable": not column.is_required,
        "to": [f"store.{column.to}.{column.to}_id"] if column.to else [],
        "info": {key: value for key, value in marks.items() if value is not None},
    }


def defined(column: Column[object]) -> dict[str, object]:
    to = [key.target_fullname for key in column.foreign_keys]
    parts = {name: getattr(column, name) for name in ("name", "comment", "nullable", "info")}
    return {**parts, "to": to}


def test_there_are_no_others() -> None:
    assert list(store_tables()) == [table.name for table in STORE.tables.values()]


@pytest.mark.parametrize("table", STORE.tables.values(), ids=lambda table: table.name)
def test_a_table_is_read_as_it_is_defined(table: Table) -> None:
    """Its types are those of a new database: tests/test_schema.py."""
    found = store_tables()[table.name]
    assert (found.grain, found.view) == (table.comment, table.info.get("view"))
    assert list(map(told, found.columns.values())) == list(map(defined, table.columns))
    assert list(map(told, found.computed)) == list(map(defined, table.info.get("computed", ())))
