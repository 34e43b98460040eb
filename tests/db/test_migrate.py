"""Databases are created and upgraded to what the tables and views say."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest
from sqlalchemy.schema import CreateSchema

from msgflow.db import derive, migrate, objects
from msgflow.db.connection import connect, open_file, recorded_revision
from msgflow.db.tables import metadata
from msgflow.errors import DatabaseError

CATALOGUE = (
    "SELECT table_name, column_name, data_type, is_nullable, comment FROM duckdb_columns() "
    "WHERE schema_name = 'store' AND table_name <> 'alembic_version' "
    "AND database_name = current_database() ORDER BY table_name, column_index"
)
KEYS = (
    "SELECT table_name, constraint_column_names FROM duckdb_constraints() "
    "WHERE schema_name = 'store' AND table_name <> 'alembic_version' "
    "AND constraint_type = 'PRIMARY KEY' AND database_name = current_database() ORDER BY ALL"
)


@pytest.fixture
def database(tmp_path: Path) -> Path:
    path = tmp_path / "new.duckdb"
    migrate.create(path)
    return path


def test_migrations_and_tables_agree(database: Path, tmp_path: Path) -> None:
    other = open_file(tmp_path / "other.duckdb", read_only=False)
    with migrate.sqlalchemy_connection(other) as connection:
        connection.execute(CreateSchema("store"))
        metadata.create_all(connection)
    migrated = connect(database, read_only=True)
    for query in (CATALOGUE, KEYS):
        assert migrated.execute(query).fetchall() == other.execute(query).fetchall()


def test_a_new_database_has_every_view_with_comments(database: Path) -> None:
    con = connect(database, read_only=True)
    for header in objects.views():
        if header.kind != "view":
            continue
        schema, name = header.name.split(".")
        row = con.execute(
            "SELECT comment FROM duckdb_views() WHERE schema_name = ? AND view_name = ?",
            [schema, name],
        ).fetchall()
        assert len(row) == 1, header.name
        assert header.description in row[0][0]
        comments = con.execute(
            "SELECT column_name, comment FROM duckdb_columns() "
            "WHERE schema_name = ? AND table_name = ?",
            [schema, name],
        ).fetchall()
        by_column = dict(comments)
        for column in header.columns:
            assert by_column[column.name].startswith(column.description)


def test_upgrade_applies_changed_views(database: Path) -> None:
    con = open_file(database, read_only=False)
    con.execute("UPDATE store.definition SET hash = 'old'")
    con.execute("CREATE VIEW main.left_over AS SELECT 1 AS one")
    con.close()
    with pytest.raises(DatabaseError, match="views of another msgflow version"):
        connect(database, read_only=True)
    done = migrate.upgrade(database)
    assert done.views_changed
    assert done.before == done.after == objects.head_revision()
    con = connect(database, read_only=True)
    names = {name for (name,) in con.execute("SELECT view_name FROM duckdb_views()").fetchall()}
    assert "left_over" not in names


def test_upgrade_derives_stale_runs_anew(database: Path) -> None:
    con = open_file(database, read_only=False)
    con.execute(
        "INSERT INTO store.run (run_id, name, created_at, msgflow_version, derivation_hash) "
        "VALUES (1, 'stale', now(), '0', 'old')"
    )
    con.close()
    assert migrate.upgrade(database).rederived_runs == ("stale",)
    con = connect(database, read_only=True)
    assert derive.stale_runs(con) == []


def test_upgrade_of_an_empty_database_file(tmp_path: Path) -> None:
    path = tmp_path / "empty.duckdb"
    duckdb.connect(str(path)).close()
    assert migrate.upgrade(path).before is None
    assert recorded_revision(connect(path, read_only=True)) == objects.head_revision()


def test_downgrade_leaves_no_table(database: Path) -> None:
    con = open_file(database, read_only=False)
    migrate.downgrade(con, "base")
    rows = con.execute(
        "SELECT table_name FROM duckdb_tables() WHERE schema_name = 'store' "
        "AND table_name <> 'alembic_version'"
    ).fetchall()
    assert rows == []


def test_create_refuses_a_file_that_is_there(database: Path) -> None:
    with pytest.raises(DatabaseError, match="is there already"):
        migrate.create(database)


def test_create_needs_a_directory(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="cannot write"):
        migrate.create(tmp_path / "missing" / "new.duckdb")


def test_foreign_database_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "foreign.duckdb"
    con = duckdb.connect(str(path))
    con.execute("CREATE TABLE something (id INTEGER)")
    con.close()
    for action in (lambda: connect(path, read_only=True), lambda: migrate.upgrade(path)):
        with pytest.raises(DatabaseError, match="not one of msgflow"):
            action()


def test_newer_database_is_refused(database: Path) -> None:
    con = open_file(database, read_only=False)
    con.execute("UPDATE store.alembic_version SET version_num = '9999'")
    con.close()
    for action in (lambda: connect(database, read_only=True), lambda: migrate.upgrade(database)):
        with pytest.raises(DatabaseError, match="newer than this msgflow"):
            action()


def test_a_text_file_is_no_database(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("not a database" * 1000)
    with pytest.raises(DatabaseError, match="cannot open as a DuckDB database"):
        connect(path, read_only=True)


def test_a_failing_view_leaves_the_old_ones(
    database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    con = open_file(database, read_only=False)
    con.execute("UPDATE store.definition SET hash = 'old'")
    before = con.execute("SELECT view_name, sql FROM duckdb_views() ORDER BY ALL").fetchall()
    con.close()

    def broken(_: object) -> str:
        return "CREATE VIEW main.broken AS SELECT nothing FROM nowhere"

    monkeypatch.setattr(objects, "create_statement", broken)
    with pytest.raises(duckdb.Error):
        migrate.upgrade(database)
    monkeypatch.undo()
    con = open_file(database, read_only=True)
    assert (
        con.execute("SELECT view_name, sql FROM duckdb_views() ORDER BY ALL").fetchall() == before
    )
