"""Connections to current databases of msgflow, and errors for all other files.

Commands that write check first that tables, views and macros are those of this msgflow, since they
would run changed views, macros and triggers. DuckDB prints definitions in its own words, and prints
those of a file differently from those just created. Hence the check compares the definitions with
those of a new file.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import duckdb

from msgflow.db.empty_database import write_empty
from msgflow.db.objects import definition_hash, head_revision, known_revisions
from msgflow.db.sandbox import open_file, opening, remove_abandoned_spills, require_file
from msgflow.errors import DatabaseError
from msgflow.files.resources import resource_directory
from msgflow.files.temporary_owner import temporary_directory
from msgflow.sql.failure import database_errors
from msgflow.sql.quoting import literal

# What to do about tables that no revision upgrades, as those of before the first release.
INGEST_AGAIN = "msgflow ingest TRACE --db NEW.duckdb reads the recording again"


_TRIGGERS = """
UNION ALL
SELECT
    'trigger ' || schema_name || '.' || trigger_name,
    coalesce(sql, '')
FROM duckdb_triggers()
WHERE database_name = current_database()
"""


def connect(
    path: Path, *, read_only: bool, memory_limit: str | None = None
) -> duckdb.DuckDBPyConnection:
    """Open an existing, current msgflow database.

    It is not opened for writing if its definitions are not those of this msgflow. `memory_limit` is
    the most memory that DuckDB takes, such as '2GB'; DuckDB's default when None.
    """
    if not path.exists():
        raise DatabaseError(f"no database — {path}", "msgflow ingest TRACE")
    con = open_file(path, read_only=read_only, memory_limit=memory_limit)
    try:
        require_current(con, path)
        if not read_only:
            require_ours(con, path)
    except BaseException:
        con.close()
        raise
    return con


def attach(con: duckdb.DuckDBPyConnection, path: Path, *, is_new: bool = False) -> None:
    """Attach an existing, current msgflow database for writing, and make it the current one.

    `is_new` says that this process has just created the file: its definitions need no check, and it
    has no log. A commit then lasts only after a CHECKPOINT.
    """
    if not path.exists():
        raise DatabaseError(f"no database — {path}", "msgflow ingest TRACE")
    require_file(path)
    with opening(path):
        mode = " (RECOVERY_MODE no_wal_writes)" if is_new else ""
        con.execute(f"ATTACH {literal(str(path))} AS target{mode}")
    con.execute("USE target")
    if is_new:
        return
    require_current(con, path)
    require_ours(con, path)
    remove_abandoned_spills(path, is_ours_alone=True)


def recorded_revision(con: duckdb.DuckDBPyConnection) -> str | None:
    """Return the schema revision of a database, None if it is not one of msgflow."""
    # Not fetchone: DuckDB refuses the next query as long as this one may have more rows.
    ((count,),) = con.execute(
        "SELECT count(*) FROM duckdb_tables() WHERE database_name = current_database() "
        "AND schema_name = 'store' AND table_name IN ('alembic_version', 'definition', 'run')"
    ).fetchall()
    if count != 3:
        return None
    try:
        revisions = con.execute("SELECT version_num FROM store.alembic_version").fetchall()
    except duckdb.BinderException:  # another table of that name
        return None
    return None if not revisions or revisions[0][0] is None else str(revisions[0][0])


def is_empty(con: duckdb.DuckDBPyConnection) -> bool:
    """Tell whether a database has no tables and no views of its own."""
    ((count,),) = con.execute(
        "SELECT (SELECT count(*) FROM duckdb_tables() WHERE database_name = current_database()) + "
        "(SELECT count(*) FROM duckdb_views() WHERE NOT internal "
        "AND database_name = current_database())"
    ).fetchall()
    return bool(count == 0)


def require_current(con: duckdb.DuckDBPyConnection, path: Path) -> None:
    """Raise unless the database says that it has the schema and the views of this msgflow.

    This reads tables only. `require_ours` compares the definitions themselves.
    """
    revision = require_known(con, path)
    hint = f"msgflow db upgrade --db {shlex.quote(str(path))}"
    if revision != head_revision():
        raise DatabaseError(
            f"database has schema revision {revision}, this msgflow needs {head_revision()} "
            f"— {path}",
            hint,
        )
    with database_errors(path):
        if not has_current_views(con):
            # An upgrade would refuse other tables.
            require_tables(con, path)
            raise DatabaseError(f"database has the views of another msgflow version — {path}", hint)


def has_current_views(con: duckdb.DuckDBPyConnection) -> bool:
    """Tell whether a database says that it has the views of this msgflow."""
    found = con.execute("SELECT hash FROM store.definition WHERE name = 'views'").fetchall()
    return found == [(definition_hash(),)]


def require_known(con: duckdb.DuckDBPyConnection, path: Path) -> str:
    """Return the revision of a database that this msgflow can read or upgrade."""
    with database_errors(path):
        revision = recorded_revision(con)
    if revision is None:
        raise DatabaseError(
            f"a DuckDB database, but not one of msgflow — {path}", "give another file with --db"
        )
    if revision.isdecimal():
        raise DatabaseError(
            f"database has schema revision {revision[:40]}, from before the first release — {path}",
            INGEST_AGAIN,
        )
    if revision not in known_revisions():
        raise DatabaseError(
            f"database has schema revision {revision[:40]!r}, which this msgflow does not know "
            f"(its own is {head_revision()}) — {path}",
            "upgrade msgflow if another one is newer, or ingest the traces into a new file",
        )
    return revision


def definitions(con: duckdb.DuckDBPyConnection) -> dict[str, str]:
    """Return the definitions in the current database by kind and name; read none of its tables."""
    text = (resource_directory("schema") / "definitions.sql").read_text(encoding="utf-8")
    return dict(con.execute(text + (_TRIGGERS if _has_triggers() else "")).fetchall())


def _has_triggers() -> bool:
    return int(duckdb.__version__.partition(".")[0]) >= 2


def require_ours(con: duckdb.DuckDBPyConnection, path: Path) -> None:
    """Raise unless tables, views and macros are those of this msgflow."""
    _require(definitions(con), expected_definitions(), path)


def require_tables(
    con: duckdb.DuckDBPyConnection, path: Path, wanted: Mapping[str, str] | None = None
) -> None:
    """Raise unless tables are as they should be; an upgrade makes views and macros anew."""
    found, wanted = (
        {name: text for name, text in each.items() if not name.startswith(("view", "macro"))}
        for each in (definitions(con), wanted or expected_definitions())
    )
    _require(found, wanted, path)


def _require(found: Mapping[str, str], wanted: Mapping[str, str], path: Path) -> None:
    if found == wanted:
        return
    names = sorted(name for name in {**found, **wanted} if found.get(name) != wanted.get(name))
    name = min(names, key=lambda name: name.startswith(("view", "macro")))
    how = (
        "lacks a" if name not in found else "has a foreign" if name not in wanted else "has another"
    )
    # An upgrade makes views and macros anew, but not the rest.
    can_upgrade = name.startswith(("view", "macro"))
    raise DatabaseError(
        f"the database is not as this msgflow makes it: it {how} {name} — {path}",
        f"msgflow db upgrade --db {shlex.quote(str(path))} makes views and macros anew"
        if can_upgrade
        else INGEST_AGAIN,
    )


@cache
def expected_definitions() -> Mapping[str, str]:
    """Return the definitions that a database of this msgflow has, by kind and name."""
    with temporary_directory("msgflow-definitions-") as directory:
        path = directory / "new.duckdb"
        write_empty(path)
        with duckdb.connect(str(path), read_only=True) as con:
            return definitions(con)
