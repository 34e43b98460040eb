"""Makes new databases: tables as `tables.py` has them, and all views and macros.

Nothing is migrated for that, so that neither Alembic nor a dialect of SQLAlchemy is needed. What
came out is kept in the user's cache, as DuckDB takes long to look at each view: a new database is a
copy of that, for which not even the declaration of the tables is read.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from msgflow.db import cache, objects
from msgflow.db.sandbox import STORAGE_VERSION, open_file

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from msgflow.db.tables import Table

_KIND = "database"


def write_new(path: Path) -> None:
    """Write a database without a run to `path`, where nothing is yet.

    Raises:
        OSError: it cannot be written.
        duckdb.Error: likewise.
    """
    content = cache.read(_KIND, STORAGE_VERSION)
    if content is not None:
        path.write_bytes(content)
        return
    with contextlib.closing(open_file(path, read_only=False)) as con:
        con.begin()
        for statement in _statements():
            con.execute(statement)
        objects.apply(con)
        con.commit()
        con.execute("CHECKPOINT")  # closing would fail silently, and leave a log behind
    cache.keep(_KIND, STORAGE_VERSION, path.read_bytes())


def _statements() -> Iterator[str]:
    from msgflow.db.tables import SCHEMA, TABLES

    yield f"CREATE SCHEMA {SCHEMA}"
    for table in TABLES.values():
        yield from _table(table)
    # As Alembic makes it.
    yield (
        f"CREATE TABLE {SCHEMA}.alembic_version (version_num VARCHAR(32) NOT NULL, "
        "CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num))"
    )
    revision = objects.literal(objects.head_revision())
    yield f"INSERT INTO {SCHEMA}.alembic_version (version_num) VALUES ({revision})"


def _table(table: Table) -> Iterator[str]:
    columns = ", ".join(
        f'"{column.name}" {column.type}'
        + (" PRIMARY KEY" if column.is_key else " NOT NULL" if column.is_required else "")
        + (f" DEFAULT {column.default}" if column.default is not None else "")
        for column in table.columns.values()
    )
    yield f"CREATE TABLE {table.full_name} ({columns})"
    yield f"COMMENT ON TABLE {table.full_name} IS {objects.literal(table.comment)}"
    for column in table.columns.values():
        yield (
            f'COMMENT ON COLUMN {table.full_name}."{column.name}" IS '
            f"{objects.literal(column.comment)}"
        )
