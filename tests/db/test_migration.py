"""Databases are created and upgraded to what the tables and views say."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest.mock import Mock

import duckdb
import pytest
from support.thorough import examples, thorough

from msgflow.db import derivation, migration, objects
from msgflow.db.connection import INGEST_AGAIN, connect, recorded_revision
from msgflow.db.empty_database import write_empty
from msgflow.db.sandbox import open_file
from msgflow.db.store_table import store_file
from msgflow.errors import DatabaseError
from msgflow.files.resources import resource_directory

HEAD = objects.head_revision()
# A revision before that, made up: it lacks a column, which the next fills from other rows.
BEFORE = "0000_before"
ADD_COLUMN = """
    ALTER TABLE store.run ADD COLUMN clock_sync VARCHAR;
    UPDATE store.run SET clock_sync = CASE
        WHEN run_id IN (SELECT run_id FROM store.clock WHERE method = 'file') THEN 'file'
        ELSE 'none'
    END
"""
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
    migration.create(path)
    return path


@pytest.fixture
def before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The made-up revision, while msgflow has it: frozen as a release freezes one."""
    folder = tmp_path / "migrations"
    shutil.copytree(resource_directory("migrations"), folder)
    newest = folder / "versions" / f"{HEAD}.py"
    older = newest.read_text().replace("store_file()", "Path(__file__).with_suffix('.sql')")
    newest.with_name(f"{BEFORE}.py").write_text(
        f"from pathlib import Path\n{older.replace(HEAD, BEFORE)}"
    )
    tables, removed = re.subn(r",(  --.*)\n    clock_sync .*", r"\1", store_file().read_text())
    assert removed == 1
    newest.with_name(f"{BEFORE}.sql").write_text(tables)
    newest.write_text(
        f"from alembic import op\nrevision, down_revision = {HEAD!r}, {BEFORE!r}\n"
        f"def upgrade(): op.execute({ADD_COLUMN!r})\n"
    )
    for module in (objects, migration):
        monkeypatch.setattr(
            module,
            "resource_directory",
            lambda name: folder if name == "migrations" else resource_directory(name),
        )
    objects.known_revisions.cache_clear()
    yield BEFORE
    objects.known_revisions.cache_clear()


@pytest.fixture(params=[BEFORE, thorough(HEAD)])
def revision(request: pytest.FixtureRequest) -> str:
    """Each revision that can be upgraded, and one before."""
    if request.param == BEFORE:
        request.getfixturevalue("before")
    return request.param


def old_file(path: Path, revision: str) -> Path:
    """Make a file by the migrations up to `revision`, with rows, each table another number."""
    with contextlib.closing(open_file(path, read_only=False)) as con:
        con.execute("CREATE SCHEMA store")
        with migration.migrated(con, revision):
            pass
        for count, (table, columns) in enumerate(tables_of(con).items(), 1):
            values = ", ".join(value(place, kind) for place, kind in enumerate(columns.values()))
            con.execute(f"INSERT INTO store.{table} SELECT {values} FROM range({count}) AS _(n)")
        # Made-up rows cannot be derived anew.
        con.execute("UPDATE store.run SET derivation_hash = ?", [derivation.derivation_hash()])
    return path


def tables_of(con: duckdb.DuckDBPyConnection) -> dict[str, dict[str, str]]:
    """Tables that hold runs, each with the types of its columns."""
    tables: dict[str, dict[str, str]] = {}
    for table, column, kind in con.execute(
        "SELECT table_name, column_name, data_type FROM duckdb_columns() "
        "WHERE schema_name = 'store' AND table_name NOT IN ('alembic_version', 'definition') "
        "ORDER BY table_name, column_index"
    ).fetchall():
        tables.setdefault(table, {})[column] = kind
    return tables


def value(place: int, kind: str) -> str:
    """An expression whose value differs between rows `n` and places of columns."""
    if kind.endswith("[]"):
        return f"[{value(place, kind.removesuffix('[]'))}]"
    number = f"(1000 * {place} + n)"
    special = {"BLOB": f"encode({number}::VARCHAR)", "TIMESTAMP": f"make_timestamp({number})"}
    return special.get(kind, f"{number}::{kind}")


def rows_by_count(path: Path) -> dict[int, dict[str, tuple[object, ...]]]:
    """The columns of each table that has rows, by the number of these."""
    result = {}
    with duckdb.connect(str(path), read_only=True) as con:
        for table, columns in tables_of(con).items():
            rows = con.execute(f"FROM store.{table} ORDER BY ALL").fetchall()
            if rows:
                result[len(rows)] = dict(zip(columns, zip(*rows, strict=True), strict=True))
    return result


def test_a_file_of_each_revision_becomes_what_a_new_one_is(
    database: Path, tmp_path: Path, revision: str
) -> None:
    """The newest is one of them: its migrations make what the declaration of the tables says."""
    path = old_file(tmp_path / "old.duckdb", revision)
    before = rows_by_count(path)
    with pytest.raises(DatabaseError) as refused:
        connect(path, read_only=True)
    assert refused.value.hint == f"msgflow db upgrade --db {path}"
    done = migration.upgrade(path)
    assert (done.before, done.after) == (revision, objects.head_revision())
    assert done.views_changed
    assert done.rederived_runs == ()

    found, wanted = schema_of(path), schema_of(database)
    for name in SCHEMA:
        assert found[name], name
        assert found[name] == wanted[name], name
    # A table may have another name now, and other columns; its number of rows tells which it is.
    after = rows_by_count(path)
    assert after.keys() == before.keys()
    for count, columns in before.items():
        kept = columns.keys() & after[count].keys()
        assert kept > {"run_id"}
        assert {name: after[count][name] for name in kept} == {name: columns[name] for name in kept}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        thorough("ALTER TABLE store.take ADD COLUMN more BIGINT", r"another table store\.take"),
        # A migration reads it.
        ("ALTER TABLE store.finding RENAME TO diagnostic", r"a foreign table store\.diagnostic"),
    ],
)
def test_a_file_with_tables_that_its_revision_does_not_have_is_refused(
    tmp_path: Path, revision: str, change: str, message: str
) -> None:
    """Revisions of before the first release had the same names."""
    path = old_file(tmp_path / "old.duckdb", revision)
    with duckdb.connect(str(path)) as con:
        con.execute(change)
    before = path.read_bytes()
    with pytest.raises(DatabaseError, match=message) as refused:
        migration.upgrade(path)
    assert refused.value.hint == INGEST_AGAIN
    assert path.read_bytes() == before


def older(path: Path) -> None:
    """Make a file with runs one of the made-up revision, as ingests of that time left it."""
    with duckdb.connect(str(path)) as con:
        objects.drop(con)
        con.execute("ALTER TABLE store.run DROP COLUMN clock_sync")
        con.execute("UPDATE store.alembic_version SET version_num = ?", [BEFORE])
        con.execute("UPDATE store.run SET derivation_hash = ''")
        con.execute(
            "INSERT INTO store.clock (clock_id, run_id, offset_ns, drift_ppb, reference_ns, method)"
            " VALUES (91, 2, 0, 0, 0, 'file')"
        )


@pytest.mark.thorough
def test_an_older_file_keeps_its_runs(small_database: Path, tmp_path: Path, before: str) -> None:
    """And the migration tells from clocks how clocks were brought together."""
    older(small_database)
    kept = "SELECT run_id, name, created_at, start_ns, end_ns, event_count, labels FROM store.run"
    with duckdb.connect(str(small_database)) as con:
        runs = con.execute(f"{kept} ORDER BY run_id").fetchall()
        counted = con.execute("SELECT count(*) FROM store.publication").fetchall()

    with pytest.raises(
        DatabaseError, match=f"has schema revision {before}, .* needs {HEAD}"
    ) as refused:
        connect(small_database, read_only=True)
    assert refused.value.hint == f"msgflow db upgrade --db {small_database}"
    done = migration.upgrade(small_database)
    assert (done.before, done.after, done.views_changed) == (before, HEAD, True)
    assert len(done.rederived_runs) == len(runs) == 2

    new = tmp_path / "new.duckdb"
    migration.create(new)
    assert schema_of(small_database) == schema_of(new)
    with connect(small_database, read_only=True) as con:
        assert con.execute(f"{kept} ORDER BY run_id").fetchall() == runs
        assert con.execute("SELECT count(*) FROM main.publication").fetchall() == counted
        found = con.execute("SELECT run_id, clock_sync FROM store.run").fetchall()
    assert dict(found) == {1: "none", 2: "file"}


@pytest.mark.thorough
def test_a_failing_view_leaves_the_tables_of_an_older_file(
    small_database: Path, monkeypatch: pytest.MonkeyPatch, before: str
) -> None:
    older(small_database)
    rows = rows_by_count(small_database)
    monkeypatch.setattr(objects, "create_statement", lambda _: "CREATE VIEW main.broken AS FROM no")
    with pytest.raises(duckdb.CatalogException, match="no"):
        migration.upgrade(small_database)
    with duckdb.connect(str(small_database), read_only=True) as con:
        assert recorded_revision(con) == before
        assert "clock_sync" not in tables_of(con)["run"]
    assert rows_by_count(small_database) == rows


@pytest.mark.thorough
def test_other_tables_without_another_revision_are_refused(database: Path) -> None:
    """As databases of between two releases have them."""
    with duckdb.connect(str(database)) as con:
        con.execute("ALTER TABLE store.take ADD COLUMN more BIGINT")
    for action in (lambda: connect(database, read_only=False), lambda: migration.upgrade(database)):
        with pytest.raises(DatabaseError, match=r"another table store\.take") as refused:
            action()
        assert refused.value.hint == INGEST_AGAIN


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
    damages = (whole[:5000] + b"x" + whole[5001:], b"", whole[:-1])
    for n, damage in enumerate(damages[: examples(1, 3)]):
        kept.write_bytes(damage)
        again = tmp_path / f"again{n}.duckdb"
        write_empty(again)
        assert schema_of(again) == schema_of(database)
        assert kept.read_bytes().partition(b"\n")[2] == again.read_bytes() != made.read_bytes()


@pytest.mark.thorough
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


@pytest.mark.thorough
def test_a_new_database_needs_neither_alembic_nor_sqlalchemy(tmp_path: Path) -> None:
    program = """
import sys
from pathlib import Path
from unittest.mock import Mock
from msgflow.db import migration
migration.create(Path(sys.argv[1]))
assert migration.upgrade(Path(sys.argv[1])).before is not None
print({"alembic", "sqlalchemy", "duckdb_engine"} & sys.modules.keys())
"""
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "new.duckdb")],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    assert done.stdout == "set()\n", done.stderr


def test_the_hash_of_definitions_is_of_all_files_that_make_them(tmp_path: Path) -> None:
    root = resource_directory("schema").parent
    for name in ("msgflow", "schema"):
        ignored = shutil.ignore_patterns("__pycache__", "static")
        shutil.copytree(root / name, tmp_path / name, ignore=ignored)
    (tmp_path / "pyproject.toml").touch()
    program = """
import sys
from pathlib import Path
from unittest.mock import Mock
from msgflow.db.objects import definition_hash
print(definition_hash())
for path in map(Path, sys.argv[1:]):
    path.write_text(path.read_text() + "\\n")
    definition_hash.cache_clear()
    print(definition_hash())
"""
    files = [
        "msgflow/db/store_table.py", "msgflow/db/empty_database.py", "msgflow/db/finding.py",
        "schema/store.sql", "schema/public/run.sql", "schema/health/recording/lost_packets.sql",
    ]  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", program, *files],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert len(set(done.stdout.split())) == len(files) + 1


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


@pytest.mark.thorough
def test_upgrade_applies_changed_views(database: Path) -> None:
    con = open_file(database, read_only=False)
    con.execute("UPDATE store.definition SET hash = 'old'")
    con.execute("CREATE VIEW main.left_over AS SELECT 1 AS one")
    con.close()
    with pytest.raises(DatabaseError, match="views of another msgflow version"):
        connect(database, read_only=True)
    done = migration.upgrade(database)
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
    assert migration.upgrade(database).rederived_runs == ("stale",)
    con = connect(database, read_only=True)
    assert derivation.stale_runs(con) == []


def test_upgrade_of_other_tables_is_refused(database: Path) -> None:
    with duckdb.connect(str(database)) as con:
        con.execute("DROP TABLE store.flow_hop CASCADE")
        con.execute("UPDATE store.definition SET hash = 'of before' WHERE name = 'views'")
    before = database.read_bytes()
    # What only reads does not advise what would be refused.
    for command in (migration.upgrade, lambda path: connect(path, read_only=True)):
        with pytest.raises(DatabaseError, match="lacks a table") as raised:
            command(database)
        assert raised.value.hint == INGEST_AGAIN
    assert database.read_bytes() == before


def test_upgrade_of_an_empty_database_file(tmp_path: Path) -> None:
    path = tmp_path / "empty.duckdb"
    duckdb.connect(str(path)).close()
    assert migration.upgrade(path).before is None
    assert recorded_revision(connect(path, read_only=True)) == objects.head_revision()


def test_create_refuses_a_file_that_is_there(database: Path) -> None:
    with pytest.raises(DatabaseError, match="is there already"):
        migration.create(database)


def test_create_needs_a_directory(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="cannot write"):
        migration.create(tmp_path / "missing" / "new.duckdb")


def test_foreign_database_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "foreign.duckdb"
    con = duckdb.connect(str(path))
    con.execute("CREATE TABLE something (id INTEGER)")
    con.close()
    for action in (lambda: connect(path, read_only=True), lambda: migration.upgrade(path)):
        with pytest.raises(DatabaseError, match="not one of msgflow"):
            action()


@pytest.mark.parametrize(
    ("number", "message", "hint"),
    [
        (
            "9999_more",
            "'9999_more', which this msgflow does not know",
            "upgrade msgflow if another one is newer, or ingest the traces into",
        ),
        ("08", "08, from before the first release", "msgflow ingest TRACE --db NEW.duckdb reads"),
        ("0011", "0011, from before the first release", "msgflow ingest TRACE --db NEW.duckdb"),
    ],
)
def test_a_file_of_another_revision_is_refused(
    database: Path, number: str, message: str, hint: str
) -> None:
    with duckdb.connect(str(database)) as con:
        con.execute("UPDATE store.alembic_version SET version_num = ?", [number])
    for action in (lambda: connect(database, read_only=True), lambda: migration.upgrade(database)):
        with pytest.raises(DatabaseError, match=f"{message}.* — {database}") as refused:
            action()
        assert hint in (refused.value.hint or "")


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
        migration.upgrade(database)
    monkeypatch.undo()
    con = open_file(database, read_only=True)
    assert (
        con.execute("SELECT view_name, sql FROM duckdb_views() ORDER BY ALL").fetchall() == before
    )


@pytest.mark.thorough
def test_an_upgrade_that_ends_early_changes_nothing(
    database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not even the views, if the links of a run cannot be derived."""
    with duckdb.connect(str(database)) as con:
        con.execute(
            "INSERT INTO store.run (run_id, name, created_at, msgflow_version, derivation_hash) "
            "VALUES (1, 'stale', now(), '0', 'old')"
        )
        con.execute("CREATE OR REPLACE VIEW main.run AS SELECT 1 AS one")
    monkeypatch.setattr(migration, "derive", Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        migration.upgrade(database)
    with duckdb.connect(str(database)) as con:
        assert con.execute("FROM main.run").fetchall() == [(1,)]
        assert con.execute("SELECT derivation_hash FROM store.run").fetchall() == [("old",)]
    monkeypatch.undo()
    done = migration.upgrade(database)
    assert done.views_changed
    assert done.rederived_runs == ("stale",)


def test_a_small_recording_takes_little_room(simulated: Callable[..., Path]) -> None:
    """With DuckDB's own blocks it takes twice as much."""
    assert simulated("demo", 0.1).stat().st_size < 7e6


def test_times_are_compressed_well(tmp_path: Path) -> None:
    path = tmp_path / "times.duckdb"
    write_empty(path)
    before = path.stat().st_size
    with contextlib.closing(open_file(path, read_only=False)) as con:
        con.execute(
            "INSERT INTO store.failed_take SELECT 1, 1, 1, 1, 1, 1000000 * n + hash(n) % 100000 "
            "FROM range(1000000) AS r(n)"
        )
        con.execute("CHECKPOINT")
    # Smaller blocks: as many bytes as numbers have that are not compressed.
    assert path.stat().st_size - before < 4e6
