"""A database from elsewhere: commands that write compare its definitions with ours first."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import duckdb
import pytest
from support.thorough import few

import msgflow
from msgflow.db import migration, objects
from msgflow.db.connection import connect, definitions
from msgflow.db.runs import change_runs
from msgflow.errors import DatabaseError
from msgflow.files.yaml_file import YamlFile
from msgflow.ingest import ingest
from msgflow.links.annotations import apply_links
from msgflow.links.links_file import LinksFile
from msgflow_sim import simulate

# What was done to the database, and what an upgrade cannot undo.
CHANGES = {
    "view main.run": (
        "CREATE OR REPLACE VIEW main.run AS SELECT run_id, (FROM read_text('{secret}')"
        " SELECT content) AS name, start_ns FROM store.run"
    ),
    "view derive.recording_gap": "DROP VIEW derive.recording_gap",
    "macro derive.corrected_ns": (
        "CREATE OR REPLACE MACRO derive.corrected_ns(time_ns, clock) AS time_ns"
    ),
    "macro main.sum": "CREATE MACRO main.sum(x) AS 42",
    "view main.mine": "CREATE VIEW main.mine AS SELECT 1",
    "view store.mine": "CREATE VIEW store.mine AS SELECT 1",
    "table main.mine": "CREATE TABLE main.mine (x BIGINT)",
    "table store.host": (
        "ALTER TABLE store.host ADD COLUMN more VARCHAR DEFAULT getvariable('secret')"
    ),
    "type main.mine": "CREATE TYPE main.mine AS ENUM ('a')",
}
LASTING = ("table", "type")


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return simulate("pipeline", tmp_path_factory.mktemp("trace") / "t", factor=0.01).directory


def writers(trace: Path) -> tuple[Callable[[Path], object], ...]:
    """Return all that writes into a database."""
    no_links = LinksFile(YamlFile(Path("x"), "", ""), ())
    return (
        lambda path: change_runs(path, "all", partial(apply_links, file=no_links)),
        lambda path: msgflow.open_db(path).apply_clocks("none", run="all"),
        lambda path: ingest([trace], path),
        lambda path: msgflow.open_db(path).rename_run("noon", "evening"),
        lambda path: msgflow.open_db(path).label_runs("noon", robot="r1"),
        lambda path: msgflow.open_db(path).remove_runs("noon"),
    )


@pytest.mark.parametrize("name", few(CHANGES, "view main.run"))
def test_a_changed_database_is_not_written(
    small_database: Path, trace: Path, tmp_path: Path, name: str
) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text("secret")
    with duckdb.connect(str(small_database)) as con:
        con.execute(CHANGES[name].format(secret=secret))
    before = small_database.read_bytes()
    for use in writers(trace):
        with pytest.raises(
            DatabaseError, match=f"not as this msgflow makes it: it .* {name} — "
        ) as raised:
            use(small_database)
        assert "secret" not in str(raised.value).replace(str(tmp_path), "")
        assert small_database.read_bytes() == before
    if name.startswith(LASTING):
        with pytest.raises(DatabaseError, match=name):
            migration.upgrade(small_database)
        return
    assert migration.upgrade(small_database).views_changed
    assert [run.name for run in msgflow.open_db(small_database).runs()] == ["morning", "noon"]


def test_reading_compares_nothing(small_database: Path) -> None:
    """It costs time with each command, and changed rows would deceive as well."""
    with duckdb.connect(str(small_database)) as con:
        con.execute("CREATE OR REPLACE VIEW main.topic AS SELECT 1 AS run_id, '/forged' AS name")
    with msgflow.open_db(small_database) as opened:
        assert opened.sql("SELECT name FROM topic").to_arrow().to_pylist() == [{"name": "/forged"}]


def test_a_trigger_is_foreign(small_database: Path, tmp_path: Path) -> None:
    """Files of DuckDB's newest format can have them."""
    if duckdb.__version__ < "2":
        pytest.skip("this DuckDB has no triggers")
    newer = tmp_path / "newer.duckdb"
    config = {"storage_compatibility_version": "v2.0.0"}
    with duckdb.connect(str(newer), config=config) as con:
        con.execute(f"ATTACH '{small_database}' AS ours (READ_ONLY)")
        con.execute("COPY FROM DATABASE ours TO newer")
        con.execute(
            "CREATE TRIGGER mine AFTER INSERT ON store.run FOR EACH STATEMENT"
            " INSERT INTO store.definition VALUES ('a', 'b', 'c')"
        )
    with pytest.raises(DatabaseError, match="has a foreign trigger"):
        connect(newer, read_only=False)


@pytest.mark.parametrize("read_only", [True, False])
def test_no_connection_reaches_other_files(
    small_database: Path, tmp_path: Path, read_only: bool
) -> None:
    secret = tmp_path / "elsewhere" / "secret.txt"
    secret.parent.mkdir()
    secret.write_text("secret")
    with connect(small_database, read_only=read_only) as con:
        for statement in (
            f"FROM read_text('{secret}')",
            f"COPY (SELECT 1) TO '{secret.parent / 'new'}'",
            f"ATTACH '{secret.parent / 'new'}' AS other",
            "LOAD httpfs",
            "INSTALL httpfs",
        ):
            with pytest.raises(duckdb.PermissionException):
                con.execute(statement)
        for setting in ("enable_external_access", "autoload_known_extensions", "threads"):
            with pytest.raises(duckdb.InvalidInputException, match="locked"):
                con.execute(f"SET {setting} = 1")
        off = con.execute(
            "SELECT name FROM duckdb_settings() WHERE value = 'false' AND name IN "
            "('autoinstall_known_extensions', 'autoload_known_extensions', "
            "'enable_external_access', 'python_enable_replacements') ORDER BY name"
        ).fetchall()
        assert len(off) == 4


@pytest.mark.parametrize("is_new", few([True, False], True))
def test_an_ingest_reaches_other_files_only_while_it_opens_its_own(
    small_database: Path, trace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_new: bool
) -> None:
    module = sys.modules[ingest.__module__]
    derive, seen = module.derive, []

    def tried(con: duckdb.DuckDBPyConnection, *arguments: object, **options: object) -> None:
        with pytest.raises(duckdb.PermissionException):
            con.cursor().execute(f"FROM read_text('{__file__}')")
        with pytest.raises(duckdb.PermissionException):
            con.cursor().execute(f"COPY (SELECT 1) TO '{tmp_path / 'new.csv'}'")
        seen.append(con)
        derive(con, *arguments, **options)

    monkeypatch.setattr(module, "derive", tried)
    path = tmp_path / "made.duckdb" if is_new else small_database
    ingest([trace], path, keep_staging=tmp_path / "deep" / "staging")
    assert seen
    assert list((tmp_path / "deep" / "staging").glob("*.parquet"))


@pytest.mark.thorough
def test_a_database_of_this_msgflow_is_written_and_read(
    small_database: Path, tmp_path: Path
) -> None:
    """Also where there is no cache, which only saves time."""
    with connect(small_database, read_only=False) as con:
        assert set(definitions(con)) > {"view main.run", "table store.run"}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path / "none"))
        (tmp_path / "none").write_text("a file")
        migration.create(tmp_path / "new.duckdb")
        connect(tmp_path / "new.duckdb", read_only=False).close()


def test_what_is_materialized_is_so_in_a_file_as_well(tmp_path: Path) -> None:
    """Files of a storage version before v1.5.0 lose the word, and with it memory and time."""
    path = tmp_path / "new.duckdb"
    migration.create(path)
    with connect(path, read_only=True) as con:
        macros = con.execute(
            "SELECT schema_name || '.' || function_name, upper(macro_definition) "
            "FROM duckdb_functions() WHERE macro_definition IS NOT NULL AND NOT internal"
        ).fetchall()
        views = con.execute(
            "SELECT schema_name || '.' || view_name, upper(sql) FROM duckdb_views() "
            "WHERE NOT internal"
        ).fetchall()
    stored = dict(macros) | dict(views)
    said = {
        header.name: len(
            re.findall(r"AS (?:NOT )?MATERIALIZED \(", re.sub("--.*", "", header.body))
        )
        for header in objects.views()
    }
    assert sum(said.values()) > 30
    assert said == {name: stored[name].count("MATERIALIZED (") for name in said}


def test_views_of_others_are_no_mistake_of_msgflow(small_database: Path) -> None:
    with duckdb.connect(str(small_database)) as con:
        con.execute("CREATE OR REPLACE VIEW main.finding AS SELECT 1 AS run_id")
    with (
        pytest.raises(DatabaseError, match=r"another view main\.finding") as raised,
        msgflow.open_db(small_database) as database,
    ):
        database.findings()
    assert f"msgflow db upgrade --db {small_database}" in str(raised.value)
