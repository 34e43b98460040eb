"""Databases are created and upgraded to what the tables and views say."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import duckdb
import pytest
from alembic import command

from msgflow.db import create, derive, migrate, objects
from msgflow.db.connection import connect, open_file, recorded_revision
from msgflow.errors import DatabaseError

# All that a schema is, row by row.
SCHEMA = {
    "tables": "SELECT schema_name, table_name, comment FROM duckdb_tables()",
    "columns": (
        "SELECT schema_name, table_name, column_index, column_name, data_type, is_nullable, "
        "column_default, comment FROM duckdb_columns() WHERE NOT internal"
    ),
    "constraints": (
        "SELECT schema_name, table_name, constraint_type, constraint_column_names "
        "FROM duckdb_constraints()"
    ),
    "views": "SELECT schema_name, view_name, sql, comment FROM duckdb_views() WHERE NOT internal",
    "macros": (
        "SELECT schema_name, function_name, parameters, macro_definition FROM duckdb_functions() "
        "WHERE NOT internal"
    ),
    "revision": "SELECT version_num FROM store.alembic_version",
    "definition": "FROM store.definition",
}


def schema_of(path: Path) -> dict[str, list[object]]:
    with connect(path, read_only=True) as con:
        return {
            name: con.execute(f"SELECT * FROM ({query}) ORDER BY ALL").fetchall()
            for name, query in SCHEMA.items()
        }


@pytest.fixture
def database(tmp_path: Path) -> Path:
    path = tmp_path / "new.duckdb"
    migrate.create(path)
    return path


@pytest.mark.parametrize("revision", sorted(objects.known_revisions() - {objects.head_revision()}))
def test_a_file_of_any_revision_becomes_what_a_new_one_is(
    database: Path, tmp_path: Path, revision: str
) -> None:
    old = tmp_path / "old.duckdb"
    with open_file(old, read_only=False) as con:
        con.execute("CREATE SCHEMA store")
        with migrate.sqlalchemy_connection(con) as connection:
            command.upgrade(migrate.alembic_config(connection), revision)
        assert recorded_revision(con) == revision
    with pytest.raises(DatabaseError, match=f"has schema revision {revision}"):
        connect(old, read_only=True)
    assert migrate.upgrade(old).before == revision
    found, wanted = schema_of(old), schema_of(database)
    for name in SCHEMA:
        assert found[name], name
        assert found[name] == wanted[name], name


def test_a_new_database_is_the_same_with_and_without_a_cache(
    database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    made = tmp_path / "made.duckdb"
    create.write_new(made)
    (kept,) = (tmp_path / "cache" / "msgflow").glob("database-*")
    assert schema_of(made) == schema_of(database)

    monkeypatch.setattr(create, "_statements", lambda: pytest.fail("made again"))
    create.write_new(tmp_path / "copied.duckdb")
    assert (tmp_path / "copied.duckdb").read_bytes() == made.read_bytes()
    assert schema_of(tmp_path / "copied.duckdb") == schema_of(made)

    monkeypatch.undo()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    whole = kept.read_bytes()
    for number, damage in enumerate((b"", whole[:-1], whole[:5000] + b"x" + whole[5001:])):
        kept.write_bytes(damage)
        again = tmp_path / f"{number}.duckdb"
        create.write_new(again)
        assert schema_of(again) == schema_of(database)


def test_a_new_database_needs_neither_alembic_nor_a_dialect(tmp_path: Path) -> None:
    program = """
import sys
from pathlib import Path
from msgflow.db import migrate
migrate.create(Path(sys.argv[1]))
assert migrate.upgrade(Path(sys.argv[1])).before is not None
print(sorted({name.split(".")[0] for name in sys.modules} & {"alembic", "duckdb_engine"}))
"""
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "new.duckdb")],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    assert done.stdout == "[]\n", done.stderr


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
