"""A run comes back from a lake as the database that it was."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import duckdb
import pyarrow as pa
import pytest
from typer.testing import CliRunner

from msgflow import Database
from msgflow.cli.app import app
from msgflow.errors import DatabaseError, QueryError, UsageError
from msgflow.fleet.lake import Lake
from msgflow.fleet.lake_query import fleet_sql
from msgflow.fleet.layout import database_path
from msgflow.fleet.run_database import open_run


def key_of(lake: Lake, name: str) -> str:
    runs = {row["name"]: row["run"] for row in lake.runs().to_pylist()}
    return str(runs[name])


def test_a_run_comes_back(night: Lake, databases: tuple[Path, Path], tmp_path: Path) -> None:
    key = key_of(night, "first")
    target = tmp_path / "back.duckdb"
    result = CliRunner().invoke(
        app, ["fleet", "open", "first", "--lake", night.store.url, "-o", str(target)]
    )
    assert result.exit_code == 0
    assert f"run first ({key}) is in {target}" in result.stderr
    with Database(target) as back, Database(databases[0]) as before:
        assert back.query("e2e-latency").table.equals(before.query("e2e-latency").table)
    assert list(tmp_path.iterdir()) == [target]
    content = target.read_bytes()
    with pytest.raises(UsageError, match="exists already"):
        open_run(night, key, target)
    assert target.read_bytes() == content


@pytest.mark.thorough
def test_the_file_is_named_by_the_key(
    night: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    key = key_of(night, "second")
    done = open_run(night, key[:6])
    assert (done.run, done.before) == (key, None)
    assert [path.name for path in tmp_path.iterdir()] == [f"{key}.duckdb"]


def test_what_a_killed_process_left_goes_with_the_next(
    night: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "back.duckdb"
    with monkeypatch.context() as patch:
        patch.setattr(os, "link", lambda *_: os._exit(1))
        if (child := os.fork()) == 0:
            open_run(night, "first", target)
    os.waitpid(child, 0)
    assert len(list(tmp_path.iterdir())) == 1
    open_run(night, "first", target)
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.thorough
def test_views_of_a_database_of_an_earlier_version_are_those_of_this_one(
    night: Lake, tmp_path: Path
) -> None:
    lake = Lake.open(shutil.copytree(night.store.url, tmp_path / "lake"))
    row = next(row for row in lake.runs().to_pylist() if row["name"] == "first")
    count = "SELECT count(*) AS n FROM view.topic"
    expected = fleet_sql(lake, count, where="name = 'first'").table
    path, database = database_path(row["database_part"]), tmp_path / "earlier.duckdb"
    with pa.input_stream(lake.store.full(path), compression="zstd") as source:
        database.write_bytes(source.read())
    with duckdb.connect(str(database)) as con:
        con.execute("UPDATE store.definition SET hash = 'earlier' WHERE name = 'views'")
        con.execute("DROP VIEW main.topic")
    with pa.output_stream(lake.store.full(path), compression="zstd") as packing:
        packing.write(database.read_bytes())
    assert fleet_sql(lake, count, where="name = 'first'").table.equals(expected)


def test_it_is_said_where_runs_have_no_views(night: Lake) -> None:
    with pytest.raises(QueryError, match="Table with name topic does not exist") as raised:
        fleet_sql(night, "FROM view.topic", where="name = 'copy'")
    assert "these runs have no views" in (raised.value.hint or "")


def test_runs_that_cannot_be_opened(night: Lake, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such run — nothing"):
        open_run(night, "nothing", tmp_path / "x.duckdb")
    with pytest.raises(UsageError, match=r"(?s)--no-database.*msgflow ingest /recordings/first"):
        open_run(night, "copy", tmp_path / "x.duckdb")
    with pytest.raises(UsageError, match="no such folder"):
        open_run(night, "first", tmp_path / "nowhere" / "x.duckdb")
    assert not list(tmp_path.iterdir())


@pytest.mark.thorough
def test_what_is_not_the_database_of_the_run_is_refused(night: Lake, tmp_path: Path) -> None:
    lake = Lake.open(tmp_path / "lake", create=True)
    rows = {row["name"]: row for row in night.runs().to_pylist()}
    other = night.store.read(database_path(rows["second"]["database_part"]))
    assert other is not None
    for number, (content, words) in enumerate(
        (
            (other, "that of another run"),
            (b"no zstd", "cannot be used"),
            (other[: len(other) // 2], "cannot be used"),
            (None, "it is gone"),
        )
    ):
        part = f"part{number}"
        lake.commit([{**rows["first"], "database_part": part}])
        if content is not None:
            lake.store.put(database_path(part), content)
        with pytest.raises(DatabaseError, match=words):
            open_run(lake, "first", tmp_path / "x.duckdb")
    lake.commit([{**rows["second"], "name": "first"}])
    with pytest.raises(UsageError, match="2 runs are called so"):
        open_run(lake, "first", tmp_path / "x.duckdb")
    assert [path.name for path in tmp_path.iterdir()] == ["lake"]
