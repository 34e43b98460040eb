"""The columns of the objects of the model, so that one without a row need not be planned."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import duckdb

from msgflow.db import cache as cache_of_user
from msgflow.db import objects
from msgflow.ingest import staging

if TYPE_CHECKING:
    from collections.abc import Mapping

    from msgflow.sql.header import Header

_KIND = "outline"


def creating(header: Header) -> str:
    """Return the statement that creates an object of the model."""
    if header.kind == "macro":
        return header.body
    kind = "VIEW" if header.kind == "inline" else "TABLE"
    return f"CREATE {kind} {header.name} AS\n{header.body}"


@cache
def empty_tables() -> Mapping[str, str]:
    """Return the query with the columns of each table of the model, and without a row.

    They are kept in the user's cache: to find them out is to plan the whole model.
    """
    headers = objects.load("model")
    made_by = objects.hash_of([*staging.statements(), *map(creating, headers)])
    found: dict[str, str] = cache_of_user.made_once(_KIND, made_by, lambda: _empty_tables(headers))
    return found


def _empty_tables(headers: tuple[Header, ...]) -> dict[str, str]:
    with duckdb.connect() as con:
        con.execute("ATTACH ':memory:' AS raw; ATTACH ':memory:' AS staging")
        for statement in (*staging.statements(), *map(creating, headers)):
            con.execute(statement)
        tables = con.execute(
            "SELECT schema_table, string_agg(format('NULL::{} AS \"{}\"', data_type, column_name), "
            "', ' ORDER BY column_index) FROM (SELECT database_name || '.' || table_name "
            "AS schema_table, * FROM duckdb_columns() WHERE database_name = 'staging') GROUP BY ALL"
        ).fetchall()
    names = {header.name for header in headers if header.kind == "view"}
    return {name: f"SELECT {columns} WHERE false" for name, columns in tables if name in names}
