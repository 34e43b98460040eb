"""DDL of the tables of `store`, as SQLAlchemy and the dialect of duckdb-engine write it."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from duckdb_engine import Dialect
from sqlalchemy.schema import CreateTable, SetColumnComment, SetTableComment

from msgflow.db.tables import STORE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Column


def create_statements() -> Iterator[str]:
    """Yield the statements that create the schema `store` and its tables."""
    yield f"CREATE SCHEMA {STORE.schema}"
    for table in STORE.tables.values():
        # Relations are no constraints of the database: see `tables`.
        statement = CreateTable(table, include_foreign_key_constraints=[])
        yield str(statement.compile(dialect=_dialect()))


def comment_statements() -> Iterator[str]:
    """Yield the statements that write the comments of all tables and columns."""
    for table in STORE.tables.values():
        yield str(SetTableComment(table).compile(dialect=_dialect()))
        for column in table.columns:
            yield str(SetColumnComment(column).compile(dialect=_dialect()))


def type_name(column: Column[Any]) -> str:
    """Return the type of a column as DuckDB's `DESCRIBE` prints it, such as 'BIGINT[]'."""
    name = column.type.compile(dialect=_dialect()).upper()
    return name.removesuffix(" WITHOUT TIME ZONE")


@cache
def _dialect() -> Dialect:
    return Dialect()
