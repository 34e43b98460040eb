"""Migration: new databases, and upgrades of old ones.

Alembic upgrades the tables. Views and macros are dropped and created again.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import duckdb

from msgflow.db import objects
from msgflow.db.connection import (
    connect,
    definitions,
    has_current_views,
    is_empty,
    require_known,
    require_ours,
    require_tables,
)
from msgflow.db.derivation import derive, stale_runs
from msgflow.db.empty_database import write_empty
from msgflow.db.sandbox import open_file
from msgflow.db.transaction import transaction
from msgflow.db.workspace import workspace
from msgflow.errors import DatabaseError
from msgflow.files.resources import resource_directory
from msgflow.sql.failure import database_errors


@dataclass(frozen=True)
class Upgrade:
    """The result of an upgrade."""

    before: str | None  # schema revision found; None for a new file
    after: str  # schema revision now
    views_changed: bool  # the views were not current
    rederived_runs: tuple[str, ...]  # names of the runs whose links were derived again


def create(path: Path) -> None:
    """Create a database at `path`, complete or not at all."""
    if path.exists():
        raise DatabaseError(f"a file is there already — {path}", "give another file with --db")
    _replace_by_new(path)


def _replace_by_new(path: Path) -> None:
    try:
        with database_errors(path), workspace(path) as directory:
            fresh = directory / "new.duckdb"
            write_empty(fresh)
            os.replace(fresh, os.path.realpath(path))
    except OSError as error:
        raise DatabaseError(
            f"cannot create a database — {path}: {error.strerror}",
            "give a file in a directory that exists and can be written with --db",
        ) from error


def require_ingestable(path: Path) -> None:
    """Raise unless `path` is free, or a current msgflow database."""
    if not path.exists():
        if not path.parent.is_dir():
            raise DatabaseError(
                f"no such directory — {path.parent}", "give a file in an existing directory"
            )
        return
    connect(path, read_only=False).close()


def upgrade(path: Path) -> Upgrade:
    """Bring a database to the schema, views and links of this msgflow, in one transaction."""
    if not path.exists():
        raise DatabaseError(f"no database — {path}", "msgflow ingest TRACE")
    with database_errors(path):
        with contextlib.closing(open_file(path, read_only=False)) as con:
            before = None if is_empty(con) else require_known(con, path)
            if before is not None:
                views_changed = not _has_our_views(con, path)
                rederived = _bring_to_head(con, path, before)
        if before is None:
            # A file of our own: the format of this one depends on the program that made it.
            _replace_by_new(path)
            return Upgrade(None, objects.head_revision(), True, ())
        return Upgrade(before, objects.head_revision(), views_changed, rederived)


def _has_our_views(con: duckdb.DuckDBPyConnection, path: Path) -> bool:
    with contextlib.suppress(DatabaseError):
        require_ours(con, path)
        return has_current_views(con)
    return False


def _bring_to_head(con: duckdb.DuckDBPyConnection, path: Path, revision: str) -> tuple[str, ...]:
    """Return the names of the runs whose links were derived again."""
    is_older = revision != objects.head_revision()
    # Migrations and views need their tables. Before the first release, others had revisions of the
    # same names.
    require_tables(con, path, _definitions_of(revision) if is_older else None)
    with migrated(con) if is_older else transaction(con) as changing:
        objects.apply(changing)
        stale = stale_runs(changing)
        for run_id, _ in stale:
            derive(changing, run_id)
    return tuple(name for _, name in stale)


def _definitions_of(revision: str) -> Mapping[str, str]:
    with tempfile.TemporaryDirectory(prefix="msgflow-") as directory:
        path = Path(directory) / "old.duckdb"
        with duckdb.connect(str(path)) as con:
            con.execute("CREATE SCHEMA store")
            with migrated(con, revision):
                pass
        with duckdb.connect(str(path), read_only=True) as con:
            return definitions(con)


@contextmanager
def migrated(
    con: duckdb.DuckDBPyConnection, revision: str = "head"
) -> Iterator[duckdb.DuckDBPyConnection]:
    """Apply the migrations up to a revision, and commit them at the end of the block.

    The connection is inside their transaction, for what belongs to it as well.
    """
    # These imports are slow, and only files of an older revision need them.
    from alembic import command
    from alembic.config import Config
    from duckdb_engine import ConnectionWrapper
    from sqlalchemy import create_engine
    from sqlalchemy.exc import DBAPIError
    from sqlalchemy.pool import StaticPool

    config = Config()
    config.set_main_option("script_location", str(resource_directory("migrations")))
    config.set_main_option("path_separator", "os")
    cursor = con.cursor()
    engine = create_engine(
        "duckdb://", creator=lambda: ConnectionWrapper(cursor), poolclass=StaticPool
    )
    try:
        with engine.begin() as connection:
            config.attributes["connection"] = connection
            command.upgrade(config, revision)
            yield cursor
    except DBAPIError as error:  # so that a full disk has the usual message
        raise (error.orig or error) from error
    finally:
        engine.dispose()
