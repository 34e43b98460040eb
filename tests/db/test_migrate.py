"""Databases are created and upgraded to what the tables and views say."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import duckdb
import pytest

from msgflow.db import derive, migrate, objects
from msgflow.db.connection import connect, recorded_revision
from msgflow.db.definition_check import expected_definitions
from msgflow.db.empty_database import write_empty
from msgflow.db.sandbox import open_file
from msgflow.errors import DatabaseError
from msgflow.resources import resource_directory

LABELS = Path(__file__).parents[1] / "data" / "migrations" / "0009_labels.py"

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


@pytest.fixture
def next_revision(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A msgflow of one revision more, made up: the one whose migration added the labels of runs."""
    later = tmp_path / "later"
    shutil.copytree(resource_directory("migrations"), later)
    shutil.copy(LABELS, later / "versions")

    def directory(name: str) -> Path:
        return later if name == "migrations" else resource_directory(name)

    caches = (objects.head_revision, objects.known_revisions, expected_definitions)
    with monkeypatch.context() as patched:
        patched.setattr(objects, "resource_directory", directory)
        patched.setattr(migrate, "resource_directory", directory)
        for cache in caches:
            cache.cache_clear()
        yield
    for cache in caches:
        cache.cache_clear()


def test_an_older_file_becomes_what_a_new_one_is(
    small_database: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    before = objects.head_revision()
    kept = "run_id, name, created_at, start_ns, end_ns, event_count"
    with duckdb.connect(str(small_database)) as con:
        objects.drop(con)
        con.execute("ALTER TABLE store.run DROP COLUMN labels")
        runs = con.execute(f"SELECT {kept} FROM store.run ORDER BY run_id").fetchall()
        counted = con.execute("SELECT count(*) FROM store.publication").fetchall()
    assert len(runs) == 2

    request.getfixturevalue("next_revision")
    with pytest.raises(DatabaseError, match=f"has schema revision {before}, .* needs 0009") as told:
        connect(small_database, read_only=True)
    assert told.value.hint == f"msgflow db upgrade --db {small_database}"
    done = migrate.upgrade(small_database)
    assert (done.before, done.after, done.views_changed) == (before, "0009", True)

    new = tmp_path / "new.duckdb"
    migrate.create(new)
    found, wanted = schema_of(small_database), schema_of(new)
    for name in SCHEMA:
        assert found[name], name
        assert found[name] == wanted[name], name
    with connect(small_database, read_only=True) as con:
        assert con.execute(f"SELECT {kept} FROM store.run ORDER BY run_id").fetchall() == runs
        assert con.execute("SELECT count(*) FROM main.publication").fetchall() == counted


@pytest.mark.usefixtures("next_revision")
def test_a_failing_migration_leaves_the_file_as_it_was(small_database: Path) -> None:
    """It adds a column that is there already."""
    with pytest.raises(duckdb.CatalogException, match="labels"):
        migrate.upgrade(small_database)
    with duckdb.connect(str(small_database), read_only=True) as con:
        assert recorded_revision(con) == "0008"
        assert con.execute("SELECT count(*) FROM main.run").fetchall() == [(2,)]


@pytest.mark.parametrize("revision", ["0001", "0007"])
def test_files_of_before_the_first_release_are_ingested_anew(database: Path, revision: str) -> None:
    with duckdb.connect(str(database)) as con:
        con.execute("UPDATE store.alembic_version SET version_num = ?", [revision])
    for action in (lambda: connect(database, read_only=True), lambda: migrate.upgrade(database)):
        with pytest.raises(DatabaseError, match=f"{revision}, from before the first") as told:
            action()
        assert told.value.hint == "ingest the traces into a new file"


def test_other_tables_without_another_revision_are_refused(database: Path) -> None:
    """As databases of between two releases have them."""
    with duckdb.connect(str(database)) as con:
        con.execute("ALTER TABLE store.take ADD COLUMN more BIGINT")
    for action in (lambda: connect(database, read_only=False), lambda: migrate.upgrade(database)):
        with pytest.raises(DatabaseError, match=r"another table store\.take") as told:
            action()
        assert told.value.hint == "ingest the traces into a new file"


def test_a_new_database_is_the_same_with_and_without_a_cache(
    database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    made = tmp_path / "made.duckdb"
    write_empty(made)
    (kept,) = (tmp_path / "cache" / "msgflow").iterdir()
    assert schema_of(made) == schema_of(database)
    whole = kept.read_bytes()

    # A file that is made anew differs, as each has an identifier.
    write_empty(tmp_path / "copied.duckdb")
    assert (tmp_path / "copied.duckdb").read_bytes() == made.read_bytes()
    for n, damage in enumerate((b"", whole[:-1], whole[:5000] + b"x" + whole[5001:])):
        kept.write_bytes(damage)
        again = tmp_path / f"again{n}.duckdb"
        write_empty(again)
        assert schema_of(again) == schema_of(database)
        assert kept.read_bytes().partition(b"\n")[2] == again.read_bytes() != made.read_bytes()


def test_the_cache_keeps_few_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "msgflow").mkdir()
    for n in range(20):
        (tmp_path / "msgflow" / f"database-{n}").touch()
        os.utime(tmp_path / "msgflow" / f"database-{n}", (n, n))
    write_empty(tmp_path / "new.duckdb")
    kept = {each.name for each in (tmp_path / "msgflow").iterdir()}
    assert len(kept) == 10
    assert kept > {f"database-{n}" for n in range(11, 20)}


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


def test_upgrade_of_other_tables_is_refused(database: Path) -> None:
    with duckdb.connect(str(database)) as con:
        con.execute("DROP TABLE store.flow_hop CASCADE")
        con.execute("UPDATE store.definition SET hash = 'of before' WHERE name = 'views'")
    before = database.read_bytes()
    with pytest.raises(DatabaseError, match="lacks a table") as raised:
        migrate.upgrade(database)
    assert raised.value.hint == "ingest the traces into a new file"
    assert database.read_bytes() == before


def test_upgrade_of_an_empty_database_file(tmp_path: Path) -> None:
    path = tmp_path / "empty.duckdb"
    duckdb.connect(str(path)).close()
    assert migrate.upgrade(path).before is None
    assert recorded_revision(connect(path, read_only=True)) == objects.head_revision()


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
