"""A database from elsewhere: none of its SQL runs before it has been compared with ours."""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from thorough import few

import msgflow
from msgflow.clocks import apply_clocks, read_clock_sync
from msgflow.db import definition, migrate, objects
from msgflow.db.connection import connect
from msgflow.errors import DatabaseError
from msgflow.ingest import ingest
from msgflow.links import LinksFile, apply_links
from msgflow.sim import simulate

# What was done to the database, and what an upgrade cannot undo.
CHANGES = {
    "view main.run": (
        "CREATE OR REPLACE VIEW main.run AS SELECT run_id, (FROM read_text('{secret}')"
        " SELECT content) AS name, start_ns FROM store.run"
    ),
    "view derive.recording_gap": "DROP VIEW derive.recording_gap",
    "macro derive.corrected_ns": (
        "CREATE OR REPLACE MACRO derive.corrected_ns(time_ns, offset_ns, drift_ppb, reference_ns)"
        " AS time_ns"
    ),
    "macro main.sum": "CREATE MACRO main.sum(x) AS 42",
    "view main.mine": "CREATE VIEW main.mine AS SELECT 1",
    "table store.host": (
        "ALTER TABLE store.host ADD COLUMN more VARCHAR DEFAULT getvariable('secret')"
    ),
    "type main.mine": "CREATE TYPE main.mine AS ENUM ('a')",
}
LASTING = ("table", "type")


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return simulate("pipeline", tmp_path_factory.mktemp("trace") / "t", factor=0.01).directory


def readers(trace: Path) -> dict[str, Callable[[Path], object]]:
    """Everything that opens a database, in the same state."""
    return {
        "runs": lambda path: msgflow.open_db(path).runs(),
        "sql": lambda path: msgflow.open_db(path).sql("SELECT 1"),
        "query": lambda path: msgflow.open_db(path).query("info-runs"),
        "check": lambda path: msgflow.open_db(path).check(),
        "links": lambda path: apply_links(path, LinksFile(Path("x"), ()), run="all"),
        "clocks": lambda path: apply_clocks(path, read_clock_sync("none"), run="all"),
        "ingest": lambda path: ingest([trace], path),
    }


@pytest.mark.parametrize(
    "name", few(CHANGES, "view main.run", "macro derive.corrected_ns", "macro main.sum")
)
def test_a_changed_database_is_neither_read_nor_written(
    small_database: Path, trace: Path, tmp_path: Path, name: str
) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text("secret")
    with duckdb.connect(str(small_database)) as con:
        con.execute(CHANGES[name].format(secret=secret))
    before = small_database.read_bytes()
    for use in readers(trace).values():
        with pytest.raises(
            DatabaseError, match=f"not as msgflow makes it: it .* {name} — "
        ) as raised:
            use(small_database)
        assert "secret" not in str(raised.value).replace(str(tmp_path), "")
        assert small_database.read_bytes() == before
    if name.startswith(LASTING):
        with pytest.raises(DatabaseError, match=name):
            migrate.upgrade(small_database)
        return
    assert migrate.upgrade(small_database).views_changed
    assert [run.name for run in msgflow.open_db(small_database).runs()] == ["morning", "noon"]


def test_a_trigger_is_foreign(small_database: Path, tmp_path: Path) -> None:
    """Files of DuckDB's newest format can have them."""
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


def test_the_definitions_are_those_of_a_new_file(tmp_path: Path) -> None:
    path = tmp_path / "new.duckdb"
    migrate.create(path)
    with duckdb.connect(str(path), read_only=True) as con:
        assert definition.rendered(con) == definition._made()


def test_what_is_materialized_is_so_in_a_file_as_well(tmp_path: Path) -> None:
    """Files of a storage version before v1.5.0 lose the word, and with it memory and time."""
    path = tmp_path / "new.duckdb"
    migrate.create(path)
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


def test_the_cache_is_used_and_not_needed(
    small_database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    definition.expected.cache_clear()
    msgflow.open_db(small_database).runs()
    (cached,) = (tmp_path / "cache" / "msgflow").glob("definitions-*")
    assert json.loads(cached.read_bytes().split(b"\n", 1)[1]) == definition.expected()

    made, again = definition.expected(), []
    monkeypatch.setattr(definition, "_made", lambda: pytest.fail("made again"))
    definition.expected.cache_clear()
    msgflow.open_db(small_database).runs()

    monkeypatch.setattr(definition, "_made", lambda: again.append(made) or made)
    damages = ("", "[]", '{"a": 1}', "\0")
    for damage in damages:
        cached.write_text(damage)
        definition.expected.cache_clear()
        msgflow.open_db(small_database).runs()
    assert len(again) == len(damages)
    shutil.rmtree(tmp_path / "cache")
    (tmp_path / "cache").write_text("a file")
    definition.expected.cache_clear()
    msgflow.open_db(small_database).runs()
    definition.expected.cache_clear()


def test_an_ingest_into_a_new_file_fills_the_cache(
    trace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(definition, "_made", lambda: pytest.fail("made for nothing"))
    definition.expected.cache_clear()
    ingest([trace], tmp_path / "new.duckdb")
    assert msgflow.open_db(tmp_path / "new.duckdb").runs()
    definition.expected.cache_clear()
