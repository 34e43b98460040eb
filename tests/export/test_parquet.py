from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from msgflow import Database, UsageError, __version__
from msgflow.db.migrate import current_revision


def test_every_public_view_becomes_a_file_that_says_what_it_is(
    small_database: Path, tmp_path: Path
) -> None:
    with Database(small_database) as database:
        views = {row["view"] for row in database.schema().to_arrow().to_pylist()}
        exported = database.export_parquet(tmp_path / "out")
        revision = current_revision(database.connection.cursor())
    assert {view.view for view in exported} == views
    assert {path.stem for path in (tmp_path / "out").iterdir()} == views
    for view in exported:
        table = pq.read_table(view.path)
        assert table.num_rows == view.row_count
        assert table.schema.metadata == {
            b"msgflow.view": view.view.encode(),
            b"msgflow.version": __version__.encode(),
            b"msgflow.schema_revision": str(revision).encode(),
        }


def test_rows_are_those_of_the_view(small_database: Path, tmp_path: Path) -> None:
    with Database(small_database) as database:
        database.export_parquet(tmp_path, ["publisher"])
        rows = database.sql("FROM publisher ORDER BY publisher_id").to_arrow().to_pylist()
    assert len(rows) == 3
    assert pq.read_table(tmp_path / "publisher.parquet").to_pylist() == rows


def test_a_run_can_be_chosen(small_database: Path, tmp_path: Path) -> None:
    with Database(small_database) as database:
        database.export_parquet(tmp_path, ["publisher", "run"], run="morning")
    assert pq.read_table(tmp_path / "publisher.parquet")["run_id"].to_pylist() == [1]
    assert pq.read_table(tmp_path / "run.parquet")["name"].to_pylist() == ["morning"]


def test_equal_content_gives_equal_files(small_database: Path, tmp_path: Path) -> None:
    with Database(small_database) as database:
        database.export_parquet(tmp_path / "one", ["publisher"])
        database.export_parquet(tmp_path / "two", ["publisher"])
    one, two = (tmp_path / name / "publisher.parquet" for name in ("one", "two"))
    assert one.read_bytes() == two.read_bytes()


def test_files_are_replaced_only_when_told(small_database: Path, tmp_path: Path) -> None:
    existing = tmp_path / "publisher.parquet"
    existing.write_text("precious")
    with Database(small_database) as database:
        with pytest.raises(UsageError) as raised:
            database.export_parquet(tmp_path, ["publisher", "run"])
        assert str(existing) in raised.value.message
        assert [path.name for path in tmp_path.glob("*.parquet")] == ["publisher.parquet"]
        assert existing.read_text() == "precious"
        database.export_parquet(tmp_path, ["publisher"], force=True)
    assert pq.read_table(existing).num_rows == 3


def test_unknown_views_and_unusable_directories_are_named(
    small_database: Path, tmp_path: Path
) -> None:
    with Database(small_database) as database:
        with pytest.raises(UsageError) as raised:
            database.export_parquet(tmp_path, ["publishers"])
        assert raised.value.hint == "did you mean publisher?"
        with pytest.raises(UsageError, match="cannot create the directory"):
            database.export_parquet(small_database)
