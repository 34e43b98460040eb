"""Views of runs that a lake holds without them are those that it would hold."""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import duckdb
import pyarrow as pa
import pytest

from msgflow.errors import DatabaseError, QueryError
from msgflow.fleet.lake import Lake
from msgflow.fleet.lake_connection import Choice, Reading, choose
from msgflow.fleet.lake_query import fleet_sql
from msgflow.fleet.layout import database_path

COUNT = "SELECT run, count(*) AS n FROM view.topic JOIN run USING (run) GROUP BY ALL ORDER BY ALL"


def without_views(choice: Choice, *names: str) -> Choice:
    """Return the same runs, some as if they had been written without views."""
    parts = [None if run["name"] in names else run["view_part"] for run in choice.runs.to_pylist()]
    place = choice.runs.column_names.index("view_part")
    runs = choice.runs.set_column(place, "view_part", pa.array(parts, pa.string()))
    return replace(choice, runs=runs)


def views_of(choice: Choice) -> dict[str, list[tuple[object, ...]]]:
    """Return the columns and rows of all views."""
    with Reading(choice) as reading:
        found = {}
        for table in sorted(reading.tables):
            schema, _, name = table.rpartition("/")
            if schema:
                rows = reading.connection.execute(f'FROM "view"."{name}" ORDER BY ALL')
                columns = tuple((each[0], str(each[1])) for each in rows.description)
                found[name] = [columns, *rows.fetchall()]
    return found


@pytest.mark.thorough
def test_views_in_databases_are_those_in_files(
    night: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    choice = choose(night, "name IN ('first', 'second')")
    files = views_of(choice)
    assert len(files) > 60
    assert sum(map(len, files.values())) > 1_000
    # A process that asks leaves nothing where temporary files are.
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    assert views_of(without_views(choice, "first", "second")) == files
    assert views_of(without_views(choice, "second")) == files
    assert not list(tmp_path.iterdir())


@pytest.mark.thorough
def test_sql_fetches_the_databases_of_views_that_it_names(night: Lake, tmp_path: Path) -> None:
    lake = Lake.open(shutil.copytree(night.store.url, tmp_path / "lake"))
    expected = fleet_sql(lake, COUNT).table
    listed = fleet_sql(lake, "SHOW ALL TABLES").table
    rows = [row | {"labels": dict(row["labels"] or ())} for row in lake.runs().to_pylist()]
    lake.commit(row | {"view_part": None} for row in rows)
    shutil.rmtree(tmp_path / "lake" / "view")
    assert fleet_sql(lake, COUNT).table.equals(expected)
    assert fleet_sql(lake, "SHOW ALL TABLES").table.equals(listed)
    for part in {row["database_part"] for row in rows if row["name"] == "second"}:
        lake.store.delete(database_path(part))
    assert len(fleet_sql(lake, COUNT, where="name = 'first'")) == 1
    assert len(fleet_sql(lake, "SELECT DISTINCT run FROM flow")) == 3
    with pytest.raises(DatabaseError, match="the database of the run is gone"):
        fleet_sql(lake, COUNT)


def test_it_is_said_where_runs_have_no_views(night: Lake) -> None:
    with pytest.raises(QueryError, match="Table with name topic does not exist") as raised:
        fleet_sql(night, COUNT, where="name = 'copy'")
    assert "these runs have no views" in (raised.value.hint or "")


@pytest.mark.thorough
def test_a_database_of_an_earlier_version_is_upgraded(night: Lake, tmp_path: Path) -> None:
    lake = Lake.open(shutil.copytree(night.store.url, tmp_path / "lake"))
    (row,) = (row for row in lake.runs().to_pylist() if row["name"] == "first")
    expected = fleet_sql(lake, COUNT, where="name = 'first'").table
    path, database = database_path(row["database_part"]), tmp_path / "earlier.duckdb"
    with pa.input_stream(lake.store.full(path), compression="zstd") as source:
        database.write_bytes(source.read())
    with duckdb.connect(str(database)) as con:
        con.execute("UPDATE store.definition SET hash = 'earlier' WHERE name = 'views'")
        con.execute("DROP VIEW main.topic")
    sink = pa.BufferOutputStream()
    with pa.CompressedOutputStream(sink, "zstd") as packing:
        packing.write(database.read_bytes())
    lake.store.put(path, sink.getvalue().to_pybytes())
    lake.commit([row | {"labels": dict(row["labels"]), "view_part": None}])
    assert fleet_sql(lake, COUNT, where="name = 'first'").table.equals(expected)
