"""Makes new databases: tables as `tables.py` has them, and all views and macros.

Nothing is migrated for that, so that neither Alembic nor a dialect of SQLAlchemy is needed. What
came out is kept in the user's cache, as DuckDB takes long to look at each view: a new database is a
copy of that.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from msgflow.db import cache, objects
from msgflow.db.connection import STORAGE_VERSION, open_file
from msgflow.db.tables import SCHEMA, metadata
from msgflow.resources import resource_directory

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


_KIND = "database"

# As Alembic makes it.
_REVISION_TABLE = f"""
CREATE TABLE {SCHEMA}.alembic_version (
    version_num VARCHAR(32) NOT NULL,
    CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
)
"""


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
        con.execute(
            f"INSERT INTO {SCHEMA}.alembic_version (version_num) VALUES (?)",
            [objects.head_revision()],
        )
        objects.apply(con)
        con.commit()
        con.execute("CHECKPOINT")  # closing would fail silently, and leave a log behind
    cache.keep(_KIND, STORAGE_VERSION, path.read_bytes())


def _statements() -> Iterator[str]:
    yield f"CREATE SCHEMA {SCHEMA}"
    yield (resource_directory("schema") / "tables.sql").read_text(encoding="utf-8")
    for table in metadata.tables.values():
        yield f"COMMENT ON TABLE {table.fullname} IS {objects.literal(table.comment or '')}"
        for column in table.columns:
            yield (
                f'COMMENT ON COLUMN {table.fullname}."{column.name}" IS '
                f"{objects.literal(column.comment or '')}"
            )
    yield _REVISION_TABLE
